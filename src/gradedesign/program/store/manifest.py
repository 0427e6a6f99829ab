"""``run.json``: every file of a run with its checksum; a file not in it does not exist."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from gradedesign.common.system.atomic import write_text
from gradedesign.errors import CaseError

MANIFEST_NAME = "run.json"
#: Raised when the content of the manifest changes: runs of other versions are refused.
_SCHEMA = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Artefact:
    """A file as the manifest knows it."""

    sha256: str  #: Hexadecimal.
    size: int  #: Bytes.


@dataclass(frozen=True, slots=True, kw_only=True)
class Manifest:
    """Content of ``run.json``."""

    case_hash: str  #: Of the case that the folder belongs to.
    artefacts: Mapping[str, Artefact]  #: By name relative to the folder, with forward slashes.


def measure_artefact(path: Path) -> Artefact:
    """Return the checksum and size of a file."""
    with path.open("rb") as handle:
        digest = hashlib.file_digest(handle, "sha256").hexdigest()
    return Artefact(sha256=digest, size=path.stat().st_size)


def write_manifest(folder: Path, manifest: Manifest) -> None:
    """Replace ``run.json`` atomically."""
    content = {
        "schema": _SCHEMA,
        "case_hash": manifest.case_hash,
        "artefacts": {
            name: {"sha256": entry.sha256, "bytes": entry.size}
            for name, entry in sorted(manifest.artefacts.items())
        },
    }
    write_text(folder / MANIFEST_NAME, json.dumps(content, indent=2) + "\n")


def read_manifest(folder: Path) -> Manifest | None:
    """Read ``run.json``; None where there is none.

    Raises CaseError if it is damaged or of another version.
    """
    path = folder / MANIFEST_NAME
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        artefacts = {
            str(name): Artefact(sha256=str(entry["sha256"]), size=int(entry["bytes"]))
            for name, entry in content["artefacts"].items()
        }
        schema, case_hash = content["schema"], str(content["case_hash"])
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as cause:
        raise CaseError(
            f"{path} cannot be read ({cause!r}): damaged; discard the run with overwrite=True"
        ) from cause
    if schema != _SCHEMA:
        raise CaseError(
            f"{path} has schema {schema}, expected {_SCHEMA}: the run is of another version; "
            "discard it with overwrite=True"
        )
    return Manifest(case_hash=case_hash, artefacts=artefacts)
