"""Limits with their values, and the statuses that follow from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from gradedesign.ladder.setup import Setup
from gradedesign.verify.measures import PHASES, StressMeasure

#: A limit used to this share makes the design the lightest that was found.
TIGHT = 0.97
#: What a displacement limit is judged by.
LARGEST_NODAL = "largest nodal value on the region"


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


def scaled_rows(
    rows: Sequence[LimitRow], factors: Mapping[str, float], judged_by: str
) -> tuple[LimitRow, ...]:
    """Rows whose values carry a factor by name."""
    return tuple(
        replace(row, value=row.value * factors[row.name], judged_by=judged_by)
        if row.name in factors
        else row
        for row in rows
    )


def all_hold(rows: Sequence[LimitRow]) -> bool:
    """Every limit holds."""
    return all(row.passed for row in rows)


def worst_use(rows: Sequence[LimitRow]) -> float:
    """Largest use of any limit."""
    return max((row.use for row in rows), default=0.0)


def is_tight(rows: Sequence[LimitRow], *, at_lower_bound: bool) -> bool:
    """Some limit is used to 97 %, or no density can fall further."""
    return at_lower_bound or worst_use(rows) >= TIGHT
