"""What a solver, an analysis, an exporter or a reader would refuse later, a check refuses first."""

import re
from dataclasses import replace

import pytest
from small_parts import WALLS, box_part, held_bar

import gradedesign_layers
import gradedesign_volumes
from gradedesign.design.case.read_case import load_case
from gradedesign.design.check.check_case import check_case
from gradedesign.design.resolve.design_model import prepare
from gradedesign.design.resolve.plan import resolve_case
from gradedesign.errors import CaseError, PluginError, ResourceError
from gradedesign.geometry.formats.exporter import Exporter
from gradedesign.mechanics.explicit.finite_cells import FINITE_CELLS
from gradedesign.mechanics.fe.scikit_fem import MOST_UNKNOWNS, SCIKIT_FEM
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawOrigin
from gradedesign.mechanics.solver.direct import SUPERLU_LIMIT
from gradedesign.mechanics.solver.linear_solver import LinearSolver
from gradedesign.program.host.registry import build_registry

CASE = (
    held_bar(box_part(24, 12, 12, 6), name="plate", force="0 N, 0 N, -4 N")
    + """\
[limits]
stress = "20 MPa"
[lattice]
cell = "walls"
size = "6 mm"
density = [0.3, 0.5]
"""
)


@pytest.fixture(scope="module")
def registry():
    known = build_registry(plugins=[gradedesign_layers, gradedesign_volumes])
    law = power_law(
        "walls-law", ("walls",), youngs=(1.0, 2.0), strength=(1.0, 1.5), window=(0.1, 0.9),
        origin=LawOrigin(kind="computed", source="this test", test="none"),
    )  # fmt: skip
    return replace(known, cell_families={"walls": WALLS}, scaling_laws={"walls-law": law})


def read(folder, more, *pairs):
    text = CASE
    for old, new in pairs:
        assert text.count(old) == 1
        text = text.replace(old, new)
    (folder / "case.toml").write_text(text + more)
    return load_case(folder)


def refusal(error, case, registry):
    with pytest.raises(error) as caught:
        check_case(case, registry)
    return str(caught.value)


SOLVER = '[run]\nsolver = "scikit-fem"\nstop_after = "{}"\n'


def test_a_part_with_more_unknowns_than_the_solver_takes(registry, tmp_path):
    # Bricks of 0.5 mm, 48 x 24 x 24 of them: 97 * 49 * 49 quadratic nodes.
    case = read(tmp_path, SOLVER.format("solid"), ('mesh_size = "6 mm"', 'mesh_size = "0.5 mm"'))
    told = refusal(ResourceError, case, registry)
    line = case.path.read_text().split("\n").index('solver = "scikit-fem"') + 1
    assert told == (
        f"case.toml:{line}: run.solver: the part has {3 * 97 * 49 * 49} unknowns: "
        f"{SCIKIT_FEM.refusal(3 * 97 * 49 * 49)}"
    )


def test_a_lattice_with_more_unknowns_than_the_solver_takes(registry, tmp_path):
    told = refusal(ResourceError, read(tmp_path, SOLVER.format("verdict")), registry)
    # Finite cells solve themselves; their surface is meshed again.
    words = "run.solver: the printed surface as it is meshed again has at least about "
    assert words in told
    assert f"takes at most {MOST_UNKNOWNS} unknowns" in told
    # A run that ends before never needs it.
    check_case(read(tmp_path, SOLVER.format("sizing")), registry)


def test_what_may_be_too_large_for_the_solver_is_a_warning(registry, tmp_path):
    named = read(tmp_path, '[run]\nsolver = "small"\n')
    least = r"meshed again has at least about (\d+)"

    def warned(most):
        small = LinearSolver(name="small", prepare=SCIKIT_FEM.prepare, most_unknowns=most)
        known = replace(
            registry,
            solvers={**registry.solvers, "small": small},
            sources={**registry.sources, "solvers": {"small": "test 1"}},
        )
        try:
            found = check_case(named, known)
        except ResourceError as error:
            (told,) = re.findall(least, str(error))
            return int(told)
        return [w for w in found.warnings if "meshed again has about" in w]

    # Predictions are meant to be right within a factor of two: more than twice is refused. The part
    # has fewer unknowns.
    refused = warned(8_000)
    assert refused > 8_000
    assert warned(refused - 1) == refused
    assert isinstance(warned(refused), list)
    assert warned(refused)
    assert not warned(2 * refused + 1)


def test_the_run_refuses_by_the_same_function(cli, tmp_path):
    text = CASE.replace('"walls"', '"gyroid-sheet"').replace(
        '\nsize = "6 mm"', '\nsize = "6 mm"\nsize_effects = false'
    )
    (tmp_path / "case.toml").write_text(text + SOLVER.format("verdict"))
    checked = cli("check", tmp_path, "--no-picture")
    ran = cli("run", tmp_path, "-o", tmp_path / "out")
    for ended in (checked, ran):
        assert ended.code == 5
        assert "run.solver: the printed surface as it is meshed again has at least" in ended.err


def test_the_direct_solver_states_what_superlu_takes(monkeypatch):
    from gradedesign.mechanics.solver import direct

    if direct.direct_method(SUPERLU_LIMIT + 1) is None:
        assert direct.DIRECT.refusal(SUPERLU_LIMIT + 1)
    else:
        assert not direct.DIRECT.refusal(10**9)
    assert not direct.DIRECT.refusal(SUPERLU_LIMIT)


