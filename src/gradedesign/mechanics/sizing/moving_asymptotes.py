"""One step of the method of moving asymptotes: least objective under several constraints.

Constraints are replaced by convex separable functions of ``1 / (U - x)`` and ``1 / (x - L)``, whose
asymptotes L and U draw together where a variable swings and apart where it goes on in one
direction. The objective is a mass, which is all but linear, and stays so. The subproblem is solved
by Newton's method on its optimality conditions, with a barrier that is lowered to nothing.

References
----------
K. Svanberg, Int. J. Numer. Methods Eng. 24, 1987 (the method).
K. Svanberg, SIAM J. Optim. 12, 2002 (its conservative form, which converges from anywhere).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray

#: Distance of the first asymptotes, over the range of a variable, and how it grows while steps keep
#: their direction and shrinks where they turn: Svanberg 1987, section 4, with his usual values.
_FIRST, _BOLDER, _CALMER = 0.5, 1.2, 0.7
#: Least and greatest distance of an asymptote, over the range of its variable (Svanberg 2002).
_LEAST, _MOST = 0.01, 10.0
#: Share of the way to an asymptote that a step may go (Svanberg 2002, equation 5.3).
_WAY = 0.9
#: Share of a derivative that its opposite term has too, which makes every term strictly convex
#: (Svanberg 2002, equation 5.4).
_CONVEX = 1e-3
#: Price of breaking a constraint of the subproblem by one: far above any multiplier that a mass of
#: order 1 and logarithms of utilisations have, so that it is paid only where no step can do.
_PENALTY = 1e4
#: Barrier at which the subproblem counts as solved, in the units of objective and constraints.
_SOLVED = 1e-9
#: Newton's steps for one barrier, and halvings of one step, at most. Chosen, not measured.
_NEWTON_STEPS, _HALVINGS = 60, 40


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Asymptotes:
    """Distances of the asymptotes of every variable, with the last two steps.

    Attributes
    ----------
    distance : (n,) array
        Of both asymptotes from the variable.
    before : (n,) array
        Variables of the design before the present one.
    step : (n,) array
        Step that led to those; zero at first.
    """

    distance: FloatArray
    before: FloatArray
    step: FloatArray


def first_asymptotes(x: FloatArray, lower: FloatArray, upper: FloatArray) -> Asymptotes:
    """Asymptotes of a first design ``(n,)`` between its bounds."""
    return Asymptotes(distance=_FIRST * (upper - lower), before=x, step=np.zeros_like(x))


def moved_asymptotes(
    asymptotes: Asymptotes, x: FloatArray, lower: FloatArray, upper: FloatArray
) -> Asymptotes:
    """Asymptotes of the next design: nearer to variables that turned round."""
    step = x - asymptotes.before
    turned = step * asymptotes.step
    factor = np.where(turned < 0, _CALMER, np.where(turned > 0, _BOLDER, 1.0))
    extent = upper - lower
    distance = np.clip(factor * asymptotes.distance, _LEAST * extent, _MOST * extent)
    return Asymptotes(distance=distance, before=x, step=step)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Subproblem:
    """Least ``cost . x`` where ``sum p / (U - x) + q / (x - L)`` is within limits.

    ``limits`` are those of the constraints' sums, so that they hold their values at the present
    design; ``lower`` and ``upper`` bound the step.
    """

    cost: FloatArray
    p: FloatArray
    q: FloatArray
    left: FloatArray
    right: FloatArray
    limits: FloatArray
    lower: FloatArray
    upper: FloatArray


def asymptotes_step(
    x: FloatArray,
    cost: FloatArray,
    values: FloatArray,
    gradients: FloatArray,
    bounds: tuple[FloatArray, FloatArray],
    asymptotes: Asymptotes,
    *,
    move: float = 0.5,
    conservatism: float = 1e-5,
) -> tuple[FloatArray, FloatArray]:
    """Minimise ``cost . x`` under approximated constraints ``value <= 0``.

    Parameters
    ----------
    x : (n,) array
        Present variables.
    cost : (n,) array
        Of the variables; their sum should be of order 1.
    values : (k,) array
        Of the constraints, of order 1 where they are broken.
    gradients : (k, n) array
        Their derivatives.
    bounds : pair of (n,) arrays
        Of the variables, the lower below the upper.
    asymptotes : Asymptotes
    move : float
        Largest step over the range of a variable.
    conservatism : float
        Curvature that constraints have at least, relative to their range: larger where a step was
        too bold (Svanberg 2002, section 5).

    Returns
    -------
    x : (n,) array
        New variables.
    multipliers : (k,) array
    """
    low, high = bounds
    extent = high - low
    left, right = x - asymptotes.distance, x + asymptotes.distance
    up, down = np.maximum(gradients, 0.0), np.maximum(-gradients, 0.0)
    floor = conservatism / extent
    p = (right - x) ** 2 * ((1 + _CONVEX) * up + _CONVEX * down + floor)
    q = (x - left) ** 2 * (_CONVEX * up + (1 + _CONVEX) * down + floor)
    held = p @ (1 / (right - x)) + q @ (1 / (x - left))
    near = _WAY * asymptotes.distance
    return _solved(
        _Subproblem(
            cost=cost,
            p=p,
            q=q,
            left=left,
            right=right,
            limits=held - values,
            lower=np.maximum(low, x - np.minimum(near, move * extent)),
            upper=np.minimum(high, x + np.minimum(near, move * extent)),
        )
    )


@dataclass(slots=True, kw_only=True, eq=False)
class _Point:
    """Primal and dual variables of a subproblem, and their steps: all but x are positive."""

    x: FloatArray
    excess: FloatArray
    multiplier: FloatArray
    at_lower: FloatArray
    at_upper: FloatArray
    on_excess: FloatArray
    slack: FloatArray

    def along(self, step: _Point, share: float) -> _Point:
        """The point some share of a step farther."""
        return _Point(**{k: getattr(self, k) + share * getattr(step, k) for k in self.__slots__})


def _solved(problem: _Subproblem) -> tuple[FloatArray, FloatArray]:
    """Solution and multipliers of a subproblem, by Newton's method with a falling barrier."""
    count = len(problem.limits)
    x = 0.5 * (problem.lower + problem.upper)
    one = np.ones(count)
    point = _Point(
        x=x,
        excess=one.copy(),
        multiplier=one.copy(),
        at_lower=np.maximum(1.0, 1.0 / (x - problem.lower)),
        at_upper=np.maximum(1.0, 1.0 / (problem.upper - x)),
        on_excess=np.maximum(1.0, 0.5 * _PENALTY * one),
        slack=one.copy(),
    )
    barrier = 1.0
    while True:
        residual = _residual(problem, point, barrier)
        for _ in range(_NEWTON_STEPS):
            if np.abs(residual).max() < 0.9 * barrier:
                break
            step = _newton_step(problem, point, barrier)
            share = _room(problem, point, step)
            for _ in range(_HALVINGS):
                trial = point.along(step, share)
                new = _residual(problem, trial, barrier)
                if new @ new < residual @ residual:
                    break
                share *= 0.5
            else:
                return point.x, point.multiplier
            point, residual = trial, new
        if barrier <= _SOLVED:
            return point.x, point.multiplier
        barrier *= 0.1


