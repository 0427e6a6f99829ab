"""The explicit analysis of a resolved case, with the densities that its budgets can analyse."""

from __future__ import annotations

from collections.abc import Sequence

from gradedesign.errors import ResourceError
from gradedesign.limits.limit import stated_goals
from gradedesign.resolve.analysable import (
    Analysable,
    analysable_bounds,
    analysable_together,
    chosen_analysis,
)
from gradedesign.resolve.analysis_of_gaps import chosen_beside_gaps
from gradedesign.resolve.planned_solid import planned_part
from gradedesign.resolve.resolved_case import ResolvedCase, stated_zones


def analysable_lattice(
    resolved: ResolvedCase,
    bounds: Sequence[tuple[float, float]],
    *,
    latticed: float,
    solid: float,
) -> Analysable:
    """The analysis that a case takes, with the density bounds that it can analyse.

    Parameters
    ----------
    resolved : ResolvedCase
    bounds : sequence of (float, float)
        Density windows of user, cell, law and printer of every zone, one without zones.
    latticed, solid : float, mm^3
        Volume that becomes lattice, and volume that stays solid.

    Raises
    ------
    ResourceError
        If the memory of the case holds no density of its window.
    """
    part = planned_part(
        resolved.part.surface,
        resolved.domain,
        latticed=latticed,
        solid=solid,
        load_cases=len(resolved.case.load_case),
        goals=stated_goals(resolved.limits),
    )
    candidates = [
        analysable_together(
            [
                analysable_bounds(
                    resolved.case,
                    zone.cell,
                    window,
                    resolved.layout.least,
                    analysis,
                    part=part,
                    domain=resolved.domain,
                )
                for zone, window in zip(stated_zones(resolved), bounds, strict=True)
            ]
        )
        for analysis in resolved.analyses
    ]
    if resolved.case.run.stop_after != "verdict":
        chosen = chosen_analysis(candidates)
    else:
        chosen = chosen_beside_gaps(candidates, resolved.part.surface)
    if chosen.refusal:
        raise ResourceError(f"{resolved.case.where('run.memory')}: {chosen.refusal}")
    return chosen
