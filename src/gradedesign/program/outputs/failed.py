"""The result of a run that a named error stopped."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

from gradedesign.design.case.read_case import part_files
from gradedesign.design.case.schema import Case
from gradedesign.design.loop.iteration import DesignIteration
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.verdict.result import RunResult
from gradedesign.errors import GradeDesignError
from gradedesign.program.outputs.files import (
    RESULT_NAME,
    finished_run,
    stated_outputs,
    write_result,
)
from gradedesign.program.outputs.provenance import stamped
from gradedesign.program.store.run_folder import RunFolder


@contextmanager
def recording_failure(
    out: RunFolder,
    case: Case,
    registry: Registry,
    timing: Callable[[], dict[str, float]],
    finished: Sequence[DesignIteration] = (),
) -> Iterator[None]:
    """Write ``result.json`` with the status ``failed`` before a named error goes on.

    It has the rows of the last finished iteration, and then so have outputs such as the report.

    ``timing``: seconds of each stage so far. ``finished``: iterations so far, which the run goes on
    to add to.
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
        failed = stamped(failed, part_files(case.part))
        files: dict[str, str] = {}
        outputs = [
            output for output in stated_outputs(case.output.formats, registry) if output.last
        ]
        if finished and outputs:
            files["result"] = RESULT_NAME
            run = finished_run(
                (out, registry), case.path, files, lambda: replace(failed, files=files)
            )
            for output in outputs:
                output.write(run)
        write_result(out, replace(failed, files=files))
        raise


def _basis(finished: Sequence[DesignIteration]) -> str:
    """Words on where the rows of a failed run come from; none without an iteration."""
    if not finished:
        return ""
    return (
        f"; the limits are those of iteration {finished[-1].summary.number} by its explicit "
        f"analysis: no printed surface was accepted"
    )