def test_memory_that_no_density_fits_is_refused_as_by_a_run(registry, tmp_path):
    # A grid that resolves a skin of 0.1 mm has more than 10^6 elements in any lattice.
    skin = ("density = [", 'skin = "0.1 mm"\ndensity = [')
    case = read(tmp_path, '[run]\nmemory = "0.5 GB"\n', skin)
    told = refusal(ResourceError, case, registry)
    assert "the explicit analysis does not fit [run] memory 0.5 GB" in told
    with pytest.raises(ResourceError, match="does not fit"):
        prepare(case, registry)


FORMATS = '[output]\nformats = ["stl", "{}"]\n'


@pytest.mark.parametrize("name", ["cli", "cli-binary", "png-stack"])
def test_layers_without_a_height(name, registry, tmp_path):
    told = refusal(CaseError, read(tmp_path, FORMATS.format(name)), registry)
    assert f"output.formats: the format '{name}' cannot be written: layers need their" in told
    check_case(read(tmp_path, FORMATS.format(name) + '[print]\nlayer_height = "0.1 mm"'), registry)
    # Nothing is written of a lattice that is not made.
    early = read(tmp_path, FORMATS.format(name) + '[run]\nstop_after = "sizing"')
    check_case(early, registry)


BEAMS = {
    "no struts": (("walls", "gyroid-sheet"), "not made of"),
    "joints": (('\nsize = "6 mm"', '\nsize = "6 mm"\njoint_radius = "1 mm"'), "joints"),
    "no cubes": (('\nsize = "6 mm"', '\nsize = ["6 mm", "6 mm", "8 mm"]'), "no equal cubes"),
    "graded size": (
        ('\nsize = "6 mm"', '\nsize = ["5 mm", "8 mm"]\ngrading = "ratio"'), "no equal cubes",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("pair", "words"), BEAMS.values(), ids=BEAMS)
def test_lattices_that_beams_cannot_be(pair, words, tmp_path):
    struts = () if pair[0] == "walls" else (('"walls"', '"bcc"'),)
    case = read(tmp_path, FORMATS.format("3mf-beams"), *struts, pair)
    with pytest.raises(CaseError, match=f"'3mf-beams' cannot be written: .*{words}"):
        resolve_case(case, build_registry())


def test_struts_in_cubes_pass(tmp_path):
    case = read(tmp_path, FORMATS.format("3mf-beams"), ('"walls"', '"bcc"'))
    assert resolve_case(case, build_registry()).tools.files


def test_generate_refuses_formats_before_it_makes_anything(cli, tmp_path):
    (tmp_path / "case.toml").write_text(
        '[case]\nname = "block"\n[part]\nbox = ["12 mm", "12 mm", "12 mm"]\n[lattice]\n'
        'cell = "gyroid-sheet"\nsize = "6 mm"\ndensity = 0.3\n' + FORMATS.format("3mf-beams")
    )
    ended = cli("run", tmp_path, "-o", tmp_path / "out")
    assert ended.code == 2
    assert "output.formats: the format '3mf-beams' cannot be written" in ended.err
    assert not (tmp_path / "out" / "lattice.stl").exists()


def with_exporter(registry, refuses):
    mine = Exporter(name="mine", suffix=".mine", write=lambda *_: None, refuses=refuses)
    return replace(
        registry,
        exporters={**registry.exporters, "mine": mine},
        sources={
            **registry.sources,
            "exporters": {**registry.sources["exporters"], "mine": "acme 1"},
        },
    )


def test_an_exporter_of_a_plugin_refuses_by_its_own_words(registry, tmp_path):
    case = read(tmp_path, FORMATS.format("mine"))
    boxy = with_exporter(registry, lambda p: "" if p.axes else f"box to {p.domain.upper[0]:g} mm")
    assert "'mine' cannot be written: box to 24 mm" in refusal(CaseError, case, boxy)
    broken = with_exporter(registry, lambda p: p.nothing)
    assert "exporter 'mine' of acme 1 failed" in refusal(PluginError, case, broken)


def test_an_analysis_that_cannot_judge_a_limit(registry, tmp_path):
    def cold(limits, load_cases):
        assert [load.name for load in load_cases]
        return "" if not limits.displacement else "it knows no displacements"

    mine = replace(FINITE_CELLS, name="mine", refuses=cold)
    known = replace(
        registry,
        analyses={**registry.analyses, "mine": mine},
        sources={**registry.sources, "analyses": {**registry.sources["analyses"], "mine": "a 1"}},
    )
    named = '[run]\nanalysis = "mine"\n'
    check_case(read(tmp_path, named), known)
    limit = ("[lattice]", 'displacement = [{region = "tip", magnitude = "1 mm"}]\n[lattice]')
    case = read(tmp_path, named, limit)
    told = refusal(CaseError, case, known)
    line = case.path.read_text().split("\n").index('analysis = "mine"') + 1
    assert told.startswith(f"case.toml:{line}: run.analysis: mine: it knows no displacements")
    with pytest.raises(CaseError, match="it knows no displacements"):
        prepare(case, known)


def test_a_file_of_directions_is_read_by_a_check(registry, tmp_path):
    (tmp_path / "stress.vtu").write_text("<VTKFile/>")
    case = read(tmp_path, '[lattice.orientation]\nvtu = "stress.vtu"\n')
    told = refusal(CaseError, case, registry)
    assert "lattice.orientation.vtu: stress.vtu" in told
