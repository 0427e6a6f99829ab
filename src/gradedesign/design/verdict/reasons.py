"""Sentences for a person on why a design is met or not, and on which body it was judged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gradedesign.arrays import FloatArray
from gradedesign.design.acceptance.body_comparison import BodyComparison
from gradedesign.design.loop.ended import TIGHT_END, Ended
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.mechanics.limits.row import LEAST_JUDGED, LimitRow
from gradedesign.mechanics.limits.verdict import all_hold, worst_utilisation


def why_met(rows: Sequence[LimitRow], ended: Ended, *, tight: bool) -> tuple[str, bool, Ended]:
    """Sentence on a design that holds, whether it is the lightest, and what ended the run."""
    text = _all_hold_words(rows)
    if tight:
        return text, True, TIGHT_END
    if ended.by == "enclosed":
        return f"{text}; {ended.words}", True, ended
    return f"{text}; not the lightest: {ended.words}, and a lighter design may exist", False, ended


def why_judged(
    rows: Sequence[LimitRow], ended: Ended, solid: Sequence[LimitRow], *, holds: bool
) -> str:
    """Sentence on a body that nothing designed; ``solid`` are rows of the solid part."""
    return f"{_all_hold_words(rows)}; {ended.words}" if holds else why_not(rows, ended, solid)


def _all_hold_words(rows: Sequence[LimitRow]) -> str:
    """Every limit holds, and how far the most used one is used."""
    used = worst_utilisation(rows)
    return f"every limit holds at the unfavourable end of its band; the most used one to {used:.1%}"


def why_not(rows: Sequence[LimitRow], ended: Ended, solid: Sequence[LimitRow] = ()) -> str:
    """The limit that fails, what ended the loop, and advice; ``solid`` are of the solid part."""
    if not rows or all_hold(rows):
        return f"no design was accepted; {ended.words}"
    unjudged = [row for row in rows if not row.judges_enough]
    if unjudged:
        row = unjudged[0]
        if row.remeshed < LEAST_JUDGED:
            return (
                f"{row.name} ({row.load_case}) is {row.decisive:.4g} {row.unit} of the allowed "
                f"{row.limit:.4g} {row.unit} by the finite cells alone: an independent mesh could "
                f"be made and solved for {row.remeshed:.0%} of what was to judge it, less than the "
                f"{LEAST_JUDGED:.0%} that a limit needs to hold; {ended.words}"
            )
        return (
            f"{row.name} ({row.load_case}) is judged on {row.judged:.0%} of its volume, less than "
            f"the {LEAST_JUDGED:.0%} that a limit needs to hold; a smaller [limits] "
            f"exclusion_radius judges more; {ended.words}"
        )
    worst = max(rows, key=lambda row: row.utilisation)
    end = "" if worst.band is None else f" at the {worst.unfavourable} end of its band"
    if worst.unfavourable == "low":
        beside = [f", the fully solid part has {r.value:.4g}" for r in solid if r.key == worst.key]
        return (
            f"{worst.name} ({worst.load_case}) is {worst.decisive:.4g} {worst.unit}{end}, less "
            f"than the {worst.limit:.4g} {worst.unit} that it must be at least"
            f"{''.join(beside)}; {ended.words}"
        )
    return (
        f"{worst.name} ({worst.load_case}) is {worst.decisive:.4g} {worst.unit}{end}, "
        f"{worst.utilisation:.1%} of the allowed {worst.limit:.4g} {worst.unit}; {ended.words}"
    )


def judged_on(comparison: BodyComparison) -> str:
    """Body that limits without an acceptance are judged on, and how the file differs from it."""
    return (
        f"no acceptance judged the printed file: the limits are those of the solid of the explicit "
        f"analysis, from which the file differs by {comparison.volume_difference:+.1%} in volume "
        f"and mass"
    )


def mapping_data(lattice: LatticeSpec, variables: FloatArray) -> dict[str, float]:
    """Factor on the stress of the solid part; nothing where another method sized."""
    if not lattice.by_stress:
        return {}
    return {"stress_factor": float(variables[0])}


def with_method(reason: str, mapping: Mapping[str, float]) -> str:
    """A sentence with the method that sized, where it was the plain one.

    Examples
    --------
    >>> with_method("every limit holds", {"stress_factor": 1.25})
    'every limit holds; sized by stress-to-density: stress of the solid part times 1.25'
    >>> with_method("every limit holds", {})
    'every limit holds'
    """
    if not mapping:
        return reason
    factor = mapping["stress_factor"]
    return f"{reason}; sized by stress-to-density: stress of the solid part times {factor:.3g}"
