"""Origin of a result: date, version, checksums of what was read and printed ."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from datetime import UTC, datetime
from importlib import metadata

from gradedesign.design.case.read_case import part_files
from gradedesign.design.verdict.result import RunResult
from gradedesign.geometry.part.part_schema import PartSpec
from gradedesign.program.store.manifest import measure_artefact
from gradedesign.program.store.run_folder import RunFolder


def stamped(
    out: RunFolder, part: PartSpec, result: RunResult, printed: Iterable[str] = ()
) -> RunResult:
    """The result with its date, the version that made it, and the checksums of files.

    None of them enters the hash of the case: a finished run that is resumed keeps its own.

    ``part``: whose files are read again for their checksums. ``printed``: names of the files of the
    printed lattice; those that were not written are left out.
    """
    written = out.artefacts()
    return replace(
        result,
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        version=metadata.version("gradedesign"),
        checksums={
            "part": {
                path.name: measure_artefact(path).sha256
                for path in part_files(part)
                if path.is_file()
            },
            "print": {name: written[name].sha256 for name in printed if name in written},
        },
    )
