"""Limits with their values, and the statuses that follow from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from gradedesign.ladder.setup import Setup
from gradedesign.verify.measures import PHASES, StressMeasure

#: A limit used to this share makes the design the lightest that was found.
TIGHT = 0.97
#: What a displacement limit is judged by.
LARGEST_NODAL = "largest nodal value on the region"
#: Accepted over explicit value by name and load case of a limit; see `factor_key`.
Factors: TypeAlias = Mapping[tuple[str, str], float]


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitRow:
    """One limit beside the value that judged it.

    Attributes
    ----------
    name : str
    load_case : str
    value : float
    limit : float
    unit : str
    judged_by : str
        Analysis behind the value.
    resolution_error : float or None
        Relative change of the explicit value from the first mesh size to the second.
    measure : str
        How the value is taken from the analysis, such as ``largest nodal value on the region``.
    stated : str
        How the case states the limit where that is no number, such as ``2 x solid``.
    """

    name: str
    load_case: str
    value: float
    limit: float
    unit: str
    judged_by: str
    resolution_error: float | None = None
    measure: str = ""
    stated: str = ""

    @property
    def use(self) -> float:
        """Value over limit."""
        return self.value / self.limit

    @property
    def passed(self) -> bool:
        """Whether the limit holds."""
        return self.value <= self.limit


def limit_rows(
    setup: Setup,
    displacements: Sequence[float],
    measures: Mapping[str, tuple[StressMeasure, ...]],
    judged_by: str,
) -> tuple[LimitRow, ...]:
    """Every displacement limit, and the stress limit for each phase of the solid."""
    rows = [
        LimitRow(
            name=f"displacement of {limit.name}",
            load_case=limit.load_case,
            value=float(value),
            limit=limit.limit,
            unit="mm",
            judged_by=judged_by,
            measure=LARGEST_NODAL,
            stated=limit.stated,
        )
        for limit, value in zip(setup.displacement_limits, displacements, strict=True)
    ]
    if setup.stress_limit is not None:
        for phase in PHASES:
            found = [
                (m.value, case) for case, ms in measures.items() for m in ms if m.phase == phase
            ]
            if found:
                value, case = max(found)
                rows.append(
                    LimitRow(
                        name=f"stress in {phase}",
                        load_case=case,
                        value=value,
                        limit=setup.stress_limit,
                        unit="MPa",
                        judged_by=judged_by,
                        measure=percentile_words(setup.case.limits.percentile),
                    )
                )
    return tuple(rows)


def percentile_words(percentile: float) -> str:
    """What a stress limit is judged by: the percentile by volume, outside the exclusion radius."""
    return f"percentile {percentile:g} of the volume outside the exclusion radius"


def factor_key(row: LimitRow) -> tuple[str, str]:
    """Name and load case under which acceptance learns of a limit.

    A displacement is limited in every load case of its own; the row of a stress is that of the
    load case that governs, which may change, so its load case is left empty.
    """
    return (row.name, "" if row.unit == "MPa" else row.load_case)


def with_factors(rows: Sequence[LimitRow], factors: Factors) -> tuple[LimitRow, ...]:
    """Rows whose values carry what acceptance found over the explicit analysis."""
    return tuple(replace(r, value=r.value * factors.get(factor_key(r), 1.0)) for r in rows)


def scaled_rows(rows: Sequence[LimitRow], factors: Factors, judged_by: str) -> tuple[LimitRow, ...]:
    """Rows with their factors, judged by another analysis where there is one."""
    return tuple(
        replace(new, judged_by=judged_by) if factor_key(new) in factors else new
        for new in with_factors(rows, factors)
    )


def learned_factors(
    explicit: Sequence[LimitRow], accepted: Sequence[LimitRow]
) -> dict[tuple[str, str], float]:
    """Accepted over explicit value of every limit that both judged; the largest of each."""
    before, after = _largest(explicit), _largest(accepted)
    return {key: value / before[key] for key, value in after.items() if before.get(key, 0.0) > 0}


def _largest(rows: Sequence[LimitRow]) -> dict[tuple[str, str], float]:
    values: dict[tuple[str, str], float] = {}
    for row in rows:
        values[factor_key(row)] = max(row.value, values.get(factor_key(row), 0.0))
    return values


def all_hold(rows: Sequence[LimitRow]) -> bool:
    """Every limit holds."""
    return all(row.passed for row in rows)


def worst_use(rows: Sequence[LimitRow]) -> float:
    """Largest use of any limit."""
    return max((row.use for row in rows), default=0.0)


def is_tight(rows: Sequence[LimitRow], *, at_lower_bound: bool) -> bool:
    """Some limit is used to 97 %, or no density can fall further."""
    return at_lower_bound or worst_use(rows) >= TIGHT
