"""Struts: thin-strut limits, joints by convolution, and a thin sheet of the literature."""

from __future__ import annotations

import numpy as np
import pytest

from gradedesign.errors import DensityError, LatticeError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.mechanics.homogenise.constants import (
    engineering_constants,
    isotropic_averages,
    zener_ratio,
)
from gradedesign.mechanics.homogenise.periodic import solve_periodic
from gradedesign.mechanics.homogenise.sampling import cell_fill
from gradedesign.program.host.registry import build_registry


@pytest.fixture(scope="module")
def registry():
    return build_registry()


def extrapolated(registry, name, rho, n, *, nu=0.3, **parameters):
    """Stiffness from filled voxels of n and half of n, as tables are made."""
    family = registry.cell_families[name]
    coarse, fine = (
        solve_periodic(
            cell_fill(calibrate(family, parameters or None), rho, k), poissons_ratio=nu, rtol=1e-3
        ).stiffness
        for k in (n // 2, n)
    )
    return fine + (fine - coarse) / 3


def modulus(c):
    return engineering_constants(c).youngs[0]


# properties.md 4.1: affine trusses of thin struts; K is rho / 9 for every rigid one.
@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "bulk", "along"), [("octet", 1 / 9, 1 / 9), ("sc", 1 / 9, 1 / 3), ("bcc", 1 / 9, 0.0)]
)
def test_thin_trusses_approach_their_limits(registry, name, bulk, along) -> None:
    # Joints add stiffness of higher order: what they add to K / rho falls faster than the width of
    # struts, the root of density, and slower than density. Of the straight lines through the two
    # thinner ones, that in density ends above the limit, that in width below it: by hand 0.121 and
    # 0.104 for octet.
    density = np.array([0.12, 0.06, 0.03])
    grids = (64, 64, 96 if name == "octet" else 64)
    found = [extrapolated(registry, name, *pair) for pair in zip(density, grids, strict=True)]
    stiff = np.array([isotropic_averages(c).bulk for c in found]) / density
    assert (np.diff(stiff) < 0).all()
    assert (stiff > bulk).all()
    assert at_none(stiff, np.sqrt(density)) < bulk < at_none(stiff, density)
    assert at_none(stiff, density) == pytest.approx(bulk, rel=0.1)
    youngs = np.array([modulus(c) for c in found]) / density
    if along:
        assert at_none(youngs, np.sqrt(density)) < along < at_none(youngs, density)
        assert at_none(youngs, density) == pytest.approx(along, rel=0.1)
    else:
        # Bending: E / rho falls as density itself.
        assert at_none(youngs, density) == pytest.approx(0.0, abs=0.006)


def at_none(values, width):
    """Value at width 0 of the straight line through the last two."""
    return values[-1] - (values[-2] - values[-1]) / (width[-2] - width[-1]) * width[-1]


@pytest.mark.slow
def test_kelvin_cell_approaches_bending_beams(registry) -> None:
    # Zhu, Knott and Mills 1997, round struts: 0.600 rho^2 / (1 + 0.900 rho). At 0.1 struts are 3
    # times as long as wide and FE gives twice that; joints shorten struts in proportion to their
    # width, so the excess falls with the root of density. By hand: 1.93, 1.61, 1.54, 1.28, 1.27
    # times the formula: a straight line in width, from which they lie 0.04 off, meets 0.95 at none,
    # uncertain by 0.05.
    density, grids = np.array([0.1, 0.05, 0.03, 0.015, 0.01]), (64, 64, 96, 144, 144)
    found = np.array(
        [
            modulus(extrapolated(registry, "kelvin", float(rho), n))
            for rho, n in zip(density, grids, strict=True)
        ]
    )
    excess = found / (0.600 * density**2 / (1 + 0.900 * density)) - 1
    assert 0.7 < excess[0] < 1.2
    assert (np.diff(excess) < 0).all()
    assert excess[4] > 0.2
    slope, limit = np.polyfit(np.sqrt(density), excess, 1)
    assert limit == pytest.approx(0.0, abs=0.12)
    power = np.diff(np.log(found)) / np.diff(np.log(density))
    # 2 - 0.9 rho and, of the line, half of its excess over the whole at a density of 0.07.
    part = slope * np.sqrt(0.07)
    assert power[0] == pytest.approx(2.0 - 0.06 + 0.5 * part / (1.0 + part), abs=0.1)
    assert power[3] == pytest.approx(2.0, abs=0.12)


