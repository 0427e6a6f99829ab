"""Constant density and density from stress; numbers of Ramirez Salazar, section 4.3 (R9)."""

import numpy as np
import pytest

from gradedesign import DensityError, power_law
from gradedesign.mechanics.material.constant_density import (
    density_for_stiffness,
    density_for_strength,
)
from gradedesign.mechanics.material.density_from_stress import density_from_stress
from gradedesign.mechanics.material.scaling_law import LawOrigin

NOTES = LawOrigin(kind="fe", source="tables 4.1 and 4.2", test="4x4x4 cells")
P = power_law(
    "p",
    ("primitive-wall",),
    youngs=(0.371, 1.415),
    strength=(0.289, 1.225),
    window=(0.095, 0.473),
    origin=NOTES,
)
G = power_law(
    "g",
    ("gyroid-wall",),
    youngs=(0.402, 1.176),
    strength=(0.426, 1.537),
    window=(0.125, 0.624),
    origin=NOTES,
)


@pytest.mark.parametrize(("law", "by_u", "by_s"), [(P, 0.310, 0.327), (G, 0.228, 0.319)])
def test_cantilever_of_the_thesis(law, by_u, by_s):
    # Solid beam: 0.1413 mm and 3.6705 MPa; limits 2 mm and 50 MPa. Printed to three digits.
    assert density_for_stiffness(law, 0.1413 / 2.0) == pytest.approx(by_u, abs=5e-4)
    assert density_for_strength(law, 3.6705 / 50.0) == pytest.approx(by_s, abs=5e-4)


def test_inversion_is_that_of_the_power_law():
    # Eq. 1.11: (sigma / (c3 sigma_perm))^(1/n3).
    assert density_for_strength(P, 4.0 / 50.0) == pytest.approx((4 / 50 / 0.289) ** (1 / 1.225))


def test_the_floor_is_enough_or_the_top_is_not():
    assert density_for_stiffness(G, 5e-7) == 0.125
    with pytest.raises(DensityError, match=r"0\.473"):
        density_for_strength(P, 0.8)
    with pytest.raises(DensityError):
        density_for_stiffness(G, np.nan)
    with pytest.raises(DensityError):
        density_for_stiffness(G, -0.1)


def test_density_field_matches_the_scalar_rule():
    stress = np.array([[0.1, 3.6705], [5.0, 2.0]])
    rho = density_from_stress(G, stress, 50.0)
    expected = np.maximum((stress / 50 / 0.426) ** (1 / 1.537), 0.125)
    np.testing.assert_allclose(rho, expected, atol=2e-5)


def test_too_much_stress_takes_the_densest_and_what_is_not_finite_is_refused():
    rho = density_from_stress(G, np.array([0.0, 1e3]), 50.0)
    np.testing.assert_allclose(rho, G.window)
    with pytest.raises(DensityError, match="not finite"):
        density_from_stress(G, np.array([np.nan]), 50.0)
