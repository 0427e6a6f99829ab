"""Limits with their values, and the statuses that follow from them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

from gradedesign.errors import SolverError
from gradedesign.mechanics.limits.analysis import Analysis
from gradedesign.mechanics.limits.banded import LEAST_UNKNOWN, RESIDUAL_FACTORS
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.limit import Limit
from gradedesign.mechanics.limits.row import LimitRow

#: A limit used to this share makes the design the lightest that was found. Chosen, not measured.
TIGHT = 0.97
#: Accepted over explicit value of a limit.
Factors: TypeAlias = Mapping[LimitKey, float]


def limit_rows(limits: Sequence[Limit], analysis: Analysis, judged_by: str) -> tuple[LimitRow, ...]:
    """Every limit that an analysis measures, with its value there.

    Raises `SolverError` if the analysis has no value of a limit that it should measure: without its
    row it would be taken for one that holds.
    """
    rows: list[LimitRow] = []
    for limit in limits:
        measured = limit.rows(analysis, judged_by)
        if limit.explicit and not (measured or limit.may_lack):
            raise SolverError(
                f"{limit.name} has no value by {judged_by}, so it would not be judged; expected "
                f"one: where it limits stress, take a smaller [limits] exclusion_radius"
            )
        rows += measured
    return tuple(rows)


def with_factors(rows: Sequence[LimitRow], factors: Factors) -> tuple[LimitRow, ...]:
    """Rows times the factors of acceptance over the explicit analysis."""
    return tuple(replace(r, value=r.value * factors.get(r.key, 1.0)) for r in rows)


def learned_factors(
    explicit: Sequence[LimitRow], accepted: Sequence[LimitRow]
) -> dict[LimitKey, float]:
    """Accepted over explicit value of every limit that both judged; the largest of each.

    The accepted one is the unfavourable end of its band, so that the next design holds there.
    Raises `SolverError` if an explicit value is 0 where acceptance finds one: no factor leads from
    one to the other.
    """
    before, after = _largest(explicit), _largest(accepted)
    factors: dict[LimitKey, float] = {}
    for key, row in after.items():
        if key not in before:
            continue
        old, new = before[key].decisive, row.decisive
        if old == 0.0 and new != 0.0:
            raise SolverError(
                f"{row.name} ({row.load_case}) is 0 {row.unit} in the explicit analysis but "
                f"{new:.4g} {row.unit} in acceptance, so nothing can be learned from it; expected "
                f"both to measure the same: look at supports and loads there, or drop the limit"
            )
        factors[key] = new / old if old else 1.0
    return factors


def expected_factors(
    explicit: Sequence[LimitRow], residuals: Mapping[str, float]
) -> dict[LimitKey, float]:
    """Accepted over explicit value that one analysis lets expect.

    A value that converges is too small on finite cells by a share of the residual of the tractions;
    acceptance, whose elements are smaller, judges the unfavourable end of a band about the value
    without that error. The usual share is taken: it was 0.14 and 0.15 up to that end, whose larger
    share counts for smaller elements. The band of other values, percentiles of stress, reaches
    `LEAST_UNKNOWN` at least to both sides, and its unfavourable end judges them.

    ``residuals``: by load case; see `finite_cell.traction_residual`.
    """
    share, _, _ = RESIDUAL_FACTORS
    factors: dict[LimitKey, float] = {}
    for row in explicit:
        if row.converges and row.load_case in residuals:
            # A load factor falls by what a displacement grows; a frequency, a root, by half of it.
            times = 1.0 if row.unfavourable == "high" else -0.5 if row.unit == "Hz" else -1.0
            factors[row.key] = 1.0 + times * share * residuals[row.load_case]
        elif not row.converges and not row.homogenised:
            end = LEAST_UNKNOWN if row.unfavourable == "high" else -LEAST_UNKNOWN
            factors[row.key] = 1.0 + end
    return factors


def mean_factors(earlier: Factors, later: Factors) -> dict[LimitKey, float]:
    """Geometric means of factors that both have, and the later ones that the earlier lack."""
    return {key: math.sqrt(earlier.get(key, new) * new) for key, new in later.items()}


def _largest(rows: Sequence[LimitRow]) -> dict[LimitKey, LimitRow]:
    largest: dict[LimitKey, LimitRow] = {}
    for row in rows:
        if row.key not in largest or row.utilisation > largest[row.key].utilisation:
            largest[row.key] = row
    return largest


def all_hold(rows: Sequence[LimitRow]) -> bool:
    """Every limit holds."""
    return all(row.passed for row in rows)


def solid_breaks(rows: Sequence[LimitRow]) -> bool:
    """The fully solid part breaks, for sure, a limit that no lattice holds better."""
    return any(row.broken and row.solid_is_best for row in rows)


def unsure_words(solid: Sequence[LimitRow]) -> tuple[str, ...]:
    """Warnings of limits that the fully solid part neither holds nor rules out for sure."""
    slow = tuple(
        f"{row.name} ({row.load_case}) of the fully solid part is {row.value:.4g} {row.unit}, less "
        f"than the {row.limit:.4g} {row.unit} that it must be at least: only a lattice that is "
        f"light or soft in the right places can hold that"
        for row in solid
        if row.broken and not row.solid_is_best
    )
    return slow + tuple(
        f"{row.name} ({row.load_case}): the band of {row.band.low:.4g} to {row.band.high:.4g} "
        f"{row.unit} of the fully solid part holds the limit of {row.limit:.4g} {row.unit}, so "
        f"that it is neither met nor broken for sure; a smaller part.mesh_size narrows the band"
        for row in solid
        if row.band is not None and row.undecided and not row.passed
    )


def worst_utilisation(rows: Sequence[LimitRow]) -> float:
    """Largest utilisation of any limit, at the unfavourable end of its band."""
    return max((row.utilisation for row in rows), default=0.0)


def is_tight(rows: Sequence[LimitRow], *, at_lower_bound: bool) -> bool:
    """Some limit is used to 97 %, or no density can fall further."""
    return at_lower_bound or worst_utilisation(rows) >= TIGHT


def why_infeasible(rows: Sequence[LimitRow]) -> str:
    """The limit that the fully solid part breaks most, and what would help."""
    worst = max((row for row in rows if row.solid_is_best), key=lambda row: row.least_utilisation)
    end = f" at the favourable end of its band ({worst.band_words})" if worst.band else ""
    return (
        f"the fully solid part already breaks a limit: {worst.name} ({worst.load_case}) is "
        f"{worst.favourable:.4g} {worst.unit}{end}, {worst.least_utilisation:.2f} times the "
        f"allowed {worst.limit:.4g} {worst.unit}; a stiffer or stronger material, a thicker part, "
        f"a smaller load or a wider limit would help, a lattice cannot"
    )
