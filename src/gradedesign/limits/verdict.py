"""Limits with their values, and the statuses that follow from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

from gradedesign.limits.analysis import Analysis
from gradedesign.limits.key import LimitKey
from gradedesign.limits.limit import Limit
from gradedesign.limits.row import LimitRow

#: A limit used to this share makes the design the lightest that was found.
TIGHT = 0.97
#: Accepted over explicit value of a limit.
Factors: TypeAlias = Mapping[LimitKey, float]


def limit_rows(limits: Sequence[Limit], analysis: Analysis, judged_by: str) -> tuple[LimitRow, ...]:
    """Every limit that an analysis measures, with its value there."""
    return tuple(row for limit in limits for row in limit.rows(analysis, judged_by))


def with_factors(rows: Sequence[LimitRow], factors: Factors) -> tuple[LimitRow, ...]:
    """Rows whose values carry what acceptance found over the explicit analysis."""
    return tuple(replace(r, value=r.value * factors.get(r.key, 1.0)) for r in rows)


def scaled_rows(rows: Sequence[LimitRow], factors: Factors, judged_by: str) -> tuple[LimitRow, ...]:
    """Rows with their factors, judged by another analysis where there is one."""
    return tuple(
        replace(new, judged_by=judged_by) if new.key in factors else new
        for new in with_factors(rows, factors)
    )


def learned_factors(
    explicit: Sequence[LimitRow], accepted: Sequence[LimitRow]
) -> dict[LimitKey, float]:
    """Accepted over explicit value of every limit that both judged; the largest of each."""
    before, after = _largest(explicit), _largest(accepted)
    return {key: value / before[key] for key, value in after.items() if before.get(key, 0.0) > 0}


def _largest(rows: Sequence[LimitRow]) -> dict[LimitKey, float]:
    values: dict[LimitKey, float] = {}
    for row in rows:
        values[row.key] = max(row.value, values.get(row.key, 0.0))
    return values


def all_hold(rows: Sequence[LimitRow]) -> bool:
    """Every limit holds."""
    return all(row.passed for row in rows)


def worst_utilisation(rows: Sequence[LimitRow]) -> float:
    """Largest utilisation of any limit."""
    return max((row.utilisation for row in rows), default=0.0)


def is_tight(rows: Sequence[LimitRow], *, at_lower_bound: bool) -> bool:
    """Some limit is used to 97 %, or no density can fall further."""
    return at_lower_bound or worst_utilisation(rows) >= TIGHT
