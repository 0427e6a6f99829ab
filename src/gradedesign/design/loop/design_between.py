"""A design between two earlier ones of nearly one mass, one of which breaks a limit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from gradedesign.design.loop.iteration_steps import TARGET
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.verdict import Factors, all_hold, with_factors

#: Iterations in which the corrected model has its chance first. Chosen, not measured.
ENOUGH = 3
#: Two designs whose masses differ by more than this share, over the heavier one, are too far apart.
#: Chosen, not measured.
CLOSE = 0.05
#: Ways that are this near to an end lead to a design that is known. Chosen, not measured.
_LEAST_WAY = 0.02


@dataclass(frozen=True, slots=True, kw_only=True)
class Between:
    """Where the next design lies between two earlier ones."""

    lighter: int  #: Index of the design that breaks a limit.
    heavier: int  #: Index of the one that holds them all.
    way: float  #: Share of the way from the lighter to the heavier one.
    values: Mapping[LimitKey, float]  #: Explicit values that are expected there.


def design_between(
    masses: Sequence[float], rows: Sequence[Sequence[LimitRow]], factors: Factors
) -> Between | None:
    """The lightest mixture of two earlier designs that is expected to hold every limit, or None.

    Sizing follows the slope of the homogenised model. Where cells change with density, or walls
    meet a face or miss it, displacements fall several times as fast with mass, and it misses on
    either side in turn. The heaviest design that breaks a limit and the lightest that holds them
    all then enclose the one that is looked for: the logarithm of every value is taken to vary
    linearly between them.

    ``masses``, g: of the designs so far, in order. ``rows``: their explicit values. ``factors``: by
    LimitKey; accepted over explicit values.
    """
    if len(masses) < ENOUGH:
        return None
    expected = [with_factors(each, factors) for each in rows]
    held = [k for k, each in enumerate(expected) if all_hold(each)]
    if not held:
        return None
    heavier = min(held, key=lambda k: masses[k])
    least, most = (1.0 - CLOSE) * masses[heavier], masses[heavier]
    broken = [
        k for k, each in enumerate(expected) if not all_hold(each) and least < masses[k] < most
    ]
    if not broken:
        return None
    lighter = max(broken, key=lambda k: masses[k])
    below, above = _uses(expected[lighter]), _uses(expected[heavier])
    way = max(_way(below[key], above[key]) for key in below if key in above)
    if not _LEAST_WAY < way < 1.0 - _LEAST_WAY:
        return None
    low, high = ({row.key: row.value for row in rows[k]} for k in (lighter, heavier))
    values = {
        key: low[key] ** (1.0 - way) * high[key] ** way
        for key in low
        if low[key] > 0.0 and high.get(key, 0.0) > 0.0
    }
    return Between(lighter=lighter, heavier=heavier, way=way, values=values)


def _uses(rows: Sequence[LimitRow]) -> dict[tuple[LimitKey, str], float]:
    """Utilisation by limit and load case."""
    return {(row.key, row.load_case): row.utilisation for row in rows}


def _way(below: float, above: float) -> float:
    """Share of the way at which a utilisation falls to the aim."""
    if below <= TARGET:
        return 0.0
    if above >= TARGET or above <= 0.0 or math.isinf(below):
        return 1.0
    return math.log(below / TARGET) / math.log(below / above)
