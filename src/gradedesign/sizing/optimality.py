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

    mu = np.full(len(values), 1e-3)
    for _ in range(60):
        before = mu.copy()
        for j in range(len(mu)):
            mu[j] = _best_multiplier(j, mu, lambda m: approximate(primal(m)))
        if np.allclose(mu, before, rtol=1e-6, atol=1e-14):
            break
    return primal(mu), mu


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

    low, high = -45.0, 25.0
    if excess(low) <= 0:
        return 0.0
    if excess(high) > 0:
        # Out of reach within the move limits: the largest multiplier moves as far as it can.
        return float(np.exp(high))
    return float(np.exp(brentq(excess, low, high, xtol=1e-9)))
