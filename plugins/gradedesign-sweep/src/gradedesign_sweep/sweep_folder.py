"""The folder of a sweep: its tables, its plot, and a folder for each design.

A design's folder is named after the content of its case, so that a study that was extended or put
in another order finds what it computed before.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from gradedesign import CaseError
from gradedesign.commands import (
    RESULT_NAME,
    UNFINISHED,
    Case,
    RunLock,
    RunResult,
    finished_result,
    from_json,
    is_folder,
    open_stages,
    read_toml,
    toml_text,
    with_values,
    write_error,
    write_text,
)
from gradedesign_sweep.study import Design, Study

log = logging.getLogger(__name__)

TABLE, PLOT = "table", "tradeoff.png"
_DESIGNS, _CASE, _RUN = "designs", "case.toml", "run"
#: Digits of a case's hash that name a design's folder.
_DIGITS = 12


@contextmanager
def open_sweep(folder: Path) -> Iterator[Path]:
    """Make the folder of a sweep, or find an earlier one's, and hold it alone.

    Yields
    ------
    Path
        Absolute.

    Raises
    ------
    CaseError
        If it cannot be made, holds anything but a sweep, or another one is running there.
    """
    path = Path(folder).absolute()
    is_folder(path)  # names what no folder can be called
    try:
        path.mkdir(parents=True, exist_ok=True)
        names = {child.name for child in path.iterdir()}
    except OSError as cause:
        raise write_error(path, cause) from cause
    foreign = sorted(name for name in names if not name.startswith("."))
    if foreign and _DESIGNS not in names:
        raise CaseError(
            f"{path} is not empty ({foreign[0]}, ...) and not the folder of a sweep; take "
            f"another folder=..."
        )
    lock = RunLock.acquire(path)
    try:
        # What a killed sweep was writing; run folders see to their own.
        for place in (path, *path.glob(f"{_DESIGNS}/*")):
            for leftover in place.glob(".*.unfinished"):
                if UNFINISHED.fullmatch(leftover.name):
                    leftover.unlink(missing_ok=True)
        yield path
    finally:
        lock.release()


def design_name(design: Design) -> str:
    """The folder of a design below that of the sweep."""
    return f"{_DESIGNS}/{design.case.case_hash[:_DIGITS]}"


def run_folder(design_folder: Path) -> Path:
    """The run folder of a design."""
    return design_folder / _RUN


def design_case(design_folder: Path) -> Path:
    """The case file of a design."""
    return design_folder / _CASE


def write_design(folder: Path, study: Study, design: Design) -> Path:
    """Write the case of a design into its folder, and return that.

    It is the base case with the design's values and absolute paths of files: ``gradedesign run
    --allow-outside`` runs it.

    Raises
    ------
    CaseError, ResourceError
        If it cannot be written.
    """
    data = with_values(with_values(read_toml(study.base)[0], design.values), _files(design.case))
    target = folder / design_name(design)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as cause:
        raise write_error(target, cause) from cause
    write_text(design_case(target), toml_text(data))
    return target


def _files(case: Case) -> dict[str, str]:
    """Absolute paths of the files that a case names, by key."""
    own, orientation = case.lattice.own_cell, case.lattice.orientation
    files = {
        "part.file": case.part.file,
        "lattice.own_cell.file": None if own is None else own.file,
        "lattice.orientation.vtu": None if orientation is None else orientation.vtu,
    }
    return {key: str(file) for key, file in files.items() if file is not None}


def is_finished(design: Design, design_folder: Path) -> bool:
    """Whether the run of a design has nothing left to do."""
    folder = run_folder(design_folder)
    if not (folder / RESULT_NAME).is_file():
        return False
    try:
        with open_stages(folder, design.case.case_hash, resume=True, overwrite=False) as out:
            return finished_result(out, design.case.run) is not None
    except CaseError as error:
        # Damaged, or in use by a process that is about to end: its run will tell.
        log.info("%s: %s", folder, error)
        return False


def read_result(design_folder: Path) -> RunResult | None:
    """The result that the run of a design wrote; None where there is none of this version."""
    path = run_folder(design_folder) / RESULT_NAME
    try:
        return from_json(json.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        return None
    except (KeyError, TypeError, ValueError) as cause:
        log.warning("%s is damaged or of another version: %r", path, cause)
        return None


def earlier_seconds(folder: Path) -> dict[str, float]:
    """Seconds that designs took by the table of an earlier session, by folder."""
    try:
        data: dict[str, Any] = json.loads((folder / f"{TABLE}.json").read_text(encoding="utf-8"))
        return {
            str(row["folder"]): float(row["seconds"])
            for row in data["designs"]
            if row["seconds"] is not None
        }
    except FileNotFoundError:
        return {}
    except (KeyError, TypeError, ValueError, AttributeError) as cause:
        log.warning("the table in %s is damaged (%r); it is written again", folder, cause)
        return {}