# Tang et al. 2019: X cell, E 1600 MPa, nu 0.38, MPa. With cells of 15 mm, which the paper does not
# tell, its sigma in mm gives what it prints: the best sigma, and where struts come apart.
CELL = 15.0
BOOLEAN = {0.1: 3.0, 0.2: 16.5}
CONVOLUTION = {
    (0.1, 0.8): 3.7, (0.1, 1.2): 3.2, (0.1, 1.4): 1.4,
    (0.2, 0.8): 20.44, (0.2, 1.2): 23.19, (0.2, 1.4): 24.0, (0.2, 1.6): 21.7,
}  # fmt: skip


@pytest.mark.slow
def test_joints_by_convolution_stiffen(registry) -> None:
    # By hand with 48 voxels: 16.4 Boolean; 20.8, 24.9, 25.6, 22.9. At 0.1
    # struts are thin: with 48, 64, 96, 128 voxels 3.40, 3.17, 2.97, 2.95 Boolean, and with 96 and
    # 128 4.02 and 4.00, 3.56 and 3.55, 1.21 and 1.20.
    def voxels(rho):
        return 96 if rho == 0.1 else 48

    boolean = {
        rho: 1600 * modulus(extrapolated(registry, "bcc", rho, voxels(rho), nu=0.38))
        for rho in BOOLEAN
    }
    for rho, expected in BOOLEAN.items():
        assert boolean[rho] == pytest.approx(expected, rel=0.1)
    found = {
        (rho, sigma): 1600
        * modulus(
            extrapolated(registry, "bcc-convolution", rho, voxels(rho), nu=0.38, sigma=sigma / CELL)
        )
        for rho, sigma in CONVOLUTION
    }
    # Near parting a percent of the cell's size, which the paper does not tell, is 6 % of modulus:
    # from sigma 1.2 to 1.4 it falls by a factor of three.
    near_parting = {(0.1, 1.2): 0.13, (0.1, 1.4): 0.2}
    for key, expected in CONVOLUTION.items():
        assert found[key] == pytest.approx(expected, rel=near_parting.get(key, 0.1))
    # The best sigma of those tried, and the gain that the paper claims.
    assert max((0.8, 1.2, 1.4), key=lambda s: found[0.1, s]) == 0.8
    assert max((0.8, 1.2, 1.4, 1.6), key=lambda s: found[0.2, s]) == 1.4
    assert found[0.2, 1.4] > 1.2 * boolean[0.2]
    assert found[0.1, 0.8] > 1.2 * boolean[0.1]


def test_wide_convolutions_come_apart(registry) -> None:
    # Tang's 0 at sigma 1.6 and density 0.1; the field keeps joints only.
    family = registry.cell_families["bcc-convolution"]
    with pytest.raises((LatticeError, DensityError), match=r"connect|falls apart"):
        solve_periodic(cell_fill(calibrate(family, {"sigma": 1.6 / CELL}), 0.1, 24), rtol=1e-2)


@pytest.mark.slow
def test_thin_primitive_wall_of_ramirez(registry) -> None:
    # Thesis, appendix B: wall of 2 mm in cells of 50 mm, E 3960 MPa, nu 0.4. Printed E 74.4, G 65.0
    # (one layer of linear tets); the reference's voxels of 100^3: E 59.9, nu 0.42, G 61.4, Zener
    # 2.9. Filled voxels here: the wall is 3 of 72, extrapolated.
    family = registry.cell_families["primitive-wall"]
    rho = float(calibrate(family).density_of(0.5 * 2 / 50))
    c = 3960 * extrapolated(registry, "primitive-wall", rho, 72, nu=0.4)
    found = engineering_constants(c)
    assert found.youngs[0] == pytest.approx(59.9, rel=0.08)
    assert found.shear[0] == pytest.approx(61.4, rel=0.05)
    assert found.poisson[0] == pytest.approx(0.42, abs=0.015)
    assert zener_ratio(c) == pytest.approx(2.9, rel=0.08)
    # Linear tets are too stiff: the print lies above.
    assert found.youngs[0] < 74.4
    assert found.shear[0] < 65.3
