"""Fit a strength surface to the local stress fields of a cell."""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from gradedesign.arrays import FloatArray
from gradedesign.errors import SolverError
from gradedesign.mechanics.homogenise.macro_directions import (
    FROBENIUS,
    named_directions,
    spread_directions,
    von_mises_of,
)
from gradedesign.mechanics.homogenise.strength import (
    PERCENTILE,
    LocalStress,
    sampled,
    stress_distribution,
    stress_factors,
)
from gradedesign.mechanics.material.strength_surface import StrengthSurface, symmetric_powers

#: Directions of the fit besides the named ones and hydrostatic, and unseen ones of the check.
#: Chosen, not measured.
_FIT_DIRECTIONS = 300
#: Enough unseen ones to find the largest error. Chosen, not measured.
_TEST_DIRECTIONS = 200
#: Points of the cell whose forms are offered to the fit, and the share half are drawn from. With 80
#: the largest unseen error of a primitive sheet is 10 instead of 4 or 5 %.
_CANDIDATES = 160
#: The most stressed tenth decides the high percentiles that limits judge. Chosen, not measured.
_STRESSED_SHARE = 0.1
#: Exponents that are tried: the larger, the nearer the surface is to the largest of its forms.
#: Chosen, not measured.
EXPONENTS = (4, 6, 8, 12)
#: Points of the cell over which percentiles are taken. Chosen, not measured.
POINTS = 40_000
#: Folds of the cross-validation that chooses the exponent. Chosen, not measured.
_FOLDS = 3
#: Percentages by volume at which the distribution of local stress is kept, and directions over
#: which it is averaged. It differs between directions by a fifth at 50 %, a twentieth at 98 %.
_DISTRIBUTION = (10.0, 25.0, 50.0, 70.0, 80.0, 90.0, 95.0, 98.0, 99.0, 99.5, 99.8, 99.95)
#: Enough for a mean over directions that differ by a fifth at most. Chosen, not measured.
_DISTRIBUTION_DIRECTIONS = 60

_MISES = np.array(
    [
        [1.0, -0.5, -0.5, 0, 0, 0],
        [-0.5, 1.0, -0.5, 0, 0, 0],
        [-0.5, -0.5, 1.0, 0, 0, 0],
        [0, 0, 0, 3.0, 0, 0],
        [0, 0, 0, 0, 3.0, 0],
        [0, 0, 0, 0, 0, 3.0],
    ]
)


def fit_surface(
    local: LocalStress,
    symmetry: str,
    rng: np.random.Generator,
    percentile: float = PERCENTILE,
) -> StrengthSurface:
    """Fit a surface over more than 300 macroscopic stresses and check it on 200 others.

    Raises `SolverError` if no surface is positive in every direction. Returns StrengthSurface: with
    its errors over the unseen directions.

    ``symmetry``: of the cell: ``cubic``, ``tetragonal``, ``orthotropic`` or ``none``. ``rng``:
    numpy.random.Generator; draws directions and candidate points. ``percentile``: by volume, of the
    local von Mises stress.

    Notes
    -----
    Weights by non-negative least squares on ``s^m`` relative to the data; the exponent by
    three-fold cross-validation of the root mean square error of ``s``. A quadratic form misses
    the same data by 10 to 30 %.
    """
    local = sampled(local, POINTS, rng)
    named = np.concatenate(
        [*named_directions().values(), np.array([[1.0, 1, 1, 0, 0, 0]]).T], axis=1
    )
    named = named / np.sqrt((FROBENIUS[:, None] * named**2).sum(axis=0))
    seen = np.concatenate([named, spread_directions(_FIT_DIRECTIONS, rng)], axis=1)
    unseen = spread_directions(_TEST_DIRECTIONS, rng)
    target = stress_factors(local, seen, percentile)
    forms = _candidates(local, target.mean(), rng)
    fold = rng.permutation(seen.shape[1]) % _FOLDS
    best, exponent = np.inf, EXPONENTS[0]
    for m in EXPONENTS:
        terms = symmetric_powers(forms, seen, m, symmetry)
        error = np.zeros(seen.shape[1])
        for k in range(_FOLDS):
            weights = _weights(terms[:, fold != k], target[fold != k], m)
            error[fold == k] = _error(weights, terms[:, fold == k], target[fold == k], m)
        spread = float(np.sqrt(np.mean(error**2)))
        if spread < best:
            best, exponent = spread, m
    terms = symmetric_powers(forms, seen, exponent, symmetry)
    weights = _weights(terms, target, exponent)
    used = weights > 0
    if not used.any():
        raise SolverError("no strength surface fits the local stress: all weights are zero")
    check = symmetric_powers(forms[used], unseen, exponent, symmetry)
    truth = stress_factors(local, unseen, percentile)
    error = _error(weights[used], check, truth, exponent)
    return StrengthSurface(
        exponent=exponent,
        weights=weights[used],
        forms=forms[used],
        symmetry=symmetry,
        max_error=float(np.abs(error).max()),
        rms_error=float(np.sqrt(np.mean(error**2))),
        unsafe_error=float(max(-error.min(), 0.0)),
        percentile=percentile,
        distribution=_distribution(local, unseen[:, :_DISTRIBUTION_DIRECTIONS], percentile),
    )


