"""Derivatives of the volume percentile of local stress against central differences."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.local_stress import StressLimit
from gradedesign.mechanics.material.law_field import LawField
from gradedesign.mechanics.material.local_stress_law import LocalStressLaw
from gradedesign.mechanics.material.strength_surface import StrengthSurface
from gradedesign.mechanics.sizing.effective_density import EffectiveDensity
from gradedesign.mechanics.sizing.homogenised_model import bond_matrix
from tests.verification.test_sensitivities import LAW, _problem, assert_slope

#: Percentages of a cell's solid, and the local stress there over that of the percentile.
SPREAD = np.array([[20.0, 60.0, 90.0, 99.5], [0.15, 0.4, 0.7, 1.0]])


def surface(rng, scale, symmetry):
    """A norm of stress from random forms, the larger the thinner the cell."""
    roots = rng.normal(size=(3, 6, 6))
    forms = scale**2 * (roots @ roots.transpose(0, 2, 1) + 2.0 * np.eye(6))
    return StrengthSurface(
        exponent=8, weights=rng.uniform(0.5, 1.0, 3), forms=forms, symmetry=symmetry,
        max_error=0.0, rms_error=0.0, unsafe_error=0.0, percentile=99.5,
        distribution=SPREAD * [[1.0], [rng.uniform(0.95, 1.0)]],
    )  # fmt: skip


def stressed_law(rng, symmetry="orthotropic"):
    rho = np.array([0.05, 0.2, 0.4, 0.6, 0.9])
    surfaces = tuple(surface(rng, 1.0 / r, symmetry) for r in rho)
    return replace(LAW, local_stress=LocalStressLaw(density=rho, surfaces=surfaces))


def stress_problem(law=None, temperature=0.0, percentile=99.0):
    model, _, rho, rng = _problem((0.0, 0.0, -2e4), temperature, None, 0.4)
    if law is not None:
        model = replace(model, law=LawField(laws=(law(rng),)))
    limit = StressLimit(
        key=LimitKey(kind="stress", region="lattice"), name="stress", allowed=1.0, factor=1.2,
        percentile=percentile, evaluated=rng.uniform(size=rho.size) < 0.8,
    )  # fmt: skip
    return model, limit, rho, rng


@pytest.mark.parametrize("percentile", [60.0, 99.0])
@pytest.mark.parametrize("temperature", [0.0, 80.0], ids=["force", "thermal"])
def test_percentile_of_a_law_of_von_mises_stress(temperature, percentile):
    model, limit, rho, rng = stress_problem(None, temperature, percentile)
    assert_slope(model, limit, rho, rng)


@pytest.mark.parametrize("percentile", [60.0, 99.0])
@pytest.mark.parametrize("symmetry", ["cubic", "none"])
def test_percentile_of_strength_surfaces(symmetry, percentile):
    model, limit, rho, rng = stress_problem(
        lambda rng: stressed_law(rng, symmetry), 80.0, percentile
    )
    assert_slope(model, limit, rho, rng)


@pytest.mark.parametrize("everywhere", [False, True], ids=["one axis", "at every point"])
def test_percentile_where_cells_are_turned(everywhere):
    model, limit, rho, rng = stress_problem(stressed_law)
    turns = Rotation.random(4 * rho.size if everywhere else 1, rng=rng).as_matrix()
    axes = turns.transpose(1, 2, 0).reshape(3, 3, 4, -1) if everywhere else turns[0]
    assert_slope(replace(model, rotation=bond_matrix(axes)), limit, rho, rng)


def test_percentile_of_trimmed_cells():
    model, limit, rho, rng = stress_problem(stressed_law)
    asked = np.array([0.1, 0.3, 0.6])
    held = asked[:, None] ** rng.uniform(0.5, 1.1, rho.size) * rng.uniform(0.6, 1.5, rho.size)
    model = replace(model, effective=EffectiveDensity(nominal=asked, effective=held))
    rho = np.where(np.abs(rho - 0.3) < 0.01, 0.32, rho)
    # A short step: the few percentages of the distribution make kinks.
    assert_slope(model, limit, rho, rng, step=1e-5)


def test_percentile_of_a_mix():
    model, limit, rho, rng = stress_problem(stressed_law)
    laws = (*model.law.laws, replace(stressed_law(rng), name="other"), replace(LAW, name="third"))
    weights = rng.uniform(size=(3, rho.size))
    field = LawField(
        laws=laws, weights=weights / weights.sum(axis=0),
        stiffness_factor=rng.uniform(0.7, 1.0, rho.size),
        strength_factor=rng.uniform(0.7, 1.0, rho.size),
    )  # fmt: skip
    assert_slope(replace(model, law=field), limit, rho, rng, step=1e-5)
