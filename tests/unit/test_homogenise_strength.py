"""Macroscopic directions and the percentile of the local stress."""

from __future__ import annotations

import numpy as np
import pytest

from gradedesign.mechanics.fe.stress import weighted_percentile
from gradedesign.mechanics.homogenise.macro_directions import (
    FROBENIUS,
    named_directions,
    spread_directions,
    von_mises_of,
)
from gradedesign.mechanics.homogenise.periodic import solve_periodic
from gradedesign.mechanics.homogenise.strength import (
    LocalStress,
    cell_strength,
    local_stress,
    stress_factors,
)


def test_named_directions_are_63_of_unit_von_mises() -> None:
    named = named_directions()
    everything = np.concatenate(list(named.values()), axis=1)
    assert everything.shape == (6, 63)
    np.testing.assert_allclose(von_mises_of(everything), 1.0)
    # No two are the same stress up to sign and hydrostatic part of equal size.
    gram = everything.T @ (FROBENIUS[:, None] * everything)
    norm = np.sqrt(np.diag(gram))
    cosine = np.abs(gram / norm[:, None] / norm) - np.eye(63)
    assert cosine.max() < 1 - 1e-9
    # Counted by hand: 13 axes for each uniaxial kind; planes {100}, {110}, {111} for shear.
    count = {name: stress.shape[1] for name, stress in named.items()}
    assert count["uniaxial 100"] == 3
    assert count["uniaxial 110"] == 6
    assert count["uniaxial 111"] == 4
    assert count["shear 111<110>"] == 12


def test_spread_directions_have_unit_norm_and_reach_hydrostatic() -> None:
    s = spread_directions(500, np.random.default_rng(8))
    np.testing.assert_allclose((FROBENIUS[:, None] * s**2).sum(axis=0), 1.0)
    mean = np.abs(s[:3].sum(axis=0)) / np.sqrt(3)
    assert (mean[:100] >= np.cos(np.radians(40)) - 1e-12).all()
    assert mean.max() > 0.98


def test_von_mises() -> None:
    # Uniaxial 2, pure shear 1 (sqrt 3) and pressure (0): textbook.
    s = np.array([[2.0, 0, 0, 0, 0, 0], [0, 0, 0, 1.0, 0, 0], [5.0, 5, 5, 0, 0, 0]]).T
    np.testing.assert_allclose(von_mises_of(s), [2.0, np.sqrt(3.0), 0.0], atol=1e-12)


def test_a_solid_cell_is_as_strong_as_its_material() -> None:
    strength = cell_strength(local_stress(solve_periodic(np.ones((4, 4, 4)))))
    assert strength.strength == pytest.approx(1.0, rel=1e-5)
    assert strength.hydrostatic == pytest.approx(0.0, abs=1e-5)
    assert set(strength.factor) == set(named_directions())


def test_a_laminate_shares_the_load() -> None:
    # Half stiff, half soft layers, stacked along x, nu 0 so that the layers do not interact:
    # pulled along y each carries its modulus' share; pulled along x each carries all. The stress
    # is that of the base material in a voxel, strain times E, so over-all stress / fill.
    fill = np.ones((4, 2, 2))
    fill[2:] = 0.25
    local = local_stress(solve_periodic(fill, poissons_ratio=0.0, rtol=1e-10))
    along = np.array([[0.0, 1.0, 0, 0, 0, 0]]).T
    assert stress_factors(local, along)[0] == pytest.approx(1 / 0.625, rel=1e-5)
    across = np.array([[1.0, 0, 0, 0, 0, 0]]).T
    assert stress_factors(local, across, 100.0)[0] == pytest.approx(4.0, rel=1e-5)


def test_mean_of_the_local_stress_is_the_macroscopic() -> None:
    # Hill's condition, per voxel: mean over the cell of fill times base stress.
    rng = np.random.default_rng(31)
    fill = rng.choice([1.0, 0.3], size=(6, 6, 6))
    local = local_stress(solve_periodic(fill, rtol=1e-9))
    mean = (local.stress * local.volume).sum(axis=2) / fill.size
    np.testing.assert_allclose(mean, np.eye(6), atol=1e-5)


@pytest.mark.parametrize("percentile", [50.0, 99.0, 99.5, 100.0])
def test_percentile_equals_sorting_everything(percentile) -> None:
    rng = np.random.default_rng(32)
    n = 3000
    stress = np.zeros((6, 6, n), dtype=np.float32)
    stress[0, 0] = rng.exponential(size=n)
    volume = rng.choice([1.0, 0.1, 1 / 27], size=n)
    local = LocalStress(stress=stress, volume=volume)
    found = stress_factors(local, np.eye(6)[:, :1], percentile)[0]
    assert found == pytest.approx(weighted_percentile(stress[0, 0], volume, percentile), rel=1e-6)