def _distribution(local: LocalStress, macro: FloatArray, percentile: float) -> FloatArray:
    """Percentages and relative local stresses ``(2, t)``; stresses that do not rise are left out.

    A uniform stress, as in a solid, has no distribution to speak of.
    """
    percent = np.array(_DISTRIBUTION)
    share = stress_distribution(local, macro, percent, percentile)
    rising = (np.diff(share, prepend=0.0) > 1e-6) & (share > 0)
    return np.stack([percent[rising], share[rising]])


def _candidates(local: LocalStress, scale: float, rng: np.random.Generator) -> FloatArray:
    """Von Mises forms ``(k, 6, 6)`` of points that are highly stressed.

    Half of them over all macroscopic stresses, half under one at a time: near hydrostatic, thin
    walls are stressed elsewhere than under shear.
    """
    stress = local.stress.astype(np.float64)
    # Mean square over all macroscopic stresses of unit Frobenius norm.
    size = np.einsum("aji,ab,bji,j->i", stress, _MISES, stress, 1 / FROBENIUS, optimize=True)
    count = min(_CANDIDATES // 2, size.size)
    pool = np.argpartition(size, -max(count, int(_STRESSED_SHARE * size.size)))
    chosen = set(rng.choice(pool[-max(count, int(_STRESSED_SHARE * size.size)) :], count).tolist())
    top = max(size.size // 100, 1)
    for direction in spread_directions(_CANDIDATES // 2, rng).T:
        value = von_mises_of(np.matmul(direction, stress))
        chosen.add(int(rng.choice(np.argpartition(value, -top)[-top:])))
    points = stress[:, :, sorted(chosen)]
    forms = np.einsum("ack,ab,bdk->kcd", points, _MISES, points, optimize=True)
    # In units of the typical stress, so that high powers stay within range.
    trace = np.einsum("kcc->k", forms)
    return np.asarray(forms * (scale**2 / trace * 6)[:, None, None])


def _weights(terms: FloatArray, target: FloatArray, exponent: int) -> FloatArray:
    """Non-negative weights that bring ``sum w terms`` relatively closest to ``target^exponent``."""
    matrix = (terms / target**exponent).T
    size = np.linalg.norm(matrix, axis=0)
    solution, _ = nnls(matrix / size, np.ones(target.size))
    fitted = (matrix / size) @ solution
    if not (fitted > 0).all():
        return np.asarray(solution / size)
    # High powers make too much of stresses that are overestimated, so that the fit lies up to 1 %
    # low: right on the mean.
    return np.asarray(solution / size / np.mean(fitted ** (1 / exponent)) ** exponent)


def _error(weights: FloatArray, terms: FloatArray, target: FloatArray, exponent: int) -> FloatArray:
    """Relative error of the surface."""
    return np.asarray((weights @ terms) ** (1 / exponent) / target - 1)
