"""Solids that need few unknowns are analysed finer, unless the case states how fine."""

import re
from types import SimpleNamespace

import pytest

from gradedesign.design.case.run_schema import RunSpec
from gradedesign.mechanics.explicit.analysis import PlannedSolid
from gradedesign.mechanics.explicit.finite_cells import AFFORDABLE, FINITE_CELLS
from gradedesign.mechanics.explicit.small_solid import FINEST, small_solid_spacing

BOX = PlannedSolid(
    box=(40.0, 20.0, 20.0), volume=5000.0, projections=6000.0, curvature=0.0, load_cases=1
)


def unknowns(spacing):
    return FINITE_CELLS.estimate(BOX, spacing).unknowns


def test_solid_with_few_unknowns_is_refined_until_it_has_some():
    coarse = next(s for s in (1.0, 1.2, 1.4, 1.6) if unknowns(s) < 0.6 * AFFORDABLE)
    fine = small_solid_spacing(FINITE_CELLS, BOX, coarse, stated=False)
    assert 1.0 < coarse / fine < FINEST
    assert unknowns(fine) == pytest.approx(AFFORDABLE, rel=1e-3)


def test_refinement_ends():
    assert small_solid_spacing(FINITE_CELLS, BOX, 5.0, stated=False) == pytest.approx(5.0 / FINEST)


def test_large_solid_keeps_the_spacing_that_its_walls_ask_for():
    assert unknowns(0.5) > AFFORDABLE
    assert small_solid_spacing(FINITE_CELLS, BOX, 0.5, stated=False) == 0.5


@pytest.mark.parametrize("stated", [{"elements_per_wall": 0.5}, {"explicit_mesh_size": "5 mm"}])
def test_stated_resolution_is_kept(stated):
    run = RunSpec(**stated)
    spacing = small_solid_spacing(FINITE_CELLS, BOX, 5.0, stated=run.states_resolution)
    assert spacing == 5.0


def test_analysis_that_states_no_such_count_is_not_refined():
    plain = SimpleNamespace(affordable=0.0, estimate=FINITE_CELLS.estimate)
    assert small_solid_spacing(plain, BOX, 5.0, stated=False) == 5.0


CASE = """\
[case]
name = "small"
[part]
box = ["24 mm", "12 mm", "12 mm"]
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[material]
name = "Ti-6Al-4V"
[[load_case]]
name = "pull"
fix = [{region = "root"}]
load = [{region = "tip", force = ["100 N", "0 N", "0 N"]}]
[limits]
displacement = [{region = "tip", magnitude = "4 x solid"}]
[lattice]
cell = "gyroid-sheet"
size = "12 mm"
density = [0.4, 0.7]
[run]
analysis = "finite-cells"
"""


def spacing_that_check_tells(cli, folder, text):
    (folder / "case.toml").write_text(text)
    ended = cli("check", folder)
    assert ended.code == 0
    words = " ".join(ended.out.split())
    return float(re.search(r"explicit grid: ([\d.]+) mm", words)[1]), words


def test_check_tells_a_finer_grid_for_a_small_part(cli, tmp_path):
    fine, words = spacing_that_check_tells(cli, tmp_path, CASE)
    assert "and finer: the solid is small" in words
    stated, words = spacing_that_check_tells(cli, tmp_path, CASE + "elements_per_wall = 0.7\n")
    assert "finer" not in words
    assert stated / fine == pytest.approx(FINEST, rel=0.1)
