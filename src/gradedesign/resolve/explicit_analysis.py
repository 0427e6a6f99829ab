"""Explicit analyses that a case may take; what they raise names their plugin."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from gradedesign.case.locate import locating
from gradedesign.case.schema import Case
from gradedesign.errors import CaseError, blaming
from gradedesign.plugin.registry import Registry, lookup
from gradedesign.verify.analysis import ExplicitAnalysis, Resolution, SolvedSolid
from gradedesign.verify.finite_cells import FINITE_CELLS
from gradedesign.verify.printed_solid import PrintedSolid
from gradedesign.verify.tets import STUFFED_TETS

#: Analyses from which ``[run] analysis = "auto"`` chooses, in the order of preference.
AUTOMATIC = (STUFFED_TETS.name, FINITE_CELLS.name)


def explicit_analyses(case: Case, registry: Registry) -> tuple[ExplicitAnalysis, ...]:
    """Analyses that ``[run] analysis`` allows, in the order of preference.

    Of those that ``"auto"`` chooses from, the ones whose walls stay in one piece with the elements
    that ``elements_per_wall`` states across them.

    Raises
    ------
    CaseError
        With line and nearest spelling, if nothing installed supplies it; if none of them takes the
        case.
    PluginError
        The same, when a plugin that might have supplied it is disabled.
    """
    names = AUTOMATIC if case.run.analysis == "auto" else (case.run.analysis,)
    with locating(case, "run.analysis"):
        analyses = [_blamed(lookup(registry, "analyses", name), registry) for name in names]
    taken = [analysis for analysis in analyses if not analysis.refuses(case)]
    if not taken:
        words = "; ".join(f"{analysis.name}: {analysis.refuses(case)}" for analysis in analyses)
        raise CaseError(f"{case.where('run.analysis')}: {words}; take another analysis")
    analyses = taken
    stated = case.run.elements_per_wall
    if stated is None or len(analyses) == 1:
        return tuple(analyses)
    return tuple(analysis for analysis in analyses if stated >= analysis.least_per_wall) or tuple(
        analyses[-1:]
    )


def _blamed(analysis: ExplicitAnalysis, registry: Registry) -> ExplicitAnalysis:
    who = f"analysis '{analysis.name}' of {registry.sources['analyses'][analysis.name]}"

    def solve(
        solid: PrintedSolid, resolution: Resolution, say: Callable[[str], None]
    ) -> SolvedSolid:
        with blaming(who, always=False):
            return analysis.solve(solid, resolution, say)

    return replace(analysis, solve=solve)
