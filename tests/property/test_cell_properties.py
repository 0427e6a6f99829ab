"""Properties of every installed cell family, for any input."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.shape import grid_nodes
from gradedesign.geometry.cell.wall_size import wall_mm
from gradedesign.program.host.registry import build_registry

REGISTRY = build_registry()


#: Families of which every kind is checked in each run; all others in the slow run.
QUICK = {
    f"{surface}-{kind}"
    for surface in ("gyroid", "diamond", "primitive")
    for kind in ("network", "sheet", "wall")
}


def checked(end=""):
    """Families by the end of their name; most of them only in the slow run."""
    for name, family in REGISTRY.cell_families.items():
        if name.endswith(end):
            marks = [] if name in QUICK else [pytest.mark.slow]
            yield pytest.param(family, id=name, marks=marks)


every_family = pytest.mark.parametrize("family", list(checked()))
coordinate = st.floats(-4, 4, allow_nan=False)


@every_family
@settings(max_examples=25, deadline=None)
@given(
    point=st.tuples(coordinate, coordinate, coordinate),
    shift=st.tuples(*[st.integers(-3, 3)] * 3),
)
def test_whole_periods_change_nothing(family, point, shift):
    u = np.array(point)
    moved = family.shape(u + family.period * np.array(shift, dtype=float), **family.parameters)
    assert moved == pytest.approx(family.shape(u, **family.parameters), abs=1e-9)


@every_family
@settings(max_examples=25, deadline=None)
@given(fractions=st.tuples(st.floats(0, 1), st.floats(0, 1)))
def test_level_and_wall_increase_with_density(family, fractions):
    calibration = calibrate(family)
    a, b = calibration.window
    low, high = sorted(a + (b - a) * f for f in fractions)
    assert calibration.density_of(calibration.level_of(low)) == pytest.approx(low, abs=1e-9)
    if high - low > 1e-6:
        assert calibration.level_of(low) < calibration.level_of(high)
    assert wall_mm(calibrate(family), low, 5.0) <= wall_mm(calibrate(family), high, 5.0) + 1e-12


@every_family
def test_density_agrees_with_a_voxel_count(family):
    # The bound of the calibration, 0.003, on points of its own: one anywhere in each of 160^3
    # voxels. Centres in mirrored pairs are 0.005 off for a few sheets with 100^3, and flat faces
    # along the grid take in whole layers of centres at once.
    calibration = calibrate(family)
    inside = np.random.default_rng(1606).uniform(0, 1 / 160, (3, 160, 160, 160))
    nodes = family.period * (grid_nodes(160, (0.0, 0.0, 0.0)) + inside)
    grid = family.shape(nodes, **family.parameters)
    for rho in np.linspace(*calibration.window, 7):
        assert np.mean(grid <= calibration.level_of(rho)) == pytest.approx(rho, abs=0.003)


@pytest.mark.parametrize("family", list(checked("-sheet")))
def test_sheet_and_void_fill_the_cell(family):
    # Sheet f in [-t, t] of the network's function: solid plus both voids is one cell.
    network = REGISTRY.cell_families[family.name.replace("-sheet", "-network")]
    nodes = family.period * grid_nodes(100, (0.5, 0.5, 0.5))
    values = network.shape(nodes, **network.parameters)
    level = float(calibrate(family).level_of(0.2))
    voids = np.mean(values < -level) + np.mean(values > level)
    assert voids == pytest.approx(0.8, abs=0.003)