def _sums(problem: _Subproblem, point: _Point) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Constraints' sums ``(k,)``, and terms p and q of the Lagrangian ``(n,)``."""
    over, under = 1 / (problem.right - point.x), 1 / (point.x - problem.left)
    sums = problem.p @ over + problem.q @ under
    return sums, point.multiplier @ problem.p, point.multiplier @ problem.q


def _residual(problem: _Subproblem, point: _Point, barrier: float) -> FloatArray:
    """Optimality conditions that do not hold yet, complementarity up to the barrier."""
    sums, p, q = _sums(problem, point)
    over, under = problem.right - point.x, point.x - problem.left
    slope = problem.cost + p / over**2 - q / under**2
    return np.concatenate(
        [
            slope - point.at_lower + point.at_upper,
            _PENALTY + point.excess - point.on_excess - point.multiplier,
            sums - point.excess + point.slack - problem.limits,
            point.at_lower * (point.x - problem.lower) - barrier,
            point.at_upper * (problem.upper - point.x) - barrier,
            point.on_excess * point.excess - barrier,
            point.multiplier * point.slack - barrier,
        ]
    )


def _newton_step(problem: _Subproblem, point: _Point, barrier: float) -> _Point:
    """Newton's step, reduced to one system with a row for every constraint."""
    sums, p, q = _sums(problem, point)
    over, under = problem.right - point.x, point.x - problem.left
    to_lower, to_upper = point.x - problem.lower, problem.upper - point.x
    jacobian = problem.p / over**2 - problem.q / under**2
    slope = problem.cost + p / over**2 - q / under**2 - barrier / to_lower + barrier / to_upper
    curve = 2 * p / over**3 + 2 * q / under**3
    curve += point.at_lower / to_lower + point.at_upper / to_upper
    by_excess = _PENALTY + point.excess - point.multiplier - barrier / point.excess
    excess_curve = 1.0 + point.on_excess / point.excess
    missing = sums - point.excess - problem.limits + barrier / point.multiplier
    matrix = np.diag(point.slack / point.multiplier + 1 / excess_curve)
    matrix += (jacobian / curve) @ jacobian.T
    right = missing + by_excess / excess_curve - jacobian @ (slope / curve)
    multiplier = np.linalg.solve(matrix, right)
    x = -(slope + multiplier @ jacobian) / curve
    excess = (multiplier - by_excess) / excess_curve
    return _Point(
        x=x,
        excess=excess,
        multiplier=multiplier,
        at_lower=-point.at_lower + (barrier - point.at_lower * x) / to_lower,
        at_upper=-point.at_upper + (barrier + point.at_upper * x) / to_upper,
        on_excess=-point.on_excess + (barrier - point.on_excess * excess) / point.excess,
        slack=-point.slack + (barrier - point.slack * multiplier) / point.multiplier,
    )


def _room(problem: _Subproblem, point: _Point, step: _Point) -> float:
    """Share of a step, at most 1, that keeps everything positive that has to be."""
    most = 0.0
    for name in ("excess", "multiplier", "at_lower", "at_upper", "on_excess", "slack"):
        most = max(most, float((-getattr(step, name) / getattr(point, name)).max(initial=0.0)))
    for change, room in (
        (-step.x, point.x - problem.lower),
        (step.x, problem.upper - point.x),
    ):
        most = max(most, float((change / room).max(initial=0.0)))
    # One hundredth before the end, so that nothing becomes zero.
    return 1.0 / max(1.0, 1.01 * most)
