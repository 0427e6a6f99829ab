"""One step of the optimality criterion for minimum mass under several constraints.

Constraints are expanded convexly (CONLIN): reciprocal in powers of the variable where more
density helps, linear where it hurts. The dual problem has one variable per constraint.

References
----------
C. Fleury, V. Braibant, Int. J. Numer. Methods Eng. 23, 1986 (CONLIN).
M. P. Bendsoe, O. Sigmund, Topology Optimization, 2003, section 1.2 (optimality criteria).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from gradedesign.arrays import FloatArray

#: Range of multipliers; the largest stands for a constraint out of reach within the move limits.
_SMALLEST_LOG, _LARGEST = -45.0, float(np.exp(25.0))
#: Rounds of coordinates in turn at most, of Newton's steps after each, and of their halvings.
#: Chosen, not measured.
_SWEEPS, _NEWTON_STEPS, _HALVINGS = 60, 30, 8
#: Excess of a constraint over its limit that counts as none. Chosen, not measured.
_EXACT = 1e-10


def optimality_step(
    x: FloatArray,
    cost: FloatArray,
    values: FloatArray,
    gradients: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    *,
    exponent: float = 1.5,
) -> tuple[FloatArray, FloatArray]:
    """Minimise ``cost . x`` under approximated constraints ``value <= 1``.

    Parameters
    ----------
    x : (n,) array
        Present variables, positive.
    cost : (n,) array
        Positive mass per variable.
    values : (k,) array
        Constraint values divided by their limits.
    gradients : (k, n) array
        Their derivatives.
    lower, upper : (n,) array
        Bounds with move limits applied.
    exponent : float
        Power of the reciprocal expansion, the local exponent of stiffness in density.

    Returns
    -------
    x : (n,) array
        New variables.
    multipliers : (k,) array
    """
    helping = np.where(gradients < 0, -gradients * x / exponent, 0.0)
    hurting = np.where(gradients > 0, gradients, 0.0)
    unit = cost / (cost @ x)

    def primal(mu: FloatArray) -> FloatArray:
        price = unit + mu @ hurting
        gain = exponent * (mu @ helping) / x
        return np.clip(x * (gain / price) ** (1.0 / (1.0 + exponent)), lower, upper)

    def approximate(new: FloatArray) -> FloatArray:
        return values + helping @ ((x / new) ** exponent - 1.0) + hurting @ (new - x)

    def slopes(new: FloatArray, mu: FloatArray) -> FloatArray:
        free = (new > lower) & (new < upper)
        at, start = new[free], x[free]
        by_x = hurting[:, free] - exponent * helping[:, free] * (start / at) ** exponent / at
        give = at / ((1.0 + exponent) * (unit[free] + mu @ hurting[:, free]))
        return np.asarray(-(by_x * give) @ by_x.T)

    mu = np.full(len(values), 1e-3)
    for _ in range(_SWEEPS):
        before = mu.copy()
        for j in range(len(mu)):
            mu[j] = _best_multiplier(j, mu, lambda m: approximate(primal(m)))
        mu, ended = _newton(mu, primal, approximate, slopes, unit)
        if ended or np.allclose(mu, before, rtol=1e-6, atol=1e-14):
            break
    return primal(mu), mu


def _newton(
    mu: FloatArray,
    primal: Callable[[FloatArray], FloatArray],
    constraints: Callable[[FloatArray], FloatArray],
    slopes: Callable[[FloatArray, FloatArray], FloatArray],
    unit: FloatArray,
) -> tuple[FloatArray, bool]:
    """Maximise the dual by Newton's method over the multipliers that one at a time made positive.

    Coordinates in turn creep where two constraints have nearly parallel gradients. The better
    multipliers, and whether they solve the dual problem.
    """
    active = (mu > 0.0) & (mu < _LARGEST)
    new = primal(mu)
    excess = constraints(new) - 1.0
    for _ in range(_NEWTON_STEPS):
        if np.abs(excess[active]).max(initial=0.0) <= _EXACT:
            return mu, bool((excess[mu == 0.0] <= _EXACT).all())
        curvature = slopes(new, mu)[np.ix_(active, active)]
        step = np.linalg.lstsq(curvature, -excess[active], rcond=None)[0]
        # At most nine tenths of the way to a multiplier of zero.
        step *= min(1.0, 0.9 / (-step / mu[active]).max(initial=0.9))
        value, gain = unit @ new + mu[active] @ excess[active], step @ excess[active]
        for _ in range(_HALVINGS):
            trial = mu.copy()
            trial[active] += step
            x = primal(trial)
            trial_excess = constraints(x) - 1.0
            if (
                unit @ x + trial[active] @ trial_excess[active]
                >= value + 1e-4 * gain - _EXACT * value
            ):
                break
            step, gain = 0.5 * step, 0.5 * gain
        else:
            return mu, False
        mu, new, excess = trial, x, trial_excess
    return mu, False


def _best_multiplier(
    j: int, mu: FloatArray, constraints: Callable[[FloatArray], FloatArray]
) -> float:
    """Multiplier j that makes its constraint just hold, by bisection of its logarithm.

    The dual is concave, so taking its coordinates in turn leads to its maximum.
    """

    def excess(log_mu: float) -> float:
        trial = mu.copy()
        trial[j] = np.exp(log_mu)
        return float(constraints(trial)[j]) - 1.0

    low, high = _SMALLEST_LOG, np.log(_LARGEST)
    if excess(low) <= 0:
        return 0.0
    if excess(high) > 0:
        # Out of reach within the move limits: the largest multiplier moves as far as it can.
        return _LARGEST
    return float(np.exp(brentq(excess, low, high, xtol=1e-9)))
