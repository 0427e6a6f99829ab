"""Spinodoids; expected numbers are those of Gaussian random fields."""

from itertools import product
from math import factorial

import numpy as np
import pytest
from scipy.special import eval_hermitenorm
from scipy.stats import norm

from gradedesign import CaseError
from gradedesign_cells_stochastic.random_field import random_field, wave_phases, wave_vectors
from gradedesign_cells_stochastic.spinodoid import CONES, PERIOD, spinodoid, spinodoid_sheet

every_kind = pytest.mark.parametrize("kind", CONES)
LEVELS = np.array([-1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5])
SEEDS = [float(s) for s in range(100, 110)]
NODES = 48


def nodes(count=NODES):
    axis = PERIOD * np.arange(count) / count
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"))


def sampling_error(waves):
    """Standard deviation of the share below a level in one window.

    The indicator's covariance at correlation r is the sum over n of (phi(t) He_{n-1}(t))^2 r^n / n!
    (Mehler); averaged over the window. n = 1 vanishes because the mean is 0, n = 2 because all
    waves have one amplitude, so that the variance is 1 in every window.
    """
    spectrum = np.zeros((NODES, NODES, NODES))
    spectrum[tuple(waves.T)] = NODES**3 / len(waves)
    r = np.fft.ifftn(spectrum).real
    terms = [
        (norm.pdf(LEVELS) * eval_hermitenorm(n - 1, LEVELS)) ** 2 / factorial(n) * np.mean(r**n)
        for n in range(3, 12)
    ]
    return np.sqrt(np.sum(terms, axis=0))


@pytest.mark.parametrize("kind", ["isotropic", "columnar", "cubic"])
def test_density_is_the_normal_distribution_at_the_level(kind):
    error = sampling_error(wave_vectors(PERIOD, CONES[kind]))
    assert error.max() < 0.004
    deviation = []
    for seed in SEEDS:
        value = random_field(seed, PERIOD, CONES[kind])(nodes())
        deviation.append(np.mean(value[..., None] <= LEVELS, axis=(0, 1, 2)) - norm.cdf(LEVELS))
    assert (np.abs(deviation) < 4 * error + 3e-4).all()
    # Neither much less: the error is that of these fields.
    ratio = np.sqrt(np.mean(np.square(deviation), axis=0)) / error
    assert 0.5 < np.median(ratio) < 1.6


@every_kind
def test_mean_is_nought_and_variance_one(kind):
    value = random_field(100.0, PERIOD, CONES[kind])(nodes())
    # The table rounds coefficients to single precision.
    assert value.mean() == pytest.approx(0, abs=1e-6)
    assert value.var() == pytest.approx(1, abs=1e-5)


@every_kind
def test_field_is_the_sum_of_its_waves(kind):
    waves = wave_vectors(PERIOD, CONES[kind])
    phase = wave_phases(100.0, len(waves))
    u = np.random.default_rng(306).uniform(-7, 13, (3, 2000))
    direct = np.cos(2 * np.pi / PERIOD * waves @ u + phase[:, None]).sum(axis=0)
    direct *= (2 / len(waves)) ** 0.5
    found = random_field(100.0, PERIOD, CONES[kind])(u)
    np.testing.assert_allclose(found, direct, atol=3e-4)
    assert np.sqrt(np.mean((found - direct) ** 2)) < 6e-5


@every_kind
def test_waves_run_in_their_cones_and_are_a_cell_long(kind):
    cones = np.radians(CONES[kind])
    expected = set()
    for m in product(range(-7, 8), repeat=3):
        length = np.linalg.norm(m)
        if not 5.5 <= length <= 6.5:
            continue
        angle = np.arccos(np.minimum(np.abs(m) / length, 1))
        if any(a <= c + 1e-9 for a, c in zip(angle, cones, strict=True) if c > 0):
            expected.add(m)
    found = [tuple(int(i) for i in m) for m in wave_vectors(PERIOD, CONES[kind])]
    opposite = [tuple(-i for i in m) for m in found]
    assert len(set(found)) == len(found)
    assert not set(found) & set(opposite)
    assert set(found) | set(opposite) == expected


@pytest.mark.parametrize("kind", ["isotropic", "lamellar", "columnar"])
def test_surfaces_are_crossed_as_often_as_rice_says(kind):
    # A line along an axis crosses level t sqrt(<k^2>) exp(-t^2 / 2) / pi times per unit length,
    # with <k^2> the mean square of the waves' component (Rice 1945); columns along z, layers
    # across z.
    waves = wave_vectors(PERIOD, CONES[kind])
    wavenumber = 2 * np.pi * np.sqrt(np.mean(waves**2.0, axis=0)) / PERIOD
    value = np.stack([random_field(s, PERIOD, CONES[kind])(nodes(72)) for s in SEEDS[:3]])
    for axis in range(3):
        for level in (0.0, 0.7):
            turns = (value <= level) != (np.roll(value, -1, axis=1 + axis) <= level)
            found = np.mean(turns) * 72 / PERIOD
            expected = wavenumber[axis] * np.exp(-0.5 * level**2) / np.pi
            assert found == pytest.approx(expected, rel=0.05)


def test_sheet_is_the_magnitude():
    u = nodes(8)
    np.testing.assert_array_equal(
        spinodoid_sheet(u, seed=101.0, angle_x=0.0, angle_y=20.0),
        np.abs(spinodoid(u, seed=101.0, angle_x=0.0, angle_y=20.0)),
    )


@pytest.mark.parametrize("angle", [10.0, -30.0, 91.0, np.nan])
def test_impossible_cones_are_refused(angle):
    with pytest.raises(CaseError, match="expected 0 for none or 15 to 90"):
        spinodoid(np.zeros((3, 2)), angle_y=angle)


def test_a_field_without_waves_is_refused():
    with pytest.raises(CaseError, match="open one at least"):
        spinodoid(np.zeros((3, 2)), angle_x=0.0, angle_y=0.0, angle_z=0.0)
