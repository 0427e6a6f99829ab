"""Strength surfaces: form, symmetry and the fit."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gradedesign.errors import PluginError
from gradedesign.mechanics.homogenise.fit_surface import fit_surface
from gradedesign.mechanics.homogenise.macro_directions import spread_directions, von_mises_of
from gradedesign.mechanics.homogenise.strength import LocalStress, sampled, stress_factors
from gradedesign.mechanics.material.strength_surface import StrengthSurface, symmetric_powers

MISES = np.diag([1.0, 1.0, 1.0, 3.0, 3.0, 3.0])
MISES[:3, :3] += -0.5 * (1 - np.eye(3))


def surface(forms, weights, exponent=4, symmetry="cubic"):
    return StrengthSurface(
        exponent=exponent,
        weights=weights,
        forms=forms,
        symmetry=symmetry,
        max_error=0.0,
        rms_error=0.0,
        unsafe_error=0.0,
        percentile=99.5,
    )


@pytest.mark.parametrize("exponent", [2, 4, 12])
@pytest.mark.parametrize("symmetry", ["cubic", "tetragonal", "orthotropic", "none"])
def test_von_mises_is_its_own_surface(exponent, symmetry) -> None:
    stress = spread_directions(20, np.random.default_rng(6))
    one = surface(MISES[None], np.ones(1), exponent, symmetry)
    np.testing.assert_allclose(one.local_stress(stress), von_mises_of(stress), atol=1e-7)


@pytest.mark.parametrize("exponent", [2, 6, 12])
def test_compiled_powers_equal_turned_stresses(exponent) -> None:
    # Turning stresses by the 24 rotations of the cube, one after the other, with 4-index tensors.
    rng = np.random.default_rng(61)
    factor = rng.normal(size=(3, 2, 6))
    forms = np.einsum("kai,kaj->kij", factor, factor)
    stress = rng.normal(size=(6, 130))
    rows, columns = (0, 1, 2, 1, 0, 0), (0, 1, 2, 2, 2, 1)
    tensor = np.zeros((3, 3, 130))
    tensor[rows, columns] = tensor[columns, rows] = stress
    expected = np.zeros((3, 130))
    for turn in Rotation.create_group("O").as_matrix():
        turned = np.einsum("ia,jb,abn->ijn", turn, turn, tensor)[rows, columns]
        expected += np.einsum("in,kij,jn->kn", turned, forms, turned) ** (exponent // 2) / 24
    found = symmetric_powers(forms, stress, exponent, "cubic")
    np.testing.assert_allclose(found, expected, rtol=1e-12)


# Orders of the proper rotation groups 432, 422, 222 and 1: textbook. A form that sees sigma_xx
# only is averaged over the axes that the group exchanges.
@pytest.mark.parametrize(
    ("symmetry", "mean"), [("cubic", 1 / 3), ("tetragonal", 1 / 2), ("orthotropic", 1.0)]
)
def test_symmetry_exchanges_axes(symmetry, mean) -> None:
    form = np.zeros((1, 6, 6))
    form[0, 0, 0] = 1.0
    uniaxial = np.eye(6)[:, :1]
    assert symmetric_powers(form, uniaxial, 4, symmetry)[0, 0] == pytest.approx(mean)


def test_surface_is_of_degree_one_and_convex() -> None:
    rng = np.random.default_rng(14)
    a = rng.standard_normal((5, 6, 6))
    s = surface(a @ a.transpose(0, 2, 1), rng.uniform(size=5), 8)
    x, y = rng.standard_normal((2, 6, 50))
    np.testing.assert_allclose(s.local_stress(-3.0 * x), 3.0 * s.local_stress(x))
    half = s.local_stress(0.5 * (x + y))
    assert (half <= 0.5 * (s.local_stress(x) + s.local_stress(y)) + 1e-12).all()
    assert s.local_stress(x.reshape(6, 5, 10)).shape == (5, 10)


def cubic_copies(operators: np.ndarray) -> np.ndarray:
    """Local stress operators of a few points and their images under the cube's rotations."""
    from gradedesign.mechanics.material.strength_surface import _stress_turns

    return np.concatenate([operators @ t for t in _stress_turns("cubic")], axis=0)


