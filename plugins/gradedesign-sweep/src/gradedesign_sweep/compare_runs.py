"""``gradedesign compare``: finished runs side by side, as tables, plain data and a page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gradedesign import CaseError
from gradedesign.commands import (
    RunResult,
    print_json,
    print_table,
    print_text,
    stored_result,
    write_text,
)
from gradedesign_sweep.compare_page import comparison_page
from gradedesign_sweep.comparison import Comparison, bodies_table, compared, margins_table
from gradedesign_sweep.table import BEST_WORDS, designs_table, limit_name, row_json, short


def compare(folders: Sequence[Path], output: Path | None, *, as_json: bool) -> None:
    """Print the comparison of finished runs, and write its page.

    Raises
    ------
    CaseError
        If there are fewer than two, one is named twice, or one is no folder of a run that has
        ended.
    """
    comparison = compared(_results(folders))
    if output is not None:
        page = comparison_page(comparison)
        write_text(output, page)
    if as_json:
        print_json(comparison_json(comparison))
        return
    print_comparison(comparison)
    if output is not None:
        print_text(f"page: {output}, {len(page) / 1e6:.2g} MB", hang=2)


def _results(folders: Sequence[Path]) -> list[RunResult]:
    """Results of the runs, their folders as they were named."""
    if len(folders) < 2:
        raise CaseError(f"{folders[0]} alone is no comparison: name two run folders or more")
    known: dict[Path, Path] = {}
    for folder in folders:
        place = folder.resolve()
        if place in known:
            raise CaseError(f"{folder} and {known[place]} are the same run; name each once")
        known[place] = folder
    return [stored_result(folder) for folder in folders]


def print_comparison(comparison: Comparison) -> None:
    """Print the tables, the verdicts and what stands in the way of comparing."""
    rows, best = comparison.rows, comparison.best
    print_table(f"{len(rows)} runs", *designs_table("run", rows, best))
    if best:
        print_text(BEST_WORDS, hang=2)
    print_table("What they weigh, by phase of the printed solid", *bodies_table(comparison))
    if comparison.has_limits:
        print_table(
            "Margins: what is left of the allowed value, by the unfavourable end of the band",
            *margins_table(comparison),
        )
    for row, result in zip(rows, comparison.results, strict=True):
        print_text(f"{row.number}: {result.verdict}", hang=3)
    for note in comparison.notes:
        print_text(f"note: {note}", hang=2)


def comparison_json(comparison: Comparison) -> dict[str, Any]:
    """The comparison as plain data."""
    runs = []
    for row, result in zip(comparison.rows, comparison.results, strict=True):
        data = row_json(row, comparison.best)
        governing = {limit_name(limit): limit for limit in result.limits}
        for limit in data["limits"]:
            used = limit["utilisation"]
            limit |= {
                "margin": None if used is None else short(1.0 - used),
                "load_case": governing[limit["name"]].load_case,
                "verdict": governing[limit["name"]].word,
            }
        runs.append(
            {
                "run": data.pop("design"),
                **data,
                "case": result.case_name,
                "cell": comparison.cells[row.number],
                "phases": {name: short(share) for name, share in comparison.phases(result).items()},
                "largest_utilisation": short(row.utilisation),
                "reason": result.reason,
            }
        )
    return {"runs": runs, "notes": list(comparison.notes)}
