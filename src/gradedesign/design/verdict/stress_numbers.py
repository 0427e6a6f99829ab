"""Stress numbers of a result for a reader: the one that decides a limit, and what the others are.

All stand on the basis of the limit's value: those of the analysis times the ratio of submodels.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gradedesign.design.verdict.result import RunResult
    from gradedesign.mechanics.limits.row import LimitRow


@dataclass(frozen=True, slots=True, kw_only=True)
class StressNumber:
    """A stress and what it is."""

    stress: float  #: MPa.
    words: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PhaseStress:
    """Stress numbers of one phase in one load case."""

    title: str
    numbers: tuple[StressNumber, ...]  #: That of the limit first, where the load case governs one.
    note: str = ""  #: Share of the volume above the limit; empty where none is stated.


def stress_numbers(result: RunResult) -> tuple[PhaseStress, ...]:
    """Stress of every phase and load case that was measured, those that decide a limit first."""
    rows = sorted((row for row in result.limits if row.phase), key=lambda row: row.utilisation)
    governing = {(row.load_case, row.phase): row for row in rows}
    measured = {
        (case, phase): measure
        for case, phases in result.measures.items()
        if isinstance(phases, Mapping)
        for phase, measure in phases.items()
        if isinstance(measure, Mapping) and "share_above" in measure
    }
    order = sorted(measured, key=lambda pair: pair not in governing)
    return tuple(_phase(result, pair, measured[pair], governing.get(pair)) for pair in order)


def _phase(
    result: RunResult, pair: tuple[str, str], measure: Mapping[str, Any], row: LimitRow | None
) -> PhaseStress:
    case, phase = pair
    zone: Mapping[str, Any] = result.acceptance.get("exclusion", {})
    ratio = zone.get("stress_ratio", {}).get(phase, 1.0)
    outside = " outside the zones around supports" if zone.get("radius_mm") else ""
    numbers = []
    if row is not None and row.band is not None:
        end = f"decides: the {row.unfavourable} end of the band, beside {row.limit:.4g} MPa"
        numbers.append(StressNumber(stress=row.decisive, words=end))
    how = ""
    if abs(ratio - 1.0) >= 1e-9:
        how = f": {measure['value']:.4g} MPa by finite cells, times {ratio:.3f} by the submodels"
    numbers += [
        StressNumber(
            stress=ratio * measure["value"],
            words=f"expected: {'percentile of the volume' if row is None else row.measure}{how}",
        ),
        StressNumber(
            stress=ratio * measure["worst_cell"],
            words="the same percentile in the worst neighbourhood of one cell, about "
            f"({', '.join(f'{c:.1f}' for c in measure['worst_cell_centre'])}) mm",
        ),
        StressNumber(
            stress=ratio * measure["maximum"],
            words=f"the largest at an integration point{outside}: it grows with ever smaller "
            "elements at corners, and is not judged",
        ),
    ]
    if outside and phase in zone["stress_everywhere_MPa"].get(case, {}):
        numbers += [
            StressNumber(
                stress=zone["stress_everywhere_MPa"][case][phase],
                words="exceeded by as much volume as the expected one, these zones included",
            ),
            StressNumber(
                stress=zone["maximum_everywhere_MPa"][case][phase],
                words="the largest at an integration point, these zones included: ideally rigid "
                "supports make it grow without end",
            ),
        ]
    title = f"{phase} ({case})" if row is None else f"{row.name} ({case})"
    note = ""
    if row is not None:
        before = ", before that factor" if how else ""
        least = min(each.limit for each in result.limits if each.phase)
        limit = "the limit" if row.limit == least else f"{least:.4g} MPa, the least limit of any"
        note = f"{measure['share_above']:.2%} of the judged volume is above {limit}{before}."
    return PhaseStress(title=title, numbers=tuple(numbers), note=note)
