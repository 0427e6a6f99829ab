"""Laws made from tables: through the points, monotone, positive definite, true derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from oracles.turned_stiffness import rotated_stiffness

from gradedesign.errors import DensityError
from gradedesign.mechanics.material.property_table import PropertyTable
from gradedesign.mechanics.material.strength_surface import StrengthSurface
from gradedesign.mechanics.material.tabulated_law import tabulated_law

DENSITY = np.array([0.1, 0.15, 0.2, 0.3, 0.5, 0.8])


def table(symmetry="cubic", **change):
    """Powers of density with different exponents; turned out of the axes unless cubic."""
    c = np.zeros((6, 6, 6))
    for i, r in enumerate(DENSITY):
        volume, normal, shear = 1.2 * r**1.4, 0.6 * r**2.1, 0.3 * r**1.7
        c[i] = np.diag([normal] * 3 + [shear] * 3)
        c[i, :3, :3] += (volume - normal) / 3
        if symmetry != "cubic":
            c[i, 2, 2] += 0.1 * r
            a = 0.4
            turn = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
            c[i] = rotated_stiffness(c[i], turn)
    values = {
        "name": "test-computed",
        "family": "test",
        "parameters": {},
        "symmetry": symmetry,
        "poissons_ratio": 0.3,
        "density": DENSITY,
        "stiffness": c,
        "stiffness_error": np.full(6, 0.003),
        "strength": 0.4 * DENSITY**1.5,
        "strength_error": np.full(6, 0.03),
        "resolution": np.full(6, 64),
        "percentile": 99.5,
        "method": "made up",
        "version": "0",
        "date": "2026-11-21",
    }
    return PropertyTable(**{**values, **change})


@pytest.mark.parametrize("symmetry", ["cubic", "none"])
def test_law_runs_through_the_table(symmetry) -> None:
    data = table(symmetry)
    law = tabulated_law(data)
    assert law.kind == "computed"
    assert law.window == (0.1, 0.8)
    found = law.stiffness(DENSITY)
    assert found.shape == (6, 6, 6)
    np.testing.assert_allclose(np.moveaxis(found, -1, 0), data.stiffness, rtol=1e-10, atol=1e-14)
    np.testing.assert_allclose(law.strength(DENSITY), data.strength)


def test_powers_are_reproduced_between_the_points() -> None:
    # In logarithms a power is a straight line, which monotone cubics reproduce exactly.
    law = tabulated_law(table())
    rho = np.array([0.12, 0.25, 0.63])
    c = law.stiffness(rho)
    np.testing.assert_allclose(c[3, 3], 0.3 * rho**1.7)
    np.testing.assert_allclose(c[0, 0] + 2 * c[0, 1], 1.2 * rho**1.4)
    np.testing.assert_allclose(c[0, 0] - c[0, 1], 0.6 * rho**2.1)
    np.testing.assert_allclose(law.strength(rho), 0.4 * rho**1.5)


@pytest.mark.parametrize("symmetry", ["cubic", "none"])
def test_derivatives_equal_finite_differences(symmetry) -> None:
    law = tabulated_law(table(symmetry))
    # Not at the points of the table, where the second derivative jumps.
    rho, step = np.linspace(0.103, 0.797, 41), 1e-6
    by_difference = (law.stiffness(rho + step) - law.stiffness(rho - step)) / (2 * step)
    np.testing.assert_allclose(law.stiffness_derivative(rho), by_difference, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("symmetry", ["cubic", "none"])
def test_stiffness_is_positive_definite_and_grows(symmetry) -> None:
    law = tabulated_law(table(symmetry))
    rho = np.linspace(0.1, 0.8, 400)
    c = np.moveaxis(law.stiffness(rho), -1, 0)
    assert (np.linalg.eigvalsh(c) > 0).all()
    assert (np.linalg.eigvalsh(np.diff(c, axis=0)) > 0).all()
    assert (np.diff(law.strength(rho)) > 0).all()


def test_shapes_follow_the_density() -> None:
    law = tabulated_law(table("none"))
    assert law.stiffness(np.array(0.2)).shape == (6, 6)
    assert law.stiffness_derivative(np.full((2, 3), 0.2)).shape == (6, 6, 2, 3)
    assert law.strength(np.full((2, 3), 0.2)).shape == (2, 3)


@pytest.mark.parametrize("rho", [0.09, 0.81, np.nan])
def test_outside_the_window_is_an_error(rho) -> None:
    law = tabulated_law(table())
    for curve in (law.stiffness, law.stiffness_derivative, law.strength):
        with pytest.raises(DensityError, match="test-computed"):
            curve(np.array([0.3, rho]))


def test_tables_that_do_not_grow_are_refused() -> None:
    weak = 0.4 * DENSITY**1.5
    weak[3] = weak[2]
    with pytest.raises(ValueError, match="do not grow"):
        tabulated_law(table(strength=weak))
    for symmetry in ("cubic", "none"):
        c = table(symmetry).stiffness.copy()
        c[4] = 0.9 * c[3]
        with pytest.raises(ValueError, match="grow"):
            tabulated_law(table(symmetry, stiffness=c))


def test_records_are_checked_and_locked() -> None:
    data = table()
    with pytest.raises(ValueError, match="read-only"):
        data.stiffness[0, 0, 0] = 1.0
    with pytest.raises(ValueError, match="increasing"):
        table(density=DENSITY[::-1])
    with pytest.raises(ValueError, match="shape"):
        table(strength=np.ones(3))


def test_surfaces_of_a_table_become_local_stress_of_its_law() -> None:
    assert tabulated_law(table()).local_stress is None
    surfaces = tuple(
        StrengthSurface(
            exponent=4,
            weights=np.ones(1),
            forms=np.eye(6)[None] / r**3,
            symmetry="cubic",
            max_error=0.01 + 0.1 * r,
            rms_error=0.0,
            unsafe_error=0.1 * r,
            percentile=99.5,
        )
        for r in DENSITY
    )
    law = tabulated_law(table(surfaces=surfaces))
    assert law.local_stress is not None
    assert dict(law.coefficients)["surface_error"] == pytest.approx(0.09)
    assert dict(law.coefficients)["surface_unsafe_error"] == pytest.approx(0.08)
    profile = law.local_stress.profile(np.array([[3.0], [0], [0], [0], [4.0], [0]]))
    # The identity as a form makes the length of the Voigt vector, here 5.
    assert law.local_stress.at(profile, np.array([0.4]))[0] == pytest.approx(5 * 0.4**-1.5)
