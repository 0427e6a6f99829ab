"""Roles in 3MF files through the commands: the same part, the same words, or the same refusal."""

import json

import pytest
from small_parts import held_bar
from threemf_variants import (
    Box,
    Package,
    bambu_config,
    bambu_part,
    components,
    item,
    mesh,
    prusa_config,
    prusa_volume,
    thing,
    volume,
)

BLOCK = Box("block", "solid", (0, 0, 0), (240, 160, 80))  # 30 x 20 x 10 mm
SLOT = Box("slot", "negative volume", (80, -8, 40), (120, 168, 88))
DENSE = Box("dense infill", "parameter modifier", (8, 8, 8), (400, 60, 40))
PARKED = Box("parked", "not printable", (0, 400, 0), (80, 480, 80))
BODIES = [BLOCK, SLOT, DENSE, PARKED]
LEFT = [{"name": b.name, "role": b.role, "done": "left out"} for b in BODIES[2:]]
LEFT.insert(0, {"name": "slot", "role": "negative volume", "done": "subtracted"})
SUBTRACTED = "bodies subtracted: 'slot' (negative volume)"
LEFT_OUT = "bodies left out: 'dense infill' (parameter modifier), 'parked' (not printable)"
#: 30 x 20 x 10 less the slot of 5 x 20 x 5 mm.
VOLUME = 6000.0 - 500.0


@pytest.fixture
def file(tmp_path):
    package = Package([thing(n, mesh(b.vertices)) for n, b in enumerate(BODIES, start=1)])
    package.resources[3] = thing(4, mesh(PARKED.vertices), name="parked")
    package.resources.append(thing(9, components([1, 2, 3])))
    package.items = [item(9), item(4, more='printable="0"')]
    package.metadata = bambu_config(
        bambu_part(1, "block", "normal_part"),
        bambu_part(2, "slot", "negative_part"),
        bambu_part(3, "dense infill", "modifier_part"),
    )
    path = tmp_path / "part.3mf"
    path.write_bytes(package.data())
    return path


def words(text):
    return " ".join(text.split())


def written(folder, limits):
    part = 'file = "part.3mf"\nmesh_size = "10 mm"'
    (folder / "case.toml").write_text(held_bar(part, name="roles", force="0 N, 0 N, -1 N") + limits)
    return folder / "case.toml"


LIMITS = (
    '[limits]\ndisplacement = [{region = "tip", magnitude = "9 mm"}]\n'
    '[lattice]\ncell = "gyroid-sheet"\nsize = "10 mm"\ndensity = [0.3, 0.5]\n'
    '[run]\nstop_after = "solid"\n[output]\nformats = ["report"]\n'
)
LATTICE = '[lattice]\ncell = "gyroid-sheet"\nsize = "10 mm"\ndensity = 0.4\n'
GENERATED = (
    '[case]\nname = "roles"\n[part]\nfile = "part.3mf"\n[material]\nname = "PA12"\n'
    f'{LATTICE}[output]\nformats = ["stl"]\n'
)


def test_new_check_generate_and_run_say_the_same(file, cli):
    assert volume(BODIES[:2]) == VOLUME
    folder = file.parent
    ended = cli("new", file, "-o", folder / "new")
    assert ended.code == 0, ended.err
    for line in ("30 x 20 x 10 mm, 5500 mm^3", SUBTRACTED, LEFT_OUT):
        assert line in words(ended.out)
    case = written(folder, LIMITS)
    ended = cli("check", case)
    assert ended.code == 0, ended.err
    for line in ("30 x 20 x 10 mm, 5500 mm^3", SUBTRACTED, LEFT_OUT):
        assert line in words(ended.out)
    part = json.loads(cli("check", case, "--json").out)
    assert part["part"]["volume_mm3"] == pytest.approx(VOLUME, rel=1e-9)
    assert part["part"]["file_bodies"] == LEFT
    ended = cli("run", case, "-o", folder / "run")
    assert ended.code == 0, ended.err
    result = json.loads((folder / "run" / "result.json").read_text(encoding="utf-8"))
    (folder / "case.toml").write_text(GENERATED)
    ended = cli("run", folder, "-o", folder / "generated")
    assert ended.code == 0, ended.err
    other = json.loads((folder / "generated" / "result.json").read_text(encoding="utf-8"))
    for found in (result, other, part):
        assert {f"part.3mf: {SUBTRACTED}", f"part.3mf: {LEFT_OUT}"} <= set(found["warnings"])
    for found in (result, other):
        assert found["file_bodies"] == LEFT
        # PA12 of the library: 0.93 g/cm^3.
        assert found["solid_mass_g"] == pytest.approx(VOLUME * 0.93e-3, rel=1e-6)
    report = (folder / "run" / "report.html").read_text(encoding="utf-8")
    table = report.split("Bodies of the file that are not in the part</h2>")[1].split("</table>")[0]
    for body in LEFT:
        assert f"<td>{body['name']}</td><td>{body['role']}</td><td>{body['done']}</td>" in table


@pytest.mark.parametrize("command", ["new", "check", "run"])
def test_a_contradiction_is_refused_by_every_command(file, cli, command):
    package = Package([thing(1, mesh(BLOCK.vertices, SLOT.vertices), name="plate")], [item(1)])
    package.metadata = prusa_config(
        prusa_volume(0, 11, "block", "ModelPart"), prusa_volume(8, 23, "slot", "NegativeVolume")
    )
    file.write_bytes(package.data())
    case = written(file.parent, LIMITS)
    if command == "run":
        case.write_text(GENERATED)
    output = () if command == "check" else ("-o", file.parent / "out")
    ended = cli(command, file if command == "new" else case, *output)
    assert ended.code == 3
    assert (
        "part.3mf: Metadata/Slic3r_PE_model.config tells of the volume of triangles 8 to 23 of "
        "object 1, some of which the volume of triangles 0 to 11 of object 1 has as well"
    ) in words(ended.err)


def test_the_walls_of_a_negative_volume_are_a_face_by_its_name(file, cli):
    region = '[region.walls]\nname = "slot"\n'
    case = written(file.parent, LIMITS)
    case.write_text(case.read_text().replace("[material]", f"{region}[material]"))
    found = json.loads(cli("check", case, "--json").out)
    (walls,) = (row for row in found["regions"] if row["name"] == "walls")
    assert walls["area_mm2"] == pytest.approx(20.0 * (5.0 + 5.0 + 5.0), rel=1e-9)
