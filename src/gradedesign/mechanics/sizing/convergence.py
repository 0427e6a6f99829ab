"""Convergence of sizing, its move limits, and the rise of all densities where a limit stalls."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.sizing.problem import SizingProblem, SizingStep

#: The move limit of a variable whose steps alternate shrinks by one factor, down to a share of the
#: common one, and grows by the other while they do not. Chosen, not measured.
CALMER, BOLDER, LEAST_CALM = 0.7, 1.2, 0.1
#: Where a limit beyond its aim gains less than the first in as many iterations as the second, all
#: densities rise by its utilisation over its aim, and by the third at least: the densest lattice
#: attracts the load, so that densifying it alone may gain nothing where the same mass spread evenly
#: holds.
GAIN, PATIENCE, LEAST_RISE = 0.01, 2, 0.005
#: Changes below this share of the tolerance are none. Chosen, not measured.
STILL = 0.05


def rise(history: Sequence[SizingStep], target: float, *, settled: bool) -> float:
    """Factor by which all densities are to rise: 1 while the most used limit gains.

    ``settled`` where nothing moves any more, so that there is nothing to wait for.
    """
    now = history[-1].utilisation
    if now <= (1.0 + LEAST_RISE / 2.0) * target or (len(history) <= PATIENCE and not settled):
        return 1.0
    gains = not settled and now < (1.0 - GAIN) * history[-1 - PATIENCE].utilisation
    return 1.0 if gains else max(now / target, 1.0 + LEAST_RISE)


def stands_still(history: Sequence[SizingStep], tolerance: float, *, holds: bool) -> bool:
    """Nothing moves at all, or densities, mass and utilisations settle where the limits hold."""
    change = history[-1].change
    settled = change < tolerance or mass_settled(history, tolerance)
    return change < STILL * tolerance or (settled and holds)


def near_enough(problem: SizingProblem, tolerance: float) -> float:
    """Largest utilisation of a stationary design that is accepted: near the aim, within limits."""
    near = problem.target * (1 + tolerance)
    return near if problem.target >= 1.0 else min(near, 1.0)


def mass_settled(history: Sequence[SizingStep], tolerance: float) -> bool:
    """Mass and utilisations have stood still for five iterations."""
    if len(history) < 8:
        return False
    mass = np.array([h.mass_g for h in history[-5:]])
    utilisations = np.array([h.utilisations for h in history[-5:]])
    return bool(
        np.ptp(mass) <= 0.75 * tolerance * mass[-1]
        and np.ptp(utilisations, axis=0).max(initial=0.0) <= tolerance
    )


def calmed(calm: FloatArray, turned: FloatArray) -> FloatArray:
    """Share of the move limit for every variable: less where its steps change their sign.

    ``turned`` is the product of a variable's last two steps. As the asymptotes of Svanberg (1987,
    Int. J. Numer. Meth. Engng 24, section 4) do.
    """
    slower = np.maximum(calm * CALMER, LEAST_CALM)
    faster = np.minimum(calm * BOLDER, 1.0)
    return np.where(turned < 0, slower, np.where(turned > 0, faster, calm))


def is_two_cycle(new: FloatArray, now: FloatArray, before: FloatArray) -> bool:
    """The step nearly undoes the last one."""
    forward, back = new - now, now - before
    size_back = float(np.linalg.norm(back))
    return size_back > 0 and float(np.linalg.norm(forward + back)) < 0.3 * size_back
