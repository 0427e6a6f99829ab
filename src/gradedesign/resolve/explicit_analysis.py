"""The explicit analysis that a case names; what it raises names its plugin."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from gradedesign.case.locate import locating
from gradedesign.case.schema import Case
from gradedesign.errors import blaming
from gradedesign.plugin.registry import Registry, lookup
from gradedesign.verify.analysis import ExplicitAnalysis, Resolution, SolvedSolid
from gradedesign.verify.printed_solid import PrintedSolid


def explicit_analysis(case: Case, registry: Registry) -> ExplicitAnalysis:
    """Analysis of ``[run] analysis``.

    Raises
    ------
    CaseError
        With line and nearest spelling, if nothing installed supplies it.
    PluginError
        The same, when a plugin that might have supplied it is disabled.
    """
    with locating(case, "run.analysis"):
        analysis: ExplicitAnalysis = lookup(registry, "analyses", case.run.analysis)
    who = f"analysis '{analysis.name}' of {registry.sources['analyses'][analysis.name]}"

    def solve(
        solid: PrintedSolid, resolution: Resolution, say: Callable[[str], None]
    ) -> SolvedSolid:
        with blaming(who, always=False):
            return analysis.solve(solid, resolution, say)

    return replace(analysis, solve=solve)
