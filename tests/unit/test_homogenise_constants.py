"""Engineering constants, averages, rotation and bounds."""

from __future__ import annotations

import numpy as np
import pytest
from oracles.turned_stiffness import rotated_stiffness, shear_and_poisson
from scipy.spatial.transform import Rotation

from gradedesign.errors import SolverError
from gradedesign.mechanics.homogenise.bounds import hashin_shtrikman_upper, require_bounds
from gradedesign.mechanics.homogenise.constants import (
    engineering_constants,
    isotropic_averages,
    solid_stiffness,
    youngs_along,
    zener_ratio,
)


def cubic(c11: float, c12: float, c44: float) -> np.ndarray:
    c = np.diag([c11 - c12] * 3 + [c44] * 3)
    c[:3, :3] += c12
    return c


def rotate_slowly(c: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Rotate the full fourth-order tensor, index by index."""
    pairs = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
    full = np.zeros((3, 3, 3, 3))
    for a, (i, j) in enumerate(pairs):
        for b, (k, m) in enumerate(pairs):
            full[i, j, k, m] = full[j, i, k, m] = full[i, j, m, k] = full[j, i, m, k] = c[a, b]
    turned = np.einsum("ai,bj,ck,dm,ijkm->abcd", r, r, r, r, full)
    return np.array([[turned[i, j, k, m] for k, m in pairs] for i, j in pairs])


# Copper, GPa: C11 168.4, C12 121.4, C44 75.4; Zener 3.21, E100 66.7, E111 191.1
# (Nye, Physical Properties of Crystals, and Courtney, Mechanical Behavior of Materials, table 2.3).
COPPER = cubic(168.4, 121.4, 75.4)


def test_copper() -> None:
    assert zener_ratio(COPPER) == pytest.approx(3.21, abs=0.005)
    directions = np.array([[1.0, 1.0], [0.0, 1.0], [0.0, 1.0]])
    np.testing.assert_allclose(youngs_along(COPPER, directions), [66.7, 191.1], atol=0.15)
    # Hill's averages of copper: K 137.1, G 47.3 GPa (from the same constants by hand: G_V 54.64,
    # G_R 40.0).
    means = isotropic_averages(COPPER)
    assert means.bulk == pytest.approx((168.4 + 2 * 121.4) / 3)
    assert means.shear_voigt == pytest.approx((168.4 - 121.4 + 3 * 75.4) / 5)
    assert means.shear_reuss == pytest.approx(5 / (4 / (168.4 - 121.4) * 1.0 + 3 / 75.4))
    assert means.shear_reuss < means.shear < means.shear_voigt


def test_constants_of_an_isotropic_solid() -> None:
    c = 210.0 * solid_stiffness(0.28)
    found = engineering_constants(c)
    np.testing.assert_allclose(found.youngs, 210.0)
    np.testing.assert_allclose(found.shear, 210.0 / 2.56)
    np.testing.assert_allclose(found.poisson, 0.28)
    means = isotropic_averages(c)
    assert means.youngs == pytest.approx(210.0)
    assert means.poisson == pytest.approx(0.28)
    rng = np.random.default_rng(3)
    n = rng.standard_normal(3)
    m = np.cross(n, rng.standard_normal(3))
    shear, poisson = shear_and_poisson(c, n, m)
    assert shear == pytest.approx(210.0 / 2.56)
    assert poisson == pytest.approx(0.28)


def test_rotation_equals_the_full_tensor() -> None:
    rng = np.random.default_rng(4)
    a = rng.standard_normal((6, 6))
    c = a @ a.T
    for r in Rotation.random(4, rng=rng).as_matrix():
        np.testing.assert_allclose(rotated_stiffness(c, r), rotate_slowly(c, r), atol=1e-12)


def test_rotation_leaves_bulk_and_turns_youngs_modulus() -> None:
    r = Rotation.from_euler("zx", [0.4, -1.1]).as_matrix()
    turned = rotated_stiffness(COPPER, r)
    local = np.array([1.0, 0.0, 0.0])
    assert youngs_along(turned, r @ local) == pytest.approx(youngs_along(COPPER, local))
    assert isotropic_averages(turned).bulk == pytest.approx(isotropic_averages(COPPER).bulk)


def test_a_shear_is_no_rotation() -> None:
    with pytest.raises(SolverError, match="not a rotation"):
        rotated_stiffness(COPPER, np.array([[1.0, 0.5, 0], [0, 1, 0], [0, 0, 1]]))


# properties.md 4.1: upper bound on E/Es at nu 0.3.
@pytest.mark.parametrize(
    ("rho", "youngs"), [(0.1, 0.0525), (0.2, 0.1109), (0.3, 0.1761), (0.5, 0.3328)]
)
def test_hashin_shtrikman(rho, youngs) -> None:
    k, g = hashin_shtrikman_upper(rho, 0.3)
    assert 9 * k * g / (3 * k + g) == pytest.approx(youngs, abs=6e-5)


def test_bulk_bound_of_the_study() -> None:
    # Solver study, section 3: 0.1170 at rho 0.3.
    assert hashin_shtrikman_upper(0.3, 0.3)[0] == pytest.approx(0.1170, abs=5e-5)


def test_bounds_accept_the_bound_and_refuse_one_per_cent_more() -> None:
    k, g = hashin_shtrikman_upper(0.3, 0.3)
    best = cubic(k + 4 / 3 * g, k - 2 / 3 * g, g)
    require_bounds(best, 0.3, 0.3)
    with pytest.raises(SolverError, match="Shtrikman, Reuss bulk"):
        require_bounds(1.01 * best, 0.3, 0.3)


def test_bounds_refuse_mechanisms_asymmetry_and_voigt() -> None:
    with pytest.raises(SolverError, match="eigenvalue"):
        require_bounds(cubic(0.1, 0.1, 0.05), 0.5, 0.3)
    odd = solid_stiffness(0.3) * 0.1
    odd[0, 4] += 0.01
    with pytest.raises(SolverError, match="not symmetric"):
        require_bounds(odd, 0.5, 0.3)
    with pytest.raises(SolverError, match="Voigt"):
        require_bounds(0.31 * solid_stiffness(0.3), 0.3, 0.3)
