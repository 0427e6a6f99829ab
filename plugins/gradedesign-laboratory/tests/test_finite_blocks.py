"""Order of the boundary conditions, mirrored cells, published finite samples, thin walls."""

from __future__ import annotations

import numpy as np
import pytest

from gradedesign.mechanics.homogenise.constants import engineering_constants
from gradedesign.mechanics.homogenise.periodic import solve_periodic
from gradedesign_laboratory.block import filled_void, solve_block
from gradedesign_laboratory.conductivity import cell_conductivity, conductivity_bound


def coordinates(count: int, start: float = 0.0) -> np.ndarray:
    c = (np.arange(count) + 0.5) / count * 2 * np.pi + start
    return np.stack(np.meshgrid(c, c, c, indexing="ij"))


def gyroid(x, y, z):
    return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)


def primitive(x, y, z):
    return np.cos(x) + np.cos(y) + np.cos(z)


def lowest(value: np.ndarray, rho: float) -> np.ndarray:
    """Solid or void by the centre; ties, equal by symmetry, go together."""
    value = np.round(value, 9)
    return (value <= np.quantile(value, rho)).astype(float)


CELLS = {
    "gyroid sheet": lambda u: np.abs(gyroid(*u)),
    "gyroid network": lambda u: gyroid(*u),
    "primitive sheet": lambda u: np.abs(primitive(*u)),
    "primitive network": lambda u: primitive(*u),
    "body-centred struts": lambda u: (
        -np.maximum.reduce(
            [np.cos(u[0] - s * u[1]) + np.cos(u[1] - t * u[2]) for s in (1, -1) for t in (1, -1)]
        )
    ),
}


@pytest.mark.parametrize(
    ("name", "rho"), [*((name, 0.3) for name in CELLS), ("gyroid network", 0.6)]
)
def test_traction_below_periodic_below_displacement(name, rho) -> None:
    # Hazanov and Huet 1994, in the sense of energies; the void carries 1e-3 in all three.
    fill = filled_void(lowest(CELLS[name](coordinates(12, 0.3)), rho))
    upper = solve_block(fill, "displacement", rtol=1e-4).stiffness
    lower = solve_block(fill, "traction", rtol=1e-4).stiffness
    middle = solve_periodic(fill, rtol=1e-4).stiffness
    slack = 1e-6
    assert np.linalg.eigvalsh(upper - middle)[0] > -slack
    assert np.linalg.eigvalsh(middle - lower)[0] > -slack
    # They are apart, so that an error of 1 % would not go unseen everywhere.
    assert np.linalg.eigvalsh(upper - lower)[-1] > 0.01 * middle[0, 0]


def test_the_order_is_tight_for_layers() -> None:
    """Layers without Poisson's ratio: each bound is reached, so 1 % too much of any one shows.

    Exact: along the layers strain is uniform (displacement conditions give Voigt's mean, as
    periodic ones do), across them stress is (tractions give Reuss' mean, as periodic ones do).
    """
    fill = np.full((6, 6, 6), 0.3)
    fill[:, :, :2] = 1.0
    upper = solve_block(fill, "displacement", poissons_ratio=0.0, rtol=1e-6).stiffness
    lower = solve_block(fill, "traction", poissons_ratio=0.0, rtol=1e-6).stiffness
    middle = solve_periodic(fill, poissons_ratio=0.0, rtol=1e-6).stiffness
    voigt, reuss = fill.mean(), 1 / (1 / fill).mean()
    assert upper[0, 0] == pytest.approx(voigt, rel=1e-6)
    assert lower[2, 2] == pytest.approx(reuss, rel=1e-6)
    np.testing.assert_allclose(middle[[0, 2], [0, 2]], [voigt, reuss], rtol=1e-6)
    slack = 1e-6
    assert np.linalg.eigvalsh(upper - middle)[0] > -slack
    assert np.linalg.eigvalsh(middle - lower)[0] > -slack
    # What the order alone sees of an error of 1 % in one of the three.
    assert np.linalg.eigvalsh(0.99 * upper - middle)[0] < -slack
    assert np.linalg.eigvalsh(upper - 1.01 * middle)[0] < -slack
    assert np.linalg.eigvalsh(0.99 * middle - lower)[0] < -slack
    assert np.linalg.eigvalsh(middle - 1.01 * lower)[0] < -slack


@pytest.mark.parametrize("network", [True, False])
def test_mixed_conditions_equal_periodic_ones_where_mirrors_bound_the_cell(network) -> None:
    # Pahr and Zysset 2008: exact for a cell with mirror planes at its faces.
    value = primitive(*coordinates(16))
    fill = lowest(value if network else np.abs(value), 0.4)
    periodic = solve_periodic(fill, rtol=1e-7).stiffness
    mixed = solve_block(fill, "mixed", rtol=1e-7).stiffness
    np.testing.assert_allclose(mixed, periodic, atol=1e-6 * periodic[0, 0])
    stiff = solve_block(fill, "displacement", rtol=1e-3).stiffness
    assert stiff[3, 3] > 1.02 * periodic[3, 3]


# Raymont reference B8: 16 voxels per cell, E100 of a network gyroid at 60 %: one cell 0.4306, two
# 0.3853, periodic 0.3270. Where its grid starts is not told: 3 %.
def sample(cells):
    c = np.arange(16 * cells) / 16 * 2 * np.pi
    return lowest(-gyroid(*np.meshgrid(c, c, c, indexing="ij")), 0.6)


def test_displacement_conditions_of_one_cell() -> None:
    one = engineering_constants(solve_block(sample(1), "displacement", rtol=1e-3).stiffness)
    repeated = engineering_constants(solve_periodic(sample(1), rtol=1e-3).stiffness)
    assert one.youngs[0] == pytest.approx(0.4306, rel=0.03)
    assert repeated.youngs[0] == pytest.approx(0.3270, rel=0.03)


@pytest.mark.slow
def test_displacement_conditions_of_two_cells() -> None:
    two = engineering_constants(solve_block(sample(2), "displacement", rtol=1e-3).stiffness)
    assert two.youngs[0] == pytest.approx(0.3853, rel=0.03)


def test_thin_minimal_surfaces_conduct_two_thirds_of_their_volume() -> None:
    # A sheet conducts along itself only; where its normals point evenly (cubic symmetry) the flux
    # factor of a minimal surface is 2/3, the bound of Hashin and Shtrikman as density falls.
    u = coordinates(40)
    value = np.abs(primitive(*u))
    # At equal thickness, not equal level: divide by the slope.
    slope = np.sqrt((np.sin(u) ** 2).sum(axis=0))
    for rho in (0.2, 0.3):
        fill = lowest(value / np.maximum(slope, 0.1), rho)
        found = cell_conductivity(fill, rtol=1e-4)
        share = found[0, 0] / conductivity_bound(float(fill.mean()))
        # Voxels of 40 leave steps in the sheet.
        assert 0.92 < share <= 1.0
        np.testing.assert_allclose(np.diag(found), found[0, 0], rtol=1e-6)


def test_straight_bars_conduct_a_third_of_their_volume() -> None:
    # Thin bars along three axes: each carries its own share, so rho / 3 beside their joints.
    fill = np.zeros((40, 40, 40))
    fill[:2, :2, :] = fill[:2, :, :2] = fill[:, :2, :2] = 1.0
    found = cell_conductivity(fill, rtol=1e-3)
    assert found[0, 0] == pytest.approx(fill.mean() / 3, rel=0.07)
