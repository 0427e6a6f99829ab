"""The explicit analysis of a case; what it raises names its plugin."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from gradedesign.common.values.locate import locating
from gradedesign.design.case.schema import Case
from gradedesign.design.resolve.registry import Registry, lookup
from gradedesign.errors import CaseError, blaming
from gradedesign.mechanics.explicit.analysis import ExplicitAnalysis, Resolution, SolvedSolid
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid


def explicit_analysis(case: Case, registry: Registry) -> ExplicitAnalysis:
    """The analysis that ``[run] analysis`` names.

    Raises
    ------
    CaseError
        With line and nearest spelling, if nothing installed supplies it; if it does not take the
        case.
    PluginError
        The same, when a plugin that might have supplied it is disabled.
    """
    with locating(case.where, "run.analysis"):
        analysis = lookup(registry, "analyses", case.run.analysis)
    if words := analysis.refuses(case.limits, case.load_case):
        raise CaseError(
            f"{case.where('run.analysis')}: {analysis.name}: {words}; take another analysis"
        )
    who = f"analysis '{analysis.name}' of {registry.sources['analyses'][analysis.name]}"

    def solve(
        solid: PrintedSolid, resolution: Resolution, say: Callable[[str], None]
    ) -> SolvedSolid:
        with blaming(who, always=False):
            return analysis.solve(solid, resolution, say)

    return replace(analysis, solve=solve)
