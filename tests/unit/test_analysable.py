"""The least density that the memory of a case can analyse."""

import re

import numpy as np
import pytest
from composed_domains import design_domain
from small_parts import box_part, held_bar

from gradedesign.design.acceptance.whole_resolution import (
    BESIDE_S,
    first_spacing,
    judged_seconds,
    seconds,
    whole_estimates,
)
from gradedesign.design.case.read_case import load_case
from gradedesign.design.resolve.analysable import analysable_bounds, grid_spacing
from gradedesign.design.resolve.design_model import prepare
from gradedesign.design.resolve.fitting_part import part_of
from gradedesign.design.resolve.least_density import Need, Needs
from gradedesign.design.resolve.planned_solid import PlannedPart, planned_solid
from gradedesign.design.resolve.registry import lookup
from gradedesign.errors import ResourceError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cell_surface import cell_surface
from gradedesign.mechanics.explicit.analysis import PlannedSolid
from gradedesign.mechanics.explicit.finite_cells import FINITE_CELLS
from gradedesign.program.host.registry import build_registry

CASE = (
    held_bar(
        box_part(60, 40, 40, 10),
        name="block",
        material='name = "Ti-6Al-4V"',
        load_case="shear",
        force="0 N, 0 N, -400 N",
    )
    + """\
[limits]
safety_factor = 2
[lattice]
cell = "bcc"
size = "10 mm"
"""
)
PLANNED = PlannedPart(
    box=(60.0, 40.0, 40.0),
    latticed=60.0 * 40.0 * 40.0,
    solid=0.0,
    inclined=0.0,
    inner=0.0,
    load_cases=1,
)
BLOCK = PlannedSolid(
    box=(60.0, 40.0, 40.0), volume=3e4, projections=4e4, curvature=0.0, load_cases=1
)


def domain_of(case):
    return design_domain(case, part_of(case, {}))


def bcc():
    return calibrate(lookup(build_registry(), "cell_families", "bcc"))


@pytest.fixture
def bounds_of(tmp_path):
    def call(more, bounds=(0.05, 0.8)):
        path = tmp_path / "case.toml"
        path.write_text(CASE + more, encoding="utf-8")
        case = load_case(path)
        found = analysable_bounds(
            *(case.lattice, case.run, bcc(), bounds, 10.0, FINITE_CELLS),
            part=PLANNED,
            domain=domain_of(case),
        )
        return case, found

    return call


def test_what_fits_stays_as_it_is(bounds_of):
    case, found = bounds_of('[run]\nmemory = "900 GB"\ntime = "1000 h"\n')
    assert found.bounds == (0.05, 0.8)
    assert found.warnings == ()
    assert found.memory_bytes <= case.run.memory


def test_the_lower_density_rises_to_what_the_memory_holds(bounds_of):
    case, found = bounds_of('[run]\nmemory = "4 GB"\n')
    low, high = found.bounds
    assert 0.05 < low < high == 0.8
    assert found.memory_bytes <= case.run.memory
    (warning,) = found.warnings
    assert warning.startswith(f"lower density raised from 0.05 to {low:.3g}")
    assert "[run] memory 4 GB" in warning
    _, more = bounds_of('[run]\nmemory = "8 GB"\n')
    assert more.bounds[0] < low


def test_the_lower_density_rises_to_what_acceptance_can_judge_in_time(bounds_of):
    case, found = bounds_of('[run]\nmemory = "900 GB"\ntime = "20 min"\n')
    assert found.bounds[0] > 0.1
    (warning,) = found.warnings
    assert "and time 20 min hold (at density 0.05" in warning
    # The finer of two resolutions takes a sixth of the time there.
    mean = found.bounds[0] + (0.8 - found.bounds[0]) / 3
    planned = planned_solid(PLANNED, mean, cell_surface(bcc(), mean, 10.0))
    first = first_spacing(FINITE_CELLS, found.spacing, bcc())
    _, finer = whole_estimates(planned, first)
    assert seconds(finer) == pytest.approx(case.run.time / 6, rel=0.05)


def test_results_that_stay_count_in_the_memory_of_a_finer_resolution():
    planned = BLOCK
    first, finer = whole_estimates(planned, 1.5, earlier_unknowns=1_000_000)
    # That of the iteration, 140 bytes an unknown as measured, and the search of the surface, 180
    # for each unknown of it and of the first resolution, whose result makes room.
    alone = FINITE_CELLS.estimate(planned, 1.0).memory_bytes
    stays = 140 * 1_000_000 + 180 * (1_000_000 + first.unknowns)
    assert finer.memory_bytes - alone == stays


def test_no_analysis_needs_no_memory(bounds_of):
    for words in ('stop_after = "sizing"', 'explicit_mesh_size = "0.1 mm"'):
        assert bounds_of(f'[run]\nmemory = "1 GB"\n{words}\n')[1].bounds == (0.05, 0.8)


def test_a_block_that_never_fits_names_what_would(bounds_of):
    case, found = bounds_of('[run]\nmemory = "300 MB"\n')
    assert re.search(r"walls of .* mm ask for a grid .* times as large", found.refusal)
    found = bounds_of('skin = {thickness = "0.2 mm"}\n[run]\nmemory = "1 GB"\n')[1]
    assert re.search(r"solid layers of 0\.2 mm .* these layers", found.refusal)
    with pytest.raises(ResourceError, match="ask for a grid"):
        prepare(case, build_registry())


def test_layers_need_fewer_cubes_than_struts(bounds_of):
    case, _ = bounds_of('skin = {thickness = "1 mm"}\n[run]\nmemory = "900 GB"\n')
    assert grid_spacing(domain_of(case), 1.0, 2.5, FINITE_CELLS) == pytest.approx(0.4)
    assert grid_spacing(domain_of(case), 9.0, 2.5, FINITE_CELLS) == pytest.approx(1 / 0.7)


def needs_of(*rows):
    """Needs of densities as (GB, GB of the finer one, s of that, s of all others)."""
    needs = [
        Need(memory=10**9 * a, finer_memory=10**9 * b, finer_seconds=c, other_seconds=d)
        for a, b, c, d in rows
    ]
    return Needs(spacings=np.ones(len(needs)), needs=needs, memory=8e9, time=3600.0)


def test_a_density_fits_where_memory_and_time_hold_its_run():
    # A finer one may take 8 GB and 600 s, all together 2700 s.
    rows = [(9, 7, 500, 900), (7, 9, 500, 900), (7, 7, 601, 900), (7, 7, 599, 2102)]
    assert needs_of(*rows, (7, 7, 599, 2100)).fits.tolist() == [False] * 4 + [True]
    # None can be judged by a finer one: those that are iterated in time, else those in memory.
    assert needs_of(*rows[:2], (7, 9, 500, 2701)).fits.tolist() == [False, True, False]
    assert needs_of(rows[0], (7, 9, 500, 2701)).fits.tolist() == [False, True]


def test_time_counts_the_resolutions_that_the_budgets_hold():
    planned = BLOCK
    first, finer = whole_estimates(planned, 1.0, 1_000_000)
    coarser = FINITE_CELLS.estimate(planned, 1.5)
    for memory, second in ((2 * finer.memory_bytes, finer), (0.9 * finer.memory_bytes, coarser)):
        took = judged_seconds(planned, 1.0, 1_000_000, memory, 1e6)
        assert took == pytest.approx(seconds(first) + seconds(second) + 2 * BESIDE_S)
