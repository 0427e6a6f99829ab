"""What a case is refused for, and told, before any law is computed or any mesh is made."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from small_parts import WALLS, box_part, finned_block, held_bar

from gradedesign.design.case.read_case import load_case
from gradedesign.design.resolve import part_tets as mesh_module
from gradedesign.design.resolve import resolve_law as law_module
from gradedesign.design.resolve.design_model import prepare
from gradedesign.errors import CaseError, ResourceError
from gradedesign.geometry.formats.write_stl import write_stl
from gradedesign.geometry.part.box import box_surface
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawOrigin
from gradedesign.program.commands import check as check_module
from gradedesign.program.commands import main
from gradedesign.program.commands.check import print_check
from gradedesign.program.commands.check_data import check_data
from gradedesign.program.host.registry import build_registry

OWN = 'youngs_modulus = "110 GPa"\npoissons_ratio = 0.3\ndensity = "5 g/cm^3"'
CASE = (
    held_bar(
        box_part(24, 12, 12, 6),
        name="plate",
        material=OWN,
        regions='[region.floor]\nplane = "z = min"\n[region.top]\nplane = "z = max"\n',
        force="0 N, 0 N, -400 N",
    )
    + """\
[limits]
stress = "100 MPa"
[lattice]
cell = "walls"
size = "6 mm"
density = [0.2, 0.5]
"""
)
WARP = (
    'warp = [{{centre = ["{}", "6 mm", "6 mm"], stable_radius = "5 mm", outer_radius = "{}", '
    "magnification = 1.1}}]\n"
)
KEEP = '[[keep]]\nregion = "root"\nmargin = "{}"\n'


@pytest.fixture(scope="module")
def registry():
    known = build_registry(plugins=())
    law = power_law(
        "walls-law",
        ("walls",),
        youngs=(1.0, 2.0),
        strength=(1.0, 1.5),
        window=(0.1, 0.9),
        origin=LawOrigin(kind="computed", source="this test", test="none"),
    )
    families = {"walls": WALLS, "lawless": replace(WALLS, name="lawless")}
    return replace(known, cell_families=families, scaling_laws={"walls-law": law})


@pytest.fixture
def nothing_heavy(monkeypatch):
    """Computing a law or meshing the part fails the test."""

    def refused(*_, **__):
        pytest.fail("a law was computed or a part meshed")

    monkeypatch.setattr(law_module, "computed_law", refused)
    for name in ("box_part_mesh", "mesh_part"):
        monkeypatch.setattr(mesh_module, name, refused)


def changed(*pairs):
    text = CASE
    for old, new in pairs:
        assert text.count(old) == 1
        text = text.replace(old, new)
    return text


def read(folder, text):
    (folder / "case.toml").write_text(text, encoding="utf-8")
    return load_case(folder)


def checked(folder, text, registry):
    from gradedesign.design.check.check_case import check_case

    return check_case(read(folder, text), registry)


REFUSED = {
    # The cell's own window, 0.01 to 0.99, has nothing of these; its law would take minutes.
    "window": (
        (('cell = "walls"', 'cell = "lawless"'), ("[0.2, 0.5]", "[0.995, 0.999]")),
        CaseError, ["lattice.density", "nothing in common", "lawless"],
    ),
    # On 48 voxels a wall of three is 1/16 of the cell: 1 - (15/16)^3 = 0.18.
    "window of the law": (
        (('cell = "walls"', 'cell = "lawless"'), ("[0.2, 0.5]", "[0.02, 0.1]")),
        CaseError, ["lattice.density", "nothing in common", "lawless-computed"],
    ),
    "tetrahedra": (
        (('mesh_size = "6 mm"', 'mesh_size = "0.02 mm"'),),
        ResourceError, ["case.toml:5: part.mesh_size", "found 0.02 mm", "unknowns", "or more"],
    ),
    # Elements as large as the part would still not fit: a mesh size is no remedy.
    "memory of a small part": (
        (("[limits]", '[run]\nmemory = "0.1 GB"\n[limits]'),),
        ResourceError, ["case.toml:5: part.mesh_size", "[run] memory: raise memory to 0.2"],
    ),
    "cell longer than the part": (
        (('size = "6 mm"\nd', 'size = "1 m"\nd'),),
        CaseError, ["lattice.size", "1000 mm", "24 x 12 x 12 mm", "24 mm at most"],
    ),
    "cells without number": (
        (('size = "6 mm"\nd', 'size = "0.01 mm"\nd'),),
        ResourceError, ["lattice.size", "0.01 mm", "GB", "larger cells"],
    ),
    # The box is 24 mm long: no place is farther from its end.
    "passive margin": (
        (("[limits]", KEEP.format("500 mm") + "[limits]"),),
        CaseError, ["keep[0].margin", "found 500 mm", "region 'root'", "would stay solid"],
    ),
    # The library's Ti-6Al-4V yields at 825 MPa: known only once the name is looked up.
    "beyond yield": (
        ((OWN, 'name = "Ti-6Al-4V"'), ('stress = "100 MPa"', 'stress = "826 MPa"')),
        CaseError, ["case.toml:21: limits.stress: found 826 MPa", "825 MPa of Ti-6Al-4V",
                    "beyond_yield = true"],
    ),
    # The box is 24 mm long.
    "displacement": (
        (("[lattice]", 'displacement = [{region = "tip", magnitude = "25 mm"}]\n[lattice]'),),
        CaseError, ["case.toml:24: limits.displacement[0].magnitude: found 25 mm", "24 mm long"],
    ),
    "one edge of a cell": (
        (('size = "6 mm"\nd', 'size = ["6 mm", "6 mm", "24.1 mm"]\nd'),),
        CaseError, ["lattice.size", "6 x 6 x 24.1 mm", "24 mm at most"],
    ),
    # The end of the box at x = 24 is 76 mm away.
    "warp": (
        (("density = [", WARP.format("100 mm", "70 mm") + "density = ["),),
        CaseError, ["lattice.warp[0].centre: found (100, 6, 6) mm", "no nearer than 76",
                    "outer_radius is 70 mm"],
    ),
    "rigid motions": (
        (('fix = [{region = "root"}]', 'fix = [{region = "root", components = "xy"}]'),),
        CaseError, ["load_case[0].fix", "free to translate along z"],
    ),
}  # fmt: skip


@pytest.mark.parametrize(("pairs", "error", "words"), REFUSED.values(), ids=REFUSED)
def test_a_run_is_refused_before_what_takes_minutes(
    pairs, error, words, registry, nothing_heavy, tmp_path
):
    case = read(tmp_path, changed(*pairs))
    with pytest.raises(error) as caught:
        prepare(case, registry)
    assert all(word in str(caught.value) for word in words), str(caught.value)
    assert "(0,)" not in str(caught.value)


def test_a_check_computes_no_law_and_no_mesh(registry, nothing_heavy, tmp_path):
    found = checked(tmp_path, changed(('cell = "walls"', 'cell = "lawless"')), registry)
    assert not found.plan.law.tabulated
    assert found.plan.law.voxels == 48
    assert found.run.law_s == 60.0 * found.plan.law.minutes[1] > 0
    # Cubes between walls that fill 1 - (1 - w)^3 of them: at 0.2, w = 0.0717 of 6 mm.
    assert found.run.grid.wall == pytest.approx(6 * (1 - 0.8 ** (1 / 3)), rel=0.01)


def test_a_limit_beyond_yield_is_allowed_only_on_request(registry, tmp_path):
    named = (OWN, 'name = "Ti-6Al-4V"')
    at_yield = changed(named, ('stress = "100 MPa"', 'stress = "825 MPa"'))
    assert not any("yield" in w for w in checked(tmp_path, at_yield, registry).warnings)
    beyond = at_yield.replace("825 MPa", "2 GPa").replace(
        "[limits]", "[limits]\nbeyond_yield = true"
    )
    found = checked(tmp_path, beyond, registry)
    assert [w for w in found.warnings if "2000 MPa is above the yield strength of 825 MPa" in w]
    assert [limit.allowed for limit in found.plan.limits if limit.name == "stress"] == ["2000 MPa"]


# The ends of the box are 144 mm^2 and the material yields at 100 MPa: 14.4 kN. Of a moment about z,
# half the diagonal of an end is an arm at most: 24 N m would be 1.4 kN.
@pytest.mark.parametrize(
    ("load", "told"),
    [
        ('force = ["0 N", "0 N", "-14.3 kN"]', []),
        (
            'force = ["0 N", "0 N", "-14.5 kN"]',
            [
                'load_case[0].load[0]: load case "pull": the load on region "tip", 1.45e+04 N on '
                "144 mm^2, is 100.7 MPa on average, beyond the 100 MPa",
                'load_case[0].fix: load case "pull": the reaction on its held regions, 1.45e+04 N',
            ],
        ),
        ('pressure = "101 MPa"', ["load_case[0].load[0]", "load_case[0].fix"]),
        ('moment = ["300 N*m", "0 N*m", "0 N*m"]', ["load_case[0].load[0]"]),
    ],
)
def test_loads_beyond_yield_on_their_face_are_told(load, told, registry, tmp_path):
    text = changed(
        (OWN, f'{OWN}\nyield_strength = "100 MPa"'), ('force = ["0 N", "0 N", "-400 N"]', load)
    )
    warned = [w for w in checked(tmp_path, text, registry).warnings if "on average" in w]
    assert len(warned) == len(told)
    for words, warning in zip(told, warned, strict=True):
        assert warning.startswith("case.toml:")
        assert words in warning


def test_a_window_of_no_width_is_told(registry, tmp_path):
    text = changed(("[0.2, 0.5]", "[0.3, 0.3]"))
    (warning,) = [w for w in checked(tmp_path, text, registry).warnings if "no width" in w]
    assert warning.startswith("case.toml:27: lattice.density: the density window [0.3, 0.3]")
    # The window of the law ends at 0.9: of the stated one hardly more than its lower end is left.
    narrowed = changed(("[0.2, 0.5]", "[0.8999, 0.95]"))
    assert [w for w in checked(tmp_path, narrowed, registry).warnings if "no width" in w]
    wide = changed(("[0.2, 0.5]", "[0.3, 0.301]"))
    assert not [w for w in checked(tmp_path, wide, registry).warnings if "no width" in w]


def test_a_cell_longer_than_the_part_is_wide_is_told(registry, tmp_path):
    along_y = changed(('size = "6 mm"\nd', 'size = ["6 mm", "13 mm", "6 mm"]\nd'))
    (warning,) = [w for w in checked(tmp_path, along_y, registry).warnings if "less than one" in w]
    assert "lattice.size: cells are 13 mm long along their y axis" in warning
    assert "part is 12 mm" in warning
    # Turned by 90 degrees about z, that axis lies along the 24 mm of the box.
    turned = along_y.replace("density = [", 'rotation = ["0 deg", "0 deg", "90 deg"]\ndensity = [')
    found = checked(tmp_path, turned, registry)
    assert not [w for w in found.warnings if "less than one" in w]


def test_a_warp_that_reaches_the_part_is_none_to_refuse(registry, tmp_path):
    text = changed(("density = [", WARP.format("100 mm", "90 mm") + "density = ["))
    checked(tmp_path, text, registry)


def test_loads_that_cancel_are_told(registry, tmp_path):
    pair = ", ".join(
        f'{{region = "{n}", force = ["0 N", "0 N", "{{}}"]}}' for n in ("floor", "top")
    )
    old = '{region = "tip", force = ["0 N", "0 N", "-400 N"]}'
    pressed = pair.replace("{}", "900 N", 1).replace("{}", "-900 N")
    found = checked(tmp_path, changed((old, pressed)), registry)
    assert found.plan.balances[0].cancels
    assert any('"pull"' in w and "1800 N act" in w for w in found.warnings), found.warnings
    assert any("cancel" in w for w in prepare(found.plan.case, registry).warnings)
    # The same forces one way do not.
    both = pair.replace("{}", "900 N", 1).replace("{}", "900 N")
    assert not checked(tmp_path, changed((old, both)), registry).plan.balances[0].cancels


def test_resultants_are_those_of_the_solid_part_about_the_held_region(registry, tmp_path):
    text = changed(
        ('"-400 N"]}]', '"-400 N"]}, {region = "top", pressure = "2 MPa"}]\nacceleration = '
         '["0 m/s^2", "0 m/s^2", "-10 m/s^2"]')
    )  # fmt: skip
    (one,) = checked(tmp_path, text, registry).plan.balances
    assert one.about == pytest.approx([0.0, 6.0, 6.0])
    # 400 N; 2 MPa on 24 x 12 mm^2; 5 g/cm^3 of 3456 mm^3 at 10 m/s^2.
    down = [400.0, 2 * 24 * 12, 5e-9 * 3456 * 1e4]
    assert one.force == pytest.approx([0.0, 0.0, -sum(down)])
    # Arms along x: the tip's 24 mm, and 12 mm to the middle of the top and of the solid.
    turn = 24 * down[0] + 12 * down[1] + 12 * down[2]
    assert one.moment == pytest.approx([0.0, turn, 0.0], abs=1e-9)


def test_a_remote_force_counts_at_its_point(registry, tmp_path):
    at = ', point = ["30 mm", "6 mm", "20 mm"]'
    text = changed(('"-400 N"]}]', '"-400 N"]' + at + "}]"))
    found = checked(tmp_path, text, registry)
    (one,) = found.plan.balances
    assert one.force == pytest.approx([0.0, 0.0, -400.0])
    # 30 mm from the held face; the 20 mm above it turn nothing.
    assert one.moment == pytest.approx([0.0, 30 * 400.0, 0.0], abs=1e-9)


def test_a_bearing_load_on_no_bore_is_refused_at_its_line(registry, tmp_path):
    text = changed(
        ('"tip", force = ["0 N", "0 N", "-400 N"]', '"tip", bearing = ["0 N", "1 N", "0 N"]')
    )
    with pytest.raises(CaseError) as refused:
        checked(tmp_path, text, registry)
    line = next(k for k, words in enumerate(text.splitlines(), 1) if "bearing" in words)
    assert str(refused.value).startswith(f"case.toml:{line}: load_case[0].load[0].bearing: ")
    assert "'tip' is not the wall of one bore" in str(refused.value)


def test_a_point_without_its_force_is_refused(tmp_path):
    text = changed(('force = ["0 N", "0 N", "-400 N"]', 'point = ["0 mm", "0 mm", "9 mm"]'))
    with pytest.raises(CaseError, match=r"load\[0\].point: found without force; expected"):
        read(tmp_path, text)


@pytest.mark.parametrize("key", ['coupling = "rigid"', "rigid = true"])
def test_a_rigid_remote_is_refused_by_name(tmp_path, key):
    force = 'force = ["0 N", "0 N", "-400 N"]'
    text = changed((force, f'{force}, point = ["30 mm", "6 mm", "20 mm"], {key}'))
    with pytest.raises(CaseError, match=r"load\[0\]\.\w+: .*no analysis couples .* rigidly"):
        read(tmp_path, text)


@pytest.mark.parametrize(("edges", "asked"), [("2.4 mm", True), ("12 mm", False), ("90 m", True)])
def test_the_unit_of_a_tiny_or_huge_part_is_questioned(edges, asked, registry, tmp_path):
    text = changed(
        ('["24 mm", "12 mm", "12 mm"]', f'["{edges}", "{edges}", "{edges}"]'),
        ('mesh_size = "6 mm"', f'mesh_size = "{edges}"'),
        ('size = "6 mm"\nd', f'size = "{edges}"\nd'),
    )
    found = checked(tmp_path, text, registry)
    assert any("is its unit right?" in w for w in found.warnings) is asked


def test_units_are_offered_in_which_a_tiny_part_has_cells(registry, tmp_path):
    write_stl(tmp_path / "part.stl", box_surface((1.0, 0.5, 0.5)))
    text = changed(
        (box_part(24, 12, 12, 6), 'file = "part.stl"\nunits = "mm"\nmesh_size = "0.25 mm"'),
        ('size = "6 mm"\nd', 'size = "0.25 mm"\nd'),
        ("-400 N", "-0.4 N"),
    )
    (told,) = (w for w in checked(tmp_path, text, registry).warnings if "its unit right" in w)
    # 0.25 mm cells: 2 to 300 of them along it are usual, which 1 m does not have.
    assert told == (
        'case.toml:5: part.units: the part is 1 x 0.5 x 0.5 mm; is its unit right (in "inch" '
        '25.4, in "cm" 10 mm long)?'
    )


FIN = 'file = "fin.stl"\nunits = "mm"\nmesh_size = "6 mm"'
KEPT_FIN = (
    '[[keep]]\nbox = {lower = ["11 mm", "12 mm", "-1 mm"], upper = ["13 mm", "19 mm", "13 mm"]}\n'
)


@pytest.mark.parametrize(
    ("thickness", "more", "named"),
    [
        (0.4, "", ["lattice.size"]),
        (0.4, KEPT_FIN, []),
        (0.4, '[print]\nmin_wall = "0.5 mm"\n', ["print.min_wall"]),
        # Solid walls are no more printable than lattice.
        (0.4, KEPT_FIN + '[print]\nmin_wall = "0.5 mm"\n', ["print.min_wall"]),
        (0.6, '[print]\nmin_wall = "0.5 mm"\n', ["lattice.size"]),
        (6.0, '[print]\nmin_wall = "0.5 mm"\n', []),
    ],
    ids=["lattice", "kept", "thin", "thin and kept", "printable", "cell"],
)
def test_fins_thinner_than_a_cell_or_the_printer_are_told(
    thickness, more, named, registry, tmp_path
):
    write_stl(tmp_path / "fin.stl", finned_block(thickness))
    text = changed((box_part(24, 12, 12, 6), FIN), ("[limits]", more + "[limits]"))
    told = [w for w in checked(tmp_path, text, registry).warnings if "walls of the part" in w]
    assert [w.split(": ")[1] for w in told] == named
    for words in told:
        assert words.startswith("case.toml:")
        assert f"down to {thickness:g} mm thin at ({12 + thickness / 2:.4g}, 1" in words
    if named == ["lattice.size"]:
        assert "less than one cell of 6 mm" in told[0]
        assert f"[[keep]] holds such a wall solid, cells of at most {thickness / 2:g} mm" in told[0]
    elif named:
        assert "less than the 0.5 mm that the printer makes" in told[0]


def test_a_body_without_cells_has_no_wall_thinner_than_one(cli, tmp_path):
    write_stl(tmp_path / "fin.stl", finned_block(0.4))
    before, _, after = changed((box_part(24, 12, 12, 6), FIN)).partition("[lattice]\n")
    rest = after[after.index("\n[") :] if "\n[" in after else ""
    text = f'{before}[lattice]\nphases = ["solid", "void"]\nleast_member = "9 mm"\n{rest}'
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    ended = cli("check", tmp_path, "--no-picture")
    assert ended.code == 0, ended.err
    assert "free rigid motions: none" in ended.out
    assert "walls of the part" not in " ".join(ended.out.split())


def test_what_sets_the_grid_is_named(registry, tmp_path):
    grid = checked(tmp_path, changed(("[limits]", KEEP.format("0.1 mm") + "[limits]")), registry)
    assert "passive solid region 'root', 0.1 mm" in grid.run.grid.set_by
    # By finite cells, 0.7 of a brick across: the memory does not hold tetrahedra of 0.08 mm.
    assert grid.run.grid.spacing == pytest.approx(0.1 / 0.7)
    skin = 'density = [0.2, 0.5]\nskin = {thickness = "0.2 mm"}'
    grid = checked(tmp_path, changed(("density = [0.2, 0.5]", skin)), registry)
    assert grid.run.grid.set_by == "the skin, 0.2 mm"


def test_only_stated_densities_are_told_to_be_narrowed(registry, tmp_path):
    """The law holds from 0.1 to 0.9, the cell from 0.01 to 0.99."""
    stated = checked(tmp_path, changed(("[0.2, 0.5]", "[0.05, 0.95]")), registry)
    told = [w for w in stated.warnings if "narrowed" in w]
    assert told == [
        "density [0.05, 0.95] narrowed to [0.1, 0.9] by the window [0.1, 0.9] of law 'walls-law'"
    ]
    silent = checked(tmp_path, changed(("density = [0.2, 0.5]\n", "")), registry)
    assert not [w for w in silent.warnings if "narrowed" in w]
    assert silent.plan.bounds == stated.plan.bounds == (0.1, 0.9)


def test_budgets_that_are_exceeded_are_told(registry, tmp_path):
    text = CASE + '[run]\nmemory = "0.3 GB"\ntime = "10 s"\nexplicit_mesh_size = "0.2 mm"\n'
    warnings = checked(tmp_path, text, registry).warnings
    assert any("[run] memory" in w and "would fit" in w for w in warnings), warnings
    assert any("[run] time" in w for w in warnings), warnings


def test_the_part_is_measured_in_cells(registry, tmp_path):
    # A box of 24 x 12 x 12 mm is 12 mm thick everywhere: two cells of 6 mm.
    thick = checked(tmp_path, CASE, registry).thickness
    assert thick.thickness == pytest.approx([12.0] * 5)
    assert thick.cells == pytest.approx([2.0] * 5)


def test_a_check_prints_what_the_docs_show_and_draws(monkeypatch, registry, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(check_module, "registry_for", lambda **_: registry)
    drawn = []

    def draw(path, *_, **__):
        drawn.append(path)
        return ()

    monkeypatch.setattr(check_module, "picture_loads", draw)
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    with pytest.raises(SystemExit) as ended:
        main(["check", "."])
    assert not ended.value.code
    printed = capsys.readouterr().out
    page = (Path(__file__).parents[2] / "docs" / "check.md").read_text(encoding="utf-8")
    sample = page.split("```text\n")[1].split("```")[0]
    labels = [line.split(":")[0] for line in sample.splitlines() if line and line[0] != " "]
    assert len(labels) > 12
    # The plate has no holes, and states no passive solids.
    for label in set(labels) - {"warning", "Holes, slots, cones and bosses", "Passive solids"}:
        assert any(line.startswith(label) for line in printed.splitlines()), (label, printed)
    # Beside the run folder: a run into runs/plate finds it as it was.
    assert drawn == [Path("runs") / "plate-check" / "loads.png"]
    assert not (tmp_path / "runs" / "plate").exists()
    with pytest.raises(SystemExit):
        main(["check", ".", "--json", "--no-picture"])
    data = json.loads(capsys.readouterr().out)
    assert data["picture"] is None
    assert data["load_cases"][0]["force_N"] == [0.0, 0.0, -400.0]
    assert len(drawn) == 1


def test_a_change_of_temperature_is_listed_among_the_loads(registry, tmp_path, capsys):
    expansion = ('density = "5', 'thermal_expansion = "9e-6 1/K"\ndensity = "5')
    text = changed(("fix = [", 'temperature_change = "-50 K"\nfix = ['), expansion)
    found = checked(tmp_path, text, registry)
    print_check(found)
    printed = " ".join(capsys.readouterr().out.split())
    assert printed.index("pull tip (0, 0, -400)") < printed.index(
        "pull temperature change - - -50 K"
    )
    assert check_data(found, None, ())["load_cases"][0]["temperature_change_K"] == -50.0
    print_check(checked(tmp_path, CASE, registry))
    assert "temperature" not in capsys.readouterr().out


PERIODIC = {
    "skin": (("density = [", 'skin = {thickness = "1 mm"}\ndensity = ['), "a skin ties"),
    "edges": (('size = "6 mm"\nd', 'size = ["6 mm", "6 mm", "5 mm"]\nd'), "cubic cells"),
    "heat": (("fix = [", 'temperature_change = "50 K"\nfix = ['), "load case 'pull'"),
    # 1 - (1 - w)^3 of the cell with w = 3/64: 0.13.
    "thin walls": (
        ("[0.2, 0.5]", '[0.12, 0.5]\n[run]\nexplicit_mesh_size = "1 mm"'),
        "at density 0.12 are too thin for 64 voxels",
    ),
    "off": (("density = [", "size_effects = false\ndensity = ["), "switches size effects off"),
}


@pytest.mark.parametrize(("change", "reason"), PERIODIC.values(), ids=PERIODIC)
def test_where_size_effects_are_left_out_a_sentence_says_so(change, reason, registry, tmp_path):
    expansion = ('density = "5', 'thermal_expansion = "9e-6 1/K"\ndensity = "5')
    found = checked(tmp_path, changed(change, expansion), registry)
    assert reason in found.periodic
    told = [w for w in found.warnings if "takes it for a periodic lattice" in w]
    # Two cells of 6 mm across, 2.4 of the shortest edge; who switches them off knows.
    assert len(told) == (reason != "switches size effects off")
    assert all(" times its cells" in w and found.periodic in w for w in told)
    data = json.dumps(check_data(found, None, found.warnings))
    assert found.periodic.split("'")[0] in data


def test_a_law_of_finite_samples_has_its_size_effects_already(registry, tmp_path):
    laws = {"walls-law": replace(registry.scaling_laws["walls-law"], kind="fe")}
    found = checked(tmp_path, CASE, replace(registry, scaling_laws=laws))
    assert "not computed on the periodic cell" in found.periodic
    plain = checked(tmp_path, CASE, registry)
    assert not plain.periodic
    assert not [w for w in plain.warnings if "periodic lattice" in w]
