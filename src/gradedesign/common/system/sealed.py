"""Files of arrays with an integrity check: an ``.npz`` ending in its own SHA-256."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gradedesign.common.system.atomic import read_npz, replacing, write_arrays

_SEAL = b"gradedesign sha256 "
#: Hexadecimal digits of SHA-256.
_DIGEST = 64
_HEADER = "header.json"
#: Bytes that are hashed at a time: a file is never in memory as a whole. Chosen, not measured.
_BLOCK = 1 << 20


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SealedArrays:
    """Content of a sealed file."""

    header: Mapping[str, Any]  #: The JSON values stored with the arrays.
    arrays: Mapping[str, NDArray[Any]]


def write_sealed(path: Path, header: Mapping[str, object], arrays: Mapping[str, ArrayLike]) -> None:
    """Write arrays and a JSON header with a checksum over every byte, atomically.

    The file is a valid ``.npz``: the checksum sits in the archive's comment, its last bytes, and so
    can be verified before anything is parsed. Raises `ValueError` if an array holds objects, is
    named like the header, or the header is not JSON, and `CaseError` or `ResourceError` as
    `gradedesign.common.system.atomic.replacing`.
    """
    if _HEADER in arrays:
        raise ValueError(f"an array may not be named {_HEADER!r}")
    text = json.dumps(dict(header), sort_keys=True, allow_nan=False).encode("utf-8")
    content = {_HEADER: np.frombuffer(text, dtype=np.uint8), **arrays}
    with replacing(path) as handle:
        write_arrays(handle, content, comment=_SEAL + b"0" * _DIGEST)
        length = handle.seek(0, os.SEEK_END) - _DIGEST
        digest = _digest(handle, length)
        handle.seek(length)
        handle.write(digest)


def read_sealed(path: Path) -> SealedArrays:
    """Read a sealed file, verifying its checksum first.

    Raises `OSError` if the file cannot be read, and `ValueError` if it is truncated, altered or not
    sealed.
    """
    with path.open("rb") as handle:
        length = handle.seek(0, os.SEEK_END) - _DIGEST
        handle.seek(max(0, length - len(_SEAL)))
        if handle.read(len(_SEAL)) != _SEAL:
            raise ValueError(f"{path} does not end in a checksum: truncated or altered")
        stored = handle.read(_DIGEST)
        if _digest(handle, length) != stored:
            raise ValueError(f"{path} does not match its checksum: truncated or altered")
    arrays = read_npz(path)
    if _HEADER not in arrays:
        raise ValueError(f"{path} has no header")
    header = json.loads(arrays.pop(_HEADER).tobytes())
    return SealedArrays(header=header, arrays=arrays)


def _digest(handle: BinaryIO, length: int) -> bytes:
    """Return the hexadecimal SHA-256 of the first ``length`` bytes."""
    handle.seek(0)
    digest = hashlib.sha256()
    remaining = length
    while remaining > 0:
        block = handle.read(min(_BLOCK, remaining))
        if not block:
            break
        digest.update(block)
        remaining -= len(block)
    return digest.hexdigest().encode("ascii")
