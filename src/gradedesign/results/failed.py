"""The result of a run that a named error stopped."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

from gradedesign.case.generate_schema import GenerateCase
from gradedesign.case.schema import Case
from gradedesign.errors import GradeDesignError
from gradedesign.loop.iteration import DesignIteration
from gradedesign.output.report import render_report
from gradedesign.output.result import RunResult
from gradedesign.results.files import REPORT_NAME, RESULT_NAME, write_result
from gradedesign.results.provenance import stamped
from gradedesign.workspace.run_folder import RunFolder


@contextmanager
def recording_failure(
    out: RunFolder,
    case: Case | GenerateCase,
    timing: Callable[[], dict[str, float]],
    finished: Sequence[DesignIteration] = (),
) -> Iterator[None]:
    """Write ``result.json`` with the status ``failed`` before a named error goes on.

    It has the rows of the last finished iteration, and then so does the report of the case.

    Parameters
    ----------
    out : RunFolder
    case : Case or GenerateCase
    timing : callable
        Seconds of each stage so far.
    finished : sequence of DesignIteration
        Iterations so far, which the run goes on to add to.
    """
    try:
        yield
    except GradeDesignError as error:
        failed = RunResult(
            status="failed",
            ended_by="error",
            lightest=False,
            reason=f"{error}{_basis(finished)}",
            limits=finished[-1].rows if finished else (),
            iterations=tuple(each.summary for each in finished),
            case_hash=case.case_hash,
            case_name=case.name,
            folder=out.path,
            timing_s=timing(),
        )
        failed = stamped(out, case, failed)
        if finished and "report" in case.output.formats:
            failed = replace(failed, files={"report": REPORT_NAME, "result": RESULT_NAME})
            case_text = case.path.read_text(encoding="utf-8")
            out.write_text(REPORT_NAME, render_report(failed, {}, case_text))
        write_result(out, failed)
        raise


def _basis(finished: Sequence[DesignIteration]) -> str:
    """Words on where the rows of a failed run come from; none without an iteration."""
    if not finished:
        return ""
    return (
        f"; the limits are those of iteration {finished[-1].summary.number} by its explicit "
        f"analysis: no printed surface was accepted"
    )
