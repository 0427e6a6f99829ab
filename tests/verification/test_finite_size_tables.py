"""Shipped finite-size ratios, computed again: on the same grids, and on finer ones."""

import pytest

from gradedesign.homogenise.finite_size_rows import SOLVE_ERROR, finite_size_row
from gradedesign.plugin.registry import build_registry

SERIES = ("block", "wall", "wall_shear")


def both(name, rho, resolution=None):
    """Shipped row and one computed now."""
    registry = build_registry()
    shipped = next(r for r in registry.finite_size_tables[name].rows if r.density == rho)
    again = finite_size_row(registry.cell_families[name], rho, resolution or shipped.resolution)
    return shipped, again


def test_a_row_comes_out_again():
    """Only rounding in another order may differ, through the solves. Seen to fail at 1 %."""
    shipped, again = both("sc", 0.7)
    for key in SERIES:
        for a, b in zip(getattr(shipped, key), getattr(again, key), strict=False):
            assert a.cells == b.cells
            assert a.value == pytest.approx(b.value, abs=2 * SOLVE_ERROR)
            assert a.spread == pytest.approx(b.spread, abs=2 * SOLVE_ERROR)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "rho"), [("sc", 0.5), ("gyroid-network", 0.5), ("bcc", 0.3)])
def test_finer_grids_agree_within_the_error_bars(name, rho):
    """36 and 24 voxels instead of 24 and 16; extrapolation adds twice the stated change."""
    shipped, again = both(name, rho, 36)
    for key in SERIES:
        a, b = getattr(shipped, key)[0], getattr(again, key)[0]
        assert abs(a.value - b.value) <= 2 * (a.error + b.error)
