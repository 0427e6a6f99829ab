"""Stiffness by direction: ranges across a direction, extremes over the sphere, bounds."""

from __future__ import annotations

import numpy as np
import pytest
from oracles.turned_stiffness import rotated_stiffness, shear_and_poisson

from gradedesign.mechanics.homogenise.bounds import check_bounds
from gradedesign.mechanics.homogenise.constants import solid_stiffness, youngs_along
from gradedesign_laboratory.directional import (
    compliance_tensor,
    sphere_directions,
    transverse_range,
    youngs_extremes,
)


def random_stiffness(seed: int) -> np.ndarray:
    a = np.random.default_rng(seed).standard_normal((6, 6))
    return a @ a.T + np.eye(6)


def test_ranges_equal_turning_around_the_direction() -> None:
    # Slow version: G and nu at 3600 angles about the direction.
    c = random_stiffness(71)
    rng = np.random.default_rng(72)
    for n in rng.standard_normal((3, 3)):
        n /= np.linalg.norm(n)
        first = np.cross(n, [0.3, -0.5, 0.8])
        first /= np.linalg.norm(first)
        second = np.cross(n, first)
        angle = np.linspace(0, np.pi, 720, endpoint=False)
        values = np.array(
            [shear_and_poisson(c, n, np.cos(a) * first + np.sin(a) * second) for a in angle]
        )
        found = transverse_range(c, n)
        np.testing.assert_allclose(found.shear_least, values[:, 0].min(), rtol=1e-4)
        np.testing.assert_allclose(found.shear_greatest, values[:, 0].max(), rtol=1e-4)
        np.testing.assert_allclose(found.shear_mean, values[:, 0].mean(), rtol=1e-6)
        np.testing.assert_allclose(found.poisson_least, values[:, 1].min(), atol=1e-4)
        np.testing.assert_allclose(found.poisson_greatest, values[:, 1].max(), atol=1e-4)
        np.testing.assert_allclose(found.poisson_mean, values[:, 1].mean(), rtol=1e-6)


def test_ranges_follow_the_shape_of_the_directions() -> None:
    c = random_stiffness(73)
    n = np.random.default_rng(74).standard_normal((3, 4, 5))
    found = transverse_range(c, n)
    assert found.shear_mean.shape == (4, 5)
    alone = transverse_range(c, 7.0 * n[:, 2, 3])
    assert found.poisson_mean[2, 3] == pytest.approx(float(alone.poisson_mean))


def test_an_isotropic_solid_has_no_ranges() -> None:
    found = transverse_range(solid_stiffness(0.28), sphere_directions(20))
    np.testing.assert_allclose(found.shear_greatest, 1 / 2.56)
    np.testing.assert_allclose(found.shear_least, 1 / 2.56)
    np.testing.assert_allclose(found.poisson_mean, 0.28)


def test_an_auxetic_direction_of_iron_pyrite() -> None:
    # Cubic with C12 < 0 (pyrite, GPa: 382, -46, 109; Simmons and Birch 1963): nu along <100> is
    # C12 / (C11 + C12), negative.
    c = np.diag([382.0 + 46] * 3 + [109.0] * 3)
    c[:3, :3] += -46.0
    found = transverse_range(c, np.array([1.0, 0, 0]))
    assert float(found.poisson_least) == pytest.approx(-46 / (382 - 46))


def test_compliance_tensor_inverts_on_tensors() -> None:
    c = random_stiffness(75)
    strain = np.random.default_rng(76).standard_normal((3, 3))
    strain += strain.T
    pairs = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
    stress = c @ np.array([strain[i, j] * (1 if i == j else 2) for i, j in pairs])
    tensor = np.zeros((3, 3))
    for (i, j), s in zip(pairs, stress, strict=True):
        tensor[i, j] = tensor[j, i] = s
    again = np.einsum("ijkl,kl->ij", compliance_tensor(c), tensor)
    np.testing.assert_allclose(again, strain, atol=1e-10)


def test_extremes_of_copper() -> None:
    # Copper, GPa (Nye): least 66.7 along <100>, greatest 191.1 along <111>.
    c = np.diag([47.0] * 3 + [75.4] * 3)
    c[:3, :3] += 121.4
    turn = np.linalg.qr(np.random.default_rng(77).standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    least, soft, greatest, stiff = youngs_extremes(rotated_stiffness(c, turn))
    assert least == pytest.approx(66.7, abs=0.05)
    assert greatest == pytest.approx(191.1, abs=0.15)
    assert np.abs(turn.T @ soft).max() == pytest.approx(1.0, abs=1e-5)
    np.testing.assert_allclose(np.abs(turn.T @ stiff), 3**-0.5, atol=1e-4)
    assert (youngs_along(c, sphere_directions(500)) >= least - 1e-9).all()


def test_every_bound_is_listed_and_one_breaks_alone() -> None:
    c = 0.3 * solid_stiffness(0.3)
    names = {bound.name: bound.holds for bound in check_bounds(c, 0.3, 0.3)}
    assert names["Voigt, energy"]
    assert names["Voigt, bulk"]
    assert not names["Hashin-Shtrikman, Hill bulk"]
    assert all(bound.holds for bound in check_bounds(0.4 * c, 0.3, 0.3))
    assert not any(
        bound.holds for bound in check_bounds(-c, 0.3, 0.3) if bound.name != "Voigt, energy"
    )
