"""The folder of one run: every file accounted for, every stage resumable, one run at a time.

Above 300 lines: whoever changes what a folder holds must see lock, manifest and stages together.
"""

from __future__ import annotations

import hashlib
import logging
import re
import shutil
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike, NDArray

from gradedesign.common.system.atomic import (
    UNFINISHED,
    is_folder,
    write_error,
    write_text,
)
from gradedesign.common.system.sealed import read_sealed, write_sealed
from gradedesign.errors import CaseError, ResourceError
from gradedesign.program.store.manifest import (
    MANIFEST_NAME,
    Artefact,
    Manifest,
    measure_artefact,
    read_manifest,
    write_manifest,
)
from gradedesign.program.store.run_lock import LOCK_NAME, OWNER_NAME, RunLock

log = logging.getLogger(__name__)

STAGES = "stages"
#: Raised when the content of stored stages changes: those of other versions are computed anew.
_SCHEMA = 1
_STAGE_NAME = re.compile(r"[a-z0-9][a-z0-9._-]*")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunFolder:
    """An open run folder; close it, or use it in a ``with`` statement, to release its lock.

    The state is on disk: ``run.json`` names each artefact with its SHA-256 and is replaced after
    each is written; a file that is not in it does not exist. ``stages/`` holds what a resumed run
    starts from.
    """

    path: Path  #: Absolute.
    case_hash: str  #: Of the case this folder belongs to.
    _lock: RunLock = field(repr=False)

    def __enter__(self) -> RunFolder:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Release the lock; closing twice does no harm."""
        self._lock.release()

    def path_of(self, name: str) -> Path:
        """Return where an artefact lives, for writers that take a path; `adopt` it afterwards.

        Raises CaseError if the name leaves the folder, also through a link, or is reserved.

        ``name``: relative, with forward slashes; its folder is created.
        """
        parts = name.split("/")
        reserved = parts[0] in (MANIFEST_NAME, LOCK_NAME, OWNER_NAME, STAGES)
        if reserved or "\\" in name or "\0" in name or any(p in ("", ".", "..") for p in parts):
            raise CaseError(
                f"{name!r} cannot be the name of a file in run folder {self.path}: expected a "
                f"relative name below it, other than {MANIFEST_NAME}, {LOCK_NAME}, {OWNER_NAME} "
                f"and {STAGES}"
            )
        target = self.path.joinpath(*parts)
        # Checked before creating the folder, which could already be outside.
        if not target.resolve().is_relative_to(self.path):
            raise CaseError(f"{name!r} leaves run folder {self.path} through a link; remove it")
        _make_folder(target.parent, parents=True)
        return target

    def write_text(self, name: str, text: str) -> Path:
        """Write an artefact of UTF-8 text atomically and enter it in the manifest."""
        write_text(self.path_of(name), text)
        return self.adopt(name)

    def adopt(self, name: str, sha256: str | None = None) -> Path:
        """Enter a complete file that another writer put at `path_of` in the manifest.

        Raises CaseError if there is no such file. Raises ResourceError if the file is not the one
        that was written.

        ``sha256``: of the bytes that were written, where the writer knows it.
        """
        path = self.path_of(name)
        if not path.is_file():
            raise CaseError(f"{path} was not written, so it cannot be part of the run")
        entry = measure_artefact(path)
        if sha256 is not None:
            _require_same(path, entry.sha256, sha256)
        artefacts = {**self.artefacts(), name: entry}
        write_manifest(self.path, Manifest(case_hash=self.case_hash, artefacts=artefacts))
        return path

    def read_bytes(self, name: str) -> bytes:
        """Content of an artefact, as it was adopted.

        Raises ResourceError if the file is gone or is not the one that was written.
        """
        path = self.path_of(name)
        try:
            data = path.read_bytes()
        except OSError as cause:
            raise ResourceError(
                f"{path} cannot be read back ({cause.strerror}); check the disk, and leave the "
                "folder of a run alone while it runs"
            ) from cause
        _require_same(path, hashlib.sha256(data).hexdigest(), self.artefacts()[name].sha256)
        return data

    def artefacts(self) -> Mapping[str, Artefact]:
        """Return what the manifest holds, by name."""
        manifest = read_manifest(self.path)
        return {} if manifest is None else manifest.artefacts

    def checksums(self, names: Iterable[str]) -> dict[str, str]:
        """SHA-256 of those of the named files that the manifest holds."""
        written = self.artefacts()
        return {name: written[name].sha256 for name in names if name in written}

    def damaged_artefacts(self) -> tuple[str, ...]:
        """Return the names in the manifest whose file is missing or differs from its checksum."""
        return tuple(
            name
            for name, entry in self.artefacts().items()
            if not (self.path / name).is_file() or measure_artefact(self.path / name) != entry
        )

    def save_stage(
        self,
        name: str,
        key: str,
        arrays: Mapping[str, ArrayLike],
        meta: Mapping[str, object],
    ) -> None:
        """Store what a stage computed, so that a resumed run need not repeat it.

        ``name``: lower case, such as ``sizing-3``. ``key``:
        `gradedesign.common.system.cache.content_key` of everything that the stage depends on.
        ``meta``: JSON values.
        """
        header = {"schema": _SCHEMA, "stage": name, "key": key, "meta": dict(meta)}
        path = self._stage_path(name)
        _make_folder(path.parent)
        write_sealed(path, header, arrays)

    def load_stage(
        self, name: str, key: str
    ) -> tuple[Mapping[str, NDArray[Any]], Mapping[str, Any]] | None:
        """Return the arrays and meta of a stage stored under the same key, or None.

        A damaged stage, or one of another version, is logged as a warning and counts as absent.
        """
        path = self._stage_path(name)
        try:
            sealed = read_sealed(path)
        except FileNotFoundError:
            return None
        except (OSError, ValueError) as cause:
            log.warning("stage %s is damaged (%s); computing it again", name, cause)
            return None
        header = sealed.header
        if header.get("schema") != _SCHEMA or header.get("stage") != name:
            log.warning(
                "stage %s was written by another version (schema %s, expected %d); "
                "computing it again",
                name,
                header.get("schema"),
                _SCHEMA,
            )
            return None
        if header.get("key") != key:
            log.info("stage %s was computed from other input; computing it again", name)
            return None
        return sealed.arrays, header["meta"]

    def _stage_path(self, name: str) -> Path:
        """Return the file of a stage."""
        if not _STAGE_NAME.fullmatch(name):
            raise ValueError(f"stage name {name!r} is not lower case with dashes, dots or digits")
        return self.path / STAGES / f"{name}.npz"


def open_run_folder(path: Path, case_hash: str, *, resume: bool, overwrite: bool) -> RunFolder:
    """Open a folder for one run and lock it; create it below an existing folder.

    Raises CaseError if the folder cannot be written in, belongs to another case, is in use, or
    holds anything and neither ``resume`` nor ``overwrite`` was asked for.

    - ``path``: new, empty, or the folder of an earlier run
    - ``case_hash``: identifies the case and its part
    - ``resume``: go on with the stages of an earlier run of the same case
    - ``overwrite``: discard an earlier run: the files that its manifest names, and its stages
    """
    if resume and overwrite:
        raise CaseError("resume and overwrite exclude each other; choose one")
    folder = Path(path).absolute()
    if not is_folder(folder.parent):
        raise CaseError(f"cannot make run folder {folder}: {folder.parent} is not a folder")
    _make_folder(folder)
    folder = folder.resolve()
    lock = RunLock.acquire(folder)
    try:
        _prepare(folder, case_hash, resume=resume, overwrite=overwrite)
    except BaseException:
        lock.release()
        raise
    return RunFolder(path=folder, case_hash=case_hash, _lock=lock)


def _prepare(folder: Path, case_hash: str, *, resume: bool, overwrite: bool) -> None:
    """Check that the folder is free or the right one; leave it with a manifest."""
    _remove_unfinished(folder)
    try:
        manifest = read_manifest(folder)
    except CaseError:
        if not overwrite:
            raise
        manifest = None
    names = sorted(child.name for child in folder.iterdir())
    foreign = [name for name in names if name not in (LOCK_NAME, OWNER_NAME, MANIFEST_NAME)]
    advice = "take another folder=..., or discard what is there with overwrite=True"
    if manifest is None and foreign and not overwrite:
        raise CaseError(
            f"{folder} is not empty ({foreign[0]}, ...) and not the folder of a run; {advice}"
        )
    if manifest is not None and not overwrite:
        if manifest.case_hash != case_hash:
            raise CaseError(
                f"{folder} belongs to another case (hash {manifest.case_hash[:12]}, this case has "
                f"{case_hash[:12]}): the case or its part file changed; {advice}"
            )
        if foreign and not resume:
            raise CaseError(f"{folder} holds results already; go on with resume=True, or {advice}")
        if foreign:
            log.info("resuming the run in %s", folder)
            return
    if overwrite and MANIFEST_NAME in names:
        _discard(folder, {} if manifest is None else manifest.artefacts)
    write_manifest(folder, Manifest(case_hash=case_hash, artefacts={}))


def _require_same(path: Path, digest: str, written: str) -> None:
    """Refuse a file whose checksum is not that of what was written."""
    if digest != written:
        raise ResourceError(
            f"{path} changed after it was written: its SHA-256 is {digest[:12]}..., expected "
            f"{written[:12]}...; another program wrote there, or the disk is damaged. Nothing is "
            "judged on it: leave the folder of a run alone while it runs, and resume it"
        )


def _make_folder(folder: Path, *, parents: bool = False) -> None:
    """Create a folder unless it exists."""
    try:
        folder.mkdir(parents=parents, exist_ok=True)
    except FileExistsError as cause:
        raise CaseError(f"{folder} is a file, expected a folder; choose another name") from cause
    except OSError as cause:
        raise write_error(folder, cause) from cause


def _remove_unfinished(folder: Path) -> None:
    """Remove what a killed run was writing; nothing else can have such a name."""
    for leftover in list(folder.rglob(".*.unfinished")):
        if UNFINISHED.fullmatch(leftover.name):
            if leftover.is_dir() and not leftover.is_symlink():
                shutil.rmtree(leftover, ignore_errors=True)
                continue
            with suppress(OSError):
                leftover.unlink()


def _discard(folder: Path, artefacts: Mapping[str, Artefact]) -> None:
    """Remove an earlier run: only files that it is known to have written."""
    # The manifest goes last: killed half-way, the folder still knows what is its own.
    names = [*artefacts, *(f"{STAGES}/{p.name}" for p in (folder / STAGES).glob("*.npz"))]
    for name in names:
        target = folder / name
        if not target.parent.resolve().is_relative_to(folder):
            raise CaseError(f"{MANIFEST_NAME} names {name!r}, outside {folder}; remove it by hand")
        with suppress(FileNotFoundError):
            target.unlink()
    log.info("discarded %d files of an earlier run in %s", len(names), folder)