def test_fit_holds_over_unseen_directions() -> None:
    # A made-up cell of 40 points and their images, as a percentile of a smooth crowd.
    rng = np.random.default_rng(15)
    base = np.eye(6) * 5 + rng.standard_normal((40, 6, 6))
    crowd = np.concatenate([cubic_copies(base * f) for f in np.linspace(0.2, 1.0, 12)])
    local = LocalStress(
        stress=crowd.transpose(1, 2, 0).astype(np.float32), volume=np.ones(crowd.shape[0])
    )
    fitted = fit_surface(local, "cubic", np.random.default_rng(16))
    # The bar of the study for real cells: 10 % at most, 3 % root mean square.
    assert fitted.max_error < 0.10
    assert fitted.rms_error < 0.03
    assert fitted.unsafe_error <= fitted.max_error
    assert fitted.exponent in (4, 6, 8, 12)
    directions = spread_directions(500, np.random.default_rng(17))
    assert (fitted.local_stress(directions) > 0).all()
    again = fit_surface(local, "cubic", np.random.default_rng(16))
    np.testing.assert_array_equal(again.weights, fitted.weights)


def test_sampling_draws_by_volume() -> None:
    stress = np.zeros((6, 6, 1000), dtype=np.float32)
    stress[0, 0, :500] = 1.0
    local = LocalStress(stress=stress, volume=np.repeat([0.9, 0.1], 500))
    few = sampled(local, 200, np.random.default_rng(18))
    assert few.stress.shape == (6, 6, 200)
    assert 0.8 < few.stress[0, 0].mean() < 1.0
    assert sampled(local, 2000, np.random.default_rng(18)) is local


def test_sampling_keeps_percentiles_of_partly_filled_voxels() -> None:
    # Stress highest where voxels are least filled, as on the surface of struts; oracle: all voxels.
    rng = np.random.default_rng(19)
    volume = rng.uniform(0.04, 1.0, 5000)
    stress = np.zeros((6, 6, 5000), dtype=np.float32)
    stress[0, 0] = 2.0 - volume
    local = LocalStress(stress=stress, volume=volume)
    uniaxial = np.eye(6)[:, :1]
    for count in (4500, 2000):
        few = sampled(local, count, np.random.default_rng(20))
        for percentile in (50.0, 90.0, 99.5):
            truth = stress_factors(local, uniaxial, percentile)[0]
            found = stress_factors(few, uniaxial, percentile)[0]
            # Three deviations of a share counted in so many points; the volume filled less than v
            # is nearly v^2 of all, so a share p lies at v = sqrt(p).
            p = 1 - percentile / 100
            assert found == pytest.approx(truth, abs=3 * np.sqrt((1 - p) / count) / 2)


def test_distribution_of_a_fit_runs_through_its_percentile() -> None:
    rng = np.random.default_rng(21)
    operator = np.eye(6)
    operator[3, :3] = 1.0
    stress = operator[:, :, None] * rng.uniform(0.2, 3.0, 3000) ** 2
    local = LocalStress(stress=stress.astype(np.float32), volume=np.ones(3000))
    percent, share = fit_surface(local, "cubic", np.random.default_rng(22)).distribution
    assert np.interp(99.5, percent, share) == pytest.approx(1.0)
    # All components grow together, as the square of a uniform number between 0.2 and 3.
    truth = ((0.2 + 2.8 * percent / 100) / (0.2 + 2.8 * 0.995)) ** 2
    np.testing.assert_allclose(share, truth, rtol=0.05)


def test_impossible_surfaces_are_refused() -> None:
    with pytest.raises(ValueError, match="even exponent"):
        surface(MISES[None], np.ones(1), 3)
    with pytest.raises(ValueError, match="weights of 0 or more"):
        surface(MISES[None], -np.ones(1))
    with pytest.raises(PluginError, match="symmetry 'square'"):
        surface(MISES[None], np.ones(1), 4, "square").local_stress(np.ones(6))
