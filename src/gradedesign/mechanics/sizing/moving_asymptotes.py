"""One step of the method of moving asymptotes: least objective under several constraints.

Variables are positive and enter by their logarithms, in which the logarithm of a power law is
linear. Constraints are replaced by convex separable functions of ``1 / (U - x)`` and
``1 / (x - L)``, whose asymptotes L and U draw together where a variable swings and apart where it
goes on in one direction. The objective is a mass, which is all but linear in the variables
themselves, and stays so. The subproblem is solved by Newton's method on its optimality conditions,
with a barrier that is lowered to nothing.

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
#: Curvature that a constraint has at least in every variable, over the mean of its derivatives: a
#: tenth of the first guess of the conservative form (Svanberg 2002, section 5), which raises it
#: where a constraint turns out to be worse than approximated.
_CURVED = 0.01
#: Price of breaking a constraint of the subproblem by one: far above any multiplier that a mass of
#: order 1 and logarithms of utilisations have, so that it is paid only where no step can do.
_PENALTY = 1e4
#: Barrier at which the subproblem counts as solved, in the units of objective and constraints.
_SOLVED = 1e-9
#: Newton's steps for one barrier, and halvings of one step, at most. Chosen, not measured.
_NEWTON_STEPS, _HALVINGS = 60, 40


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Asymptotes:
    """Distances of the asymptotes of every variable, with the last step."""

    distance: FloatArray  #: ``(n,)``. Of both asymptotes from the logarithm of the variable.
    at: FloatArray  #: ``(n,)``. Variables of the design that they are for.
    step: FloatArray  #: ``(n,)``. Step that led to those, in logarithms; zero at first.


def first_asymptotes(x: FloatArray, lower: FloatArray, upper: FloatArray) -> Asymptotes:
    """Asymptotes of a first design ``(n,)`` between its bounds."""
    return Asymptotes(distance=_FIRST * np.log(upper / lower), at=x, step=np.zeros_like(x))


def moved_asymptotes(
    asymptotes: Asymptotes, x: FloatArray, lower: FloatArray, upper: FloatArray
) -> Asymptotes:
    """Asymptotes of the next design: nearer to variables that turned round."""
    step = np.log(x / asymptotes.at)
    turned = step * asymptotes.step
    factor = np.where(turned < 0, _CALMER, np.where(turned > 0, _BOLDER, 1.0))
    extent = np.log(upper / lower)
    distance = np.clip(factor * asymptotes.distance, _LEAST * extent, _MOST * extent)
    return Asymptotes(distance=distance, at=x, step=step)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Subproblem:
    """Least ``cost . exp x`` where ``sum p / (U - x) + q / (x - L)`` is within limits.

    ``x`` are logarithms over the present variables, so that it is zero there. ``limits`` are those
    of the constraints' sums, so that they hold their values at the present design; ``lower`` and
    ``upper`` bound the step. Every Newton step writes its two largest arrays into ``scratch (2, k,
    n)``: new ones of 13 constraints by 16,000 variables take four times as long.
    """

    cost: FloatArray
    p: FloatArray
    q: FloatArray
    left: FloatArray
    right: FloatArray
    limits: FloatArray
    lower: FloatArray
    upper: FloatArray
    scratch: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Step:
    """Solution of one subproblem."""

    x: FloatArray  #: ``(n,)``. New variables.
    expected: FloatArray  #: ``(k,)``. Values of the approximated constraints there.
    bend: FloatArray  #: ``(k,)``. What a curvature greater by 1 would add to them.


def asymptotes_step(
    x: FloatArray,
    cost: FloatArray,
    values: FloatArray,
    gradients: FloatArray,
    bounds: tuple[FloatArray, FloatArray],
    distance: FloatArray,
    *,
    move: float = np.inf,
    curvature: FloatArray | float = 1.0,
) -> Step:
    """Minimise ``cost . x`` under approximated constraints ``value <= 0``.

    - ``x (n,)``: present variables
    - ``cost (n,)``: of the variables; their sum should be of order 1
    - ``values (k,)``: of the constraints, of order 1 where they are broken
    - ``gradients (k, n)``: their derivatives
    - ``bounds``: pair of (n,) arrays of the variables, the lower below the upper
    - ``distance (n,)``: that of `Asymptotes`
    - ``move``: largest step of a variable's logarithm
    - ``curvature (k,)``: of the constraints, times the least one: greater where they turned out to
      be worse than approximated
    """
    low, high = (np.log(end / x) for end in bounds)
    slopes = gradients * x
    up, down = np.maximum(slopes, 0.0), np.maximum(-slopes, 0.0)
    extent = high - low
    least = _CURVED * (np.abs(slopes) * extent).mean(axis=1, keepdims=True) / extent
    curved = np.reshape(curvature, (-1, 1)) * least
    p = distance**2 * ((1 + _CONVEX) * up + _CONVEX * down + curved)
    q = distance**2 * (_CONVEX * up + (1 + _CONVEX) * down + curved)
    near = np.minimum(_WAY * distance, move)
    problem = _Subproblem(
        cost=cost * x,
        p=p,
        q=q,
        left=-distance,
        right=distance,
        limits=(p + q) @ (1 / distance) - values,
        lower=np.maximum(low, -near),
        upper=np.minimum(high, near),
        scratch=np.zeros((2, *p.shape)),
    )
    step = _solved(problem)
    over, under = 1 / (distance - step), 1 / (distance + step)
    return Step(
        x=np.clip(x * np.exp(step), *bounds),
        expected=p @ over + q @ under - problem.limits,
        bend=(least * distance**2) @ (over + under - 2 / distance),
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


def _solved(problem: _Subproblem) -> FloatArray:
    """Solution of a subproblem, by Newton's method with a falling barrier."""
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
                return point.x
            point, residual = trial, new
        if barrier <= _SOLVED:
            return point.x
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
    slope = problem.cost * np.exp(point.x) + p / over**2 - q / under**2
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
    jacobian, other = problem.scratch
    np.multiply(problem.p, 1 / over**2, out=jacobian)
    jacobian -= np.multiply(problem.q, 1 / under**2, out=other)
    rise = problem.cost * np.exp(point.x)
    slope = rise + p / over**2 - q / under**2 - barrier / to_lower + barrier / to_upper
    curve = rise + 2 * p / over**3 + 2 * q / under**3
    curve += point.at_lower / to_lower + point.at_upper / to_upper
    by_excess = _PENALTY + point.excess - point.multiplier - barrier / point.excess
    excess_curve = 1.0 + point.on_excess / point.excess
    missing = sums - point.excess - problem.limits + barrier / point.multiplier
    matrix = np.diag(point.slack / point.multiplier + 1 / excess_curve)
    matrix += np.divide(jacobian, curve, out=other) @ jacobian.T
    right = missing + by_excess / excess_curve - jacobian @ (slope / curve)
    multiplier = np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
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
