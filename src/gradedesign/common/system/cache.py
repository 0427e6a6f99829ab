"""The user's cache: arrays that cost minutes to compute, found again by their content."""

from __future__ import annotations

import hashlib
import logging
import re
import struct
import time
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from platformdirs import user_cache_path

from gradedesign.common.system.atomic import UNFINISHED, write_error
from gradedesign.common.system.sealed import read_sealed, write_sealed
from gradedesign.errors import CaseError, ResourceError

log = logging.getLogger(__name__)

#: Types of which a content key can be made.
_KeyPart: TypeAlias = bytes | str | float | int | NDArray[Any]

_KIND = re.compile(r"[a-z0-9][a-z0-9-]*")
_KEY = re.compile(r"[0-9a-f]{64}")
#: Nobody writes an entry for so long, s. Chosen, not measured.
_ABANDONED_S = 86_400.0
_PLAIN_KINDS = frozenset("biufcSU")


def cache_folder() -> Path:
    """Return the user's cache folder of gradedesign, which need not exist yet.

    Where the system keeps caches; ``$XDG_CACHE_HOME/gradedesign`` where that is set. Raises
    `CaseError` if there is no home folder either.
    """
    try:
        return user_cache_path("gradedesign", appauthor=False)
    except RuntimeError as cause:
        raise CaseError(
            "no home folder for the cache; set XDG_CACHE_HOME to a folder you may write in"
        ) from cause


def content_key(*parts: _KeyPart) -> str:
    """Return the SHA-256 of a sequence of values, in hexadecimal.

    Type, length, shape and dtype count: ``1``, ``1.0``, ``True``, ``"1"`` and ``[1.0]`` have
    different keys, and so have ``("ab", "c")`` and ``("a", "bc")``. Raises `TypeError` for any
    other type, and for arrays that hold objects or records.
    """
    digest = hashlib.sha256()
    for part in parts:
        tag, data = _encoded(part)
        digest.update(tag + b":" + str(len(data)).encode("ascii") + b":")
        digest.update(data)
    return digest.hexdigest()


def _encoded(part: _KeyPart) -> tuple[bytes, bytes | memoryview]:
    """Return a tag that names the type (and shape) and the bytes of the value."""
    if isinstance(part, bytes):
        return b"bytes", part
    if isinstance(part, str):
        return b"text", part.encode("utf-8", "surrogatepass")
    if isinstance(part, bool | np.bool_):
        return b"bool", b"1" if part else b"0"
    if isinstance(part, int | np.integer):
        return b"int", str(int(part)).encode("ascii")
    if isinstance(part, float | np.floating):
        return b"float", struct.pack("<d", float(part))
    if isinstance(part, np.ndarray) and part.dtype.kind in _PLAIN_KINDS:
        tag = f"array {part.dtype.str} {part.shape}".encode("ascii")
        return tag, np.ascontiguousarray(part).reshape(-1).view(np.uint8).data
    kind = f"array of {part.dtype}" if isinstance(part, np.ndarray) else type(part).__name__
    raise TypeError(f"a content key cannot be made of {kind}")


def entry_path(kind: str, key: str) -> Path:
    """Return where an entry is kept.

    Raises `ValueError` if ``kind`` is not lower case with dashes or ``key`` not from `content_key`.
    """
    if not _KIND.fullmatch(kind):
        raise ValueError(f"cache kind {kind!r} is not lower case with dashes")
    if not _KEY.fullmatch(key):
        raise ValueError(f"cache key {key!r} is not a SHA-256 in hexadecimal")
    return cache_folder() / kind / key[:2] / f"{key}.npz"


def load_arrays(kind: str, key: str) -> dict[str, NDArray[Any]] | None:
    """Return the arrays of an entry, or None.

    A damaged entry is logged, removed and counts as absent: everything here can be computed again.
    """
    path = entry_path(kind, key)
    try:
        sealed = read_sealed(path)
    except FileNotFoundError:
        return None
    except OSError as cause:
        log.warning("cannot read cache entry %s (%s); computing again", path, cause)
        return None
    except ValueError as cause:
        log.warning("removing a damaged cache entry: %s; computing again", cause)
        with suppress(OSError):
            path.unlink()
        return None
    if sealed.header != {"kind": kind, "key": key}:
        log.warning("cache entry %s belongs to %s; computing again", path, dict(sealed.header))
        return None
    return dict(sealed.arrays)


def store_arrays(kind: str, key: str, /, **arrays: ArrayLike) -> None:
    """Store the arrays of an entry, atomically.

    A full disk or a read-only cache costs time in the next run, not the result of this one, so it
    is logged as a warning.
    """
    path = entry_path(kind, key)
    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        _remove_abandoned(path.parent)
        write_sealed(path, {"kind": kind, "key": key}, arrays)
    except OSError as cause:
        log.warning("nothing cached: %s", write_error(path, cause))
    except (CaseError, ResourceError) as cause:
        log.warning("nothing cached: %s", cause)


def _remove_abandoned(folder: Path) -> None:
    """Remove what killed processes were writing into a folder of the cache, a day ago or more."""
    for leftover in folder.glob(".*.unfinished"):
        if UNFINISHED.fullmatch(leftover.name):
            with suppress(OSError):
                if time.time() - leftover.stat().st_mtime > _ABANDONED_S:
                    leftover.unlink()
