"""Origin of a result: date, version, checksums of what was read and printed ."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from types import MappingProxyType

from gradedesign.design.verdict.result import RunResult
from gradedesign.program.store.manifest import measure_artefact


def stamped(
    result: RunResult, read: Iterable[Path], printed: Mapping[str, str] = MappingProxyType({})
) -> RunResult:
    """The result with its date, the version that made it, and the checksums of files.

    None of them enters the hash of the case: a finished run that is resumed keeps its own.

    ``read``: files whose checksums are taken, where they are still there. ``printed``: checksums of
    the files of the printed lattice, by name.
    """
    return replace(
        result,
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        version=metadata.version("gradedesign"),
        checksums={
            "part": {path.name: measure_artefact(path).sha256 for path in read if path.is_file()},
            "print": dict(printed),
        },
    )
