"""Whole files or none: written beside the target, flushed to disk, then renamed over it."""

from __future__ import annotations

import errno
import os
import re
import secrets
import shutil
import sys
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gradedesign.errors import CaseError, GradeDesignError, ResourceError

#: Names of files that an interrupted write may leave behind; never a name that anyone would read.
UNFINISHED = re.compile(r"\..+\.[0-9a-f]{16}\.unfinished")

_CASE_ERRNOS = frozenset(
    {
        errno.EACCES,
        errno.EPERM,
        errno.EROFS,
        errno.ENOENT,
        errno.ENOTDIR,
        errno.EISDIR,
        errno.ENAMETOOLONG,
        errno.ELOOP,
    }
)
#: First date that a ZIP entry can have: equal arrays give equal files.
_FIRST_ZIP_DATE = (1980, 1, 1, 0, 0, 0)


def write_error(path: Path, cause: OSError) -> GradeDesignError:
    """Translate a failed write.

    ``path``: the file that was to be written. ``cause``: the error of the system. Returns
    GradeDesignError: `CaseError` where the place is wrong (missing, read-only, not a folder), else
    `ResourceError` (the disk is full, a quota, a failing device).
    """
    reason = cause.strerror or str(cause)
    if cause.errno in _CASE_ERRNOS:
        return CaseError(
            f"cannot write {path}: {reason}; expected an existing folder that you may write in, "
            "name another output folder"
        )
    return ResourceError(f"cannot write {path}: {reason}; free disk space and resume the run")


def is_folder(path: Path) -> bool:
    """Tell whether there is a folder of that name.

    Raises `CaseError` if no folder can have it: too long, not allowed, a byte 0.
    """
    try:
        return path.is_dir()
    except OSError as cause:
        raise write_error(path, cause) from cause
    except ValueError as cause:
        raise CaseError(f"{str(path)!r} cannot be the name of a folder: {cause}") from cause


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """Open a file that appears under its name only once it is complete on disk.

    Raises `CaseError` if the folder is missing or may not be written in, and `ResourceError` if the
    disk is full.

    ``path``: the target; an existing file stays as it is until the new one replaces it. Yields
    binary file: open for reading and writing, so that a checksum can be taken before closing.
    """
    unfinished = path.with_name(f".{path.name}.{secrets.token_hex(8)}.unfinished")
    try:
        with unfinished.open("x+b") as handle:
            yield handle
            handle.flush()
            os.fsync(handle.fileno())
        unfinished.replace(path)
        _flush_folder(path.parent)
    except OSError as cause:
        raise write_error(path, cause) from cause
    finally:
        # Gone already after a successful rename; otherwise nothing half-written may stay.
        with suppress(OSError):
            unfinished.unlink()


@contextmanager
def replacing_path(path: Path) -> Iterator[Path]:
    """Like `replacing`, for writers that take a path and may look at its name or suffix.

    Raises `CaseError` or `ResourceError` as `replacing`.

    ``path``: the target.

    Yields
    ------
    Path
        Of the same name in an empty folder beside the target; the file written there replaces the
        target, the folder goes.
    """
    folder = path.with_name(f".{path.name}.{secrets.token_hex(8)}.unfinished")
    try:
        folder.mkdir()
        unfinished = folder / path.name
        yield unfinished
        with unfinished.open("rb") as handle:
            os.fsync(handle.fileno())
        unfinished.replace(path)
        _flush_folder(path.parent)
    except OSError as cause:
        raise write_error(path, cause) from cause
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _flush_folder(folder: Path) -> None:
    """Make a rename survive a power cut, where the file system lets folders be flushed."""
    if sys.platform == "win32":
        return  # a folder cannot be opened there
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as cause:
        if cause.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
    finally:
        os.close(descriptor)


def write_bytes(path: Path, data: bytes) -> None:
    """Write bytes atomically; errors as `replacing`."""
    with replacing(path) as handle:
        handle.write(data)


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text atomically, whatever the locale says; errors as `replacing`."""
    write_bytes(path, text.encode("utf-8"))


def write_npz(path: Path, /, **arrays: ArrayLike) -> None:
    """Write named arrays as an uncompressed ``.npz``, atomically.

    Raises `ValueError` if an array holds Python objects, and `CaseError` or `ResourceError` as
    `replacing`.
    """
    with replacing(path) as handle:
        write_arrays(handle, arrays)


def write_arrays(
    handle: BinaryIO, arrays: Mapping[str, ArrayLike], *, comment: bytes = b""
) -> None:
    """Write an ``.npz`` archive whose bytes depend on nothing but its arguments.

    Unlike `numpy.savez` it stores no time, so that equal content has an equal checksum and a clock
    before 1980 does no harm.
    """
    with zipfile.ZipFile(handle, "w", zipfile.ZIP_STORED) as archive:
        archive.comment = comment
        for name, value in arrays.items():
            member = zipfile.ZipInfo(f"{name}.npy", date_time=_FIRST_ZIP_DATE)
            with archive.open(member, "w", force_zip64=True) as stream:
                np.lib.format.write_array(stream, np.asanyarray(value), allow_pickle=False)


def read_npz(path: Path) -> dict[str, NDArray[Any]]:
    """Read all arrays of an ``.npz``.

    Raises `OSError` if the file cannot be read, and `ValueError` if it is not an ``.npz``, is
    damaged, or holds Python objects, which are never loaded.
    """
    with path.open("rb") as handle:
        if not zipfile.is_zipfile(handle):
            raise ValueError(f"{path} is not an .npz archive, or is truncated")
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except (zipfile.BadZipFile, EOFError, KeyError) as cause:
        raise ValueError(f"{path} is not a complete .npz archive: {cause}") from cause
