"""The result of a run that a named error stopped."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from gradedesign.case.generate_schema import GenerateCase
from gradedesign.case.schema import Case
from gradedesign.errors import GradeDesignError
from gradedesign.output.result import RunResult
from gradedesign.results.files import write_result
from gradedesign.workspace.run_folder import RunFolder


@contextmanager
def recording_failure(
    out: RunFolder, case: Case | GenerateCase, timing: Callable[[], dict[str, float]]
) -> Iterator[None]:
    """Write ``result.json`` with the status ``failed`` before a named error goes on.

    Parameters
    ----------
    out : RunFolder
    case : Case or GenerateCase
    timing : callable
        Seconds of each stage so far.
    """
    try:
        yield
    except GradeDesignError as error:
        failed = RunResult(
            status="failed",
            ended_by="error",
            lightest=False,
            reason=str(error),
            case_hash=case.case_hash,
            case_name=case.name,
            folder=out.path,
            timing_s=timing(),
        )
        write_result(out, failed)
        raise
