"""Reason why the loop ended, and advice on how to go further.

Budgets end a run with a stated reason; they do not steer it. So the clock is read here only, and
only to decide that no further iteration or acceptance is begun.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.common.system.limits import Deadline
from gradedesign.design.loop.iteration import DesignIteration
from gradedesign.design.loop.saturation import saturated
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.errors import GradeDesignError, ResourceError
from gradedesign.mechanics.limits.verdict import Factors

#: An iteration after the second is only begun if this many times the last one's duration is left.
#: Chosen, not measured.
_TIME_RESERVE = 1.3
#: Densities that differ by less are the same design. Chosen, not measured.
SAME_DENSITY = 1e-4
#: Masses and utilisations that differ by less of each other are alike. Chosen, not measured.
_ALIKE = 2e-4
#: Missing time is stated in steps of this many seconds. Chosen, not measured.
_TIME_STEP = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Ended:
    """Reason why no further iteration is made, and advice.

    Attributes
    ----------
    by : {"tight", "enclosed", "iterations", "time", "stuck", "saturated", "refused", "unjudged",
          "unaccepted"}
        ``tight``: the lightest design that was looked for was accepted. ``enclosed``: one that is
        hardly lighter does not hold. ``iterations``, ``time``: a budget of [run]. ``stuck``: the
        last iteration changed nothing. ``saturated``: no density of this lattice can hold a limit.
        ``refused``: the next design could not be analysed. ``unjudged``: two designs in succession
        could be analysed at one resolution only, or not meshed anew. ``unaccepted``: acceptance of
        a design failed.
    words : str
        For the verdict.
    """

    by: str
    words: str


_STUCK = (
    "the last iteration found the same design again, so that no further one can change it; a "
    "higher upper density, another cell, smaller cells or a skin would help"
)
_STUCK_HELD = (
    "the last three iterations found the same design; a smaller [lattice] least_member, smaller "
    "cells or a smaller lower density leave room for a lighter one"
)
#: A design that breaks a limit and is lighter by no more than this share shows that the accepted
#: one is the lightest.
#: Displacements jump where walls meet a face or miss it: `size-graded` once used 100.3 % at 9.442 g
#: and 94.9 % at 9.471 g.
_ENCLOSED = 0.01
#: A design was accepted that uses a limit.
TIGHT_END = Ended(by="tight", words="a limit is used to 97 % or no density can fall further")


def why_ended(
    model: DesignModel,
    iterations: Sequence[DesignIteration],
    factors: Factors,
    deadline: Deadline,
    acceptance_s: float = 0.0,
) -> Ended | None:
    """Reason to end the loop before another iteration, or None.

    ``iterations``: finished so far. ``factors``: of acceptance. ``acceptance_s``, s: that an
    acceptance after the iteration is expected to take.
    """
    if not iterations:
        return None
    words = saturated(model, iterations, factors)
    if words is not None:
        return Ended(by="saturated", words=words)
    if stuck(iterations):
        held = iterations[-1].summary.passed
        return Ended(by="stuck", words=_STUCK_HELD if held else _STUCK)
    last = iterations[-1].summary.seconds
    most = model.plan.case.run.max_iterations
    if len(iterations) >= most:
        return Ended(
            by="iterations",
            words=f"[run] max_iterations of {most} ended the run; another iteration "
            f"takes about {_rounded(last)} s",
        )
    # The first iteration of all also compiles, so it is reserve enough for the second.
    needed = last * (_TIME_RESERVE if len(iterations) > 1 else 1.0) + acceptance_s
    remaining = deadline.remaining()
    if remaining < needed:
        return Ended(
            by="time",
            words=f"[run] time of {deadline.seconds:.4g} s ended the run after "
            f"{counted(len(iterations), 'iteration')}; about {_rounded(needed - remaining)} s more "
            f"allow another iteration{' and its acceptance' if acceptance_s else ''}",
        )
    return None


class NoTimeError(ResourceError):
    """An acceptance is not begun, since it would not end in the time of the case."""


def require_time(iteration: int, deadline: Deadline, least_s: float) -> None:
    """Refuse to begin an acceptance for which there is no time on an idle machine.

    Raises NoTimeError if less is left.

    ``iteration``: number of the one whose design is to be judged. ``least_s``, s: that the
    acceptance takes.
    """
    remaining = deadline.remaining()
    if remaining < least_s:
        raise NoTimeError(
            f"[run] time of {deadline.seconds:.4g} s ended the run before the acceptance of "
            f"iteration {iteration}, which takes about {least_s:.0f} s where {remaining:.0f} s are "
            f"left; about {_rounded(least_s - remaining)} s more, with the run resumed, judge it"
        )


def enclosed_end(mass: float, broken: Sequence[float]) -> Ended | None:
    """End at an accepted design where one that is hardly lighter does not hold, or None.

    Walls and struts that meet a face or miss it let displacements jump by some per cent between
    designs of nearly one mass: no design may use a limit to 97 %.

    ``mass``, g: of the accepted design. ``broken``, g: of those that break a limit.

    Examples
    --------
    >>> enclosed_end(10.0, [8.0, 9.95]).words
    'a design of 0.50% less mass breaks a limit'
    """
    lighter = max((each for each in broken if each < mass), default=0.0)
    if lighter < (1.0 - _ENCLOSED) * mass:
        return None
    return Ended(
        by="enclosed", words=f"a design of {1 - lighter / mass:.2%} less mass breaks a limit"
    )


def heavier_end(mass: float, tight: float) -> Ended:
    """End at an accepted design where a heavier one uses a limit; masses in g."""
    return Ended(
        by="tight",
        words=f"a design of {tight / mass - 1:.2%} more mass uses a limit to 97 %, so that designs "
        f"of one mass differ by more than what is left",
    )


def unjudged_end(unjudged: str) -> Ended:
    """End where designs cannot be judged: a second resolution or an independent mesh is missing.

    ``unjudged``: `Accepted.unjudged` of the last one.
    """
    return Ended(
        by="unjudged",
        words=f"two designs in succession were not judged in full, {unjudged}; more [run] memory "
        f"and time, a higher lower density, larger cells or a coarser [run] elements_per_wall "
        f"would help",
    )


def unaccepted_end(error: GradeDesignError) -> Ended:
    """A design could not be judged: no time is left, or its file or an analysis of it failed."""
    if isinstance(error, NoTimeError):
        return Ended(by="time", words=str(error))
    return Ended(by="unaccepted", words=f"the printed surface could not be judged: {error}")


def refused_end(iterations: Sequence[DesignIteration], error: GradeDesignError) -> Ended:
    """The design of the next iteration could not be meshed or analysed within the budgets."""
    return Ended(
        by="refused",
        words=f"the design of iteration {len(iterations) + 1} could not be analysed: {error}",
    )


def stuck(iterations: Sequence[DesignIteration]) -> bool:
    """Whether a design equals the last one, so that no iteration changes it.

    Of designs that hold their limits, of which an acceptance may teach something, the last three
    weigh the same and use their limits alike.
    """
    if not iterations[-1].summary.passed:
        return len(iterations) > 1 and _same(*iterations[-2:])
    last = [each.summary for each in iterations[-3:]]
    found = np.array([(each.mass_g, each.utilisation) for each in last])
    return len(last) == 3 and bool((np.ptp(found, axis=0) <= _ALIKE * found[-1]).all())


def _same(before: DesignIteration, last: DesignIteration) -> bool:
    """Whether two designs are one."""
    changes = [last.rho - before.rho]
    if last.members is not None and before.members is not None:
        changes.append(last.members.variables - before.members.variables)
        if last.members.offset != before.members.offset:
            return False
    return all(bool(np.abs(change).max() < SAME_DENSITY) for change in changes)


def counted(number: int, noun: str) -> str:
    """Number and noun: ``1 iteration``, ``2 iterations``."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _rounded(seconds: float) -> int:
    """Next full step, s."""
    return _TIME_STEP * max(1, math.ceil(seconds / _TIME_STEP))
