"""The result that a run folder already holds, which resuming reuses."""

from __future__ import annotations

import json
import logging
from dataclasses import replace
from pathlib import Path

from gradedesign.design.case.run_schema import RunSpec
from gradedesign.design.verdict.result import RunResult, from_json
from gradedesign.errors import CaseError
from gradedesign.program.outputs.files import RESULT_NAME
from gradedesign.program.store.manifest import read_manifest
from gradedesign.program.store.run_folder import RunFolder

log = logging.getLogger(__name__)

#: What ends a run for good; a budget does where there is no more of it now.
_FOR_GOOD = ("tight", "enclosed", "stuck", "saturated", "solid", "stop_after")


def finished_result(out: RunFolder, budget: RunSpec) -> RunResult | None:
    """The stored result of the case of a folder, where another run could add nothing; else None.

    A run that failed goes on, and so does one that time or iterations ended if the case allows more
    of them now, or one whose files are missing or damaged.
    """
    if RESULT_NAME not in out.artefacts() or out.damaged_artefacts():
        return None
    try:
        stored = from_json(json.loads((out.path / RESULT_NAME).read_text(encoding="utf-8")))
    except (KeyError, TypeError, ValueError) as cause:
        log.warning("the result in %s is of another layout (%r); going on", out.path, cause)
        return None
    if stored.case_hash != out.case_hash or not _is_final(stored, budget):
        return None
    return replace(stored, folder=out.path)


def stored_result(folder: Path) -> RunResult:
    """The result that the run of a folder has written.

    Raises `CaseError` if the folder holds none, or one of another version.
    """
    path = folder / RESULT_NAME
    if read_manifest(folder) is None:
        raise CaseError(
            f"{folder} is no run folder: expected one that `gradedesign run` has written"
        )
    try:
        stored = from_json(json.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        raise CaseError(
            f"{folder} holds no {RESULT_NAME}: its run has not ended; go on with it by "
            f"`gradedesign run CASE --resume`"
        ) from None
    except (OSError, KeyError, TypeError, ValueError) as cause:
        raise CaseError(
            f"{path} cannot be read ({cause!r}): damaged, or of another version; run the case again"
        ) from None
    return replace(stored, folder=folder)


def _is_final(stored: RunResult, budget: RunSpec) -> bool:
    """Whether a run within the budget would end where the stored one did."""
    if stored.ended_by in _FOR_GOOD:
        return True
    if stored.ended_by == "iterations":
        return budget.max_iterations <= len(stored.iterations)
    if stored.ended_by == "time":
        return budget.time <= stored.budget["time_s"]
    return False
