"""The verdict on how the printed solid is made, added to that of the analyses."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from gradedesign.design.printing.print_checks import (
    broken_words,
    print_data,
    print_rows,
    print_warnings,
)
from gradedesign.design.printing.print_schema import PrintSpec
from gradedesign.design.printing.printability import Printability
from gradedesign.design.printing.wall_thickness import WallThickness
from gradedesign.design.verdict.result import RunResult


def with_print_limits(
    result: RunResult,
    spec: PrintSpec | None,
    printability: Printability | None,
    *,
    designed: bool = True,
) -> RunResult:
    """The result with the limits of ``[print.limits]``; a design that breaks one is not met.

    Sizing knows ``min_wall`` alone, so that no further iteration would mend the others.

    ``designed``: whether the case made the body, so that its keys help.
    """
    rows = print_rows(spec, printability)
    broken = broken_words(rows, helps=designed)
    status, reason, lightest = result.status, result.reason, result.lightest
    if broken:
        reason = f"{reason}; {'but' if status == 'met' else 'and'} {broken}"
        status, lightest = "not_met", False
    return replace(
        result,
        status=status,
        lightest=lightest,
        reason=reason,
        limits=(*result.limits, *rows),
        measures={**result.measures, **print_data(printability)},
        warnings=(*result.warnings, *print_warnings(spec, printability)),
    )


def thickness_data(thickness: WallThickness) -> dict[str, Any]:
    """Plain data on the thickness of the printed file."""
    members = dict(thickness.of_phase_mm)
    return {
        "thickness_percentiles_mm": dict(thickness.percentiles_mm),
        **({"members_thickness_percentiles_mm": members} if members else {}),
        "thickness_method": thickness.method,
        "thickness_rays": thickness.rays,
    }
