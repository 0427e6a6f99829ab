"""``gradedesign report``: the report of a finished run, written again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from gradedesign.design.verdict.result import RunResult
from gradedesign.errors import CaseError
from gradedesign.program.commands.plugins import registry_for
from gradedesign.program.commands.show import print_text
from gradedesign.program.outputs.files import CASE_COPY, finished_run, write_result
from gradedesign.program.outputs.finished import stored_result
from gradedesign.program.outputs.report import REPORT
from gradedesign.program.store.stages import open_stages


def report(folder: Path) -> None:
    """Write it, and print the verdict and where it is."""
    result = report_again(folder)
    print_text(result.verdict, hang=2)
    print_text(f"report: {folder / result.files['report']}", hang=2)


def report_again(folder: Path) -> RunResult:
    """Write ``report.html`` of the result, pictures and scene in a run folder.

    Raises CaseError if the folder holds no finished run, or one of an earlier version.
    """
    result = stored_result(folder)
    if not (folder / CASE_COPY).is_file():
        raise CaseError(
            f"{folder} holds no {CASE_COPY}: its run is of an earlier version; run the case again"
        )
    files = dict(result.files)
    with open_stages(folder, result.case_hash, resume=True, overwrite=False) as out:
        to = out, registry_for(strict_plugins=False)
        REPORT.write(
            finished_run(to, out.path / CASE_COPY, files, lambda: replace(result, files=files))
        )
        result = replace(result, files=files)
        write_result(out, result)
    return result
