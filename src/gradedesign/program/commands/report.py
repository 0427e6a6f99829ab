"""``gradedesign report``: the report of a finished run, written again."""

from __future__ import annotations

from pathlib import Path

from gradedesign.program.commands.show import print_text
from gradedesign.program.outputs.report_again import report_again


def report(folder: Path) -> None:
    """Write it, and print the verdict and where it is."""
    result = report_again(folder)
    print_text(result.verdict, hang=2)
    print_text(f"report: {folder / result.files['report']}", hang=2)
