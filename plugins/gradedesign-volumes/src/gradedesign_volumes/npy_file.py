"""One array from a ``.npy`` file, checked against the file's size before it is read."""

from __future__ import annotations

import ast
import math
import re
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from gradedesign import CaseError, ResourceError

_MAGIC = b"\x93NUMPY"
#: By major version of the format: how the length of the header is stored, and its text.
_VERSIONS = {1: ("<H", "latin-1"), 2: ("<I", "latin-1"), 3: ("<I", "utf-8")}
#: Bytes of a header; numpy itself refuses longer ones unless told otherwise.
_LONGEST_HEADER = 10_000
_NUMBERS = re.compile(r"[<>|=]?[fiub][0-9]{1,2}")
#: The most axes that numpy 1 allows.
_MOST_AXES = 32
#: More than any file can hold.
_MOST_VALUES = 1 << 63


@dataclass(frozen=True, slots=True, kw_only=True)
class _Header:
    """Header of a file: type, order and shape of its array."""

    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    fortran_order: bool


def read_npy(path: Path, *, memory_limit_bytes: int, bytes_per_value: int) -> NDArray[np.generic]:
    """Read an array of numbers; nothing in the file is run.

    Parameters
    ----------
    memory_limit_bytes : int
        Bytes that reading and using the array may take.
    bytes_per_value : int
        Bytes that using it takes, beside the array itself.

    Returns
    -------
    array

    Raises
    ------
    CaseError
        If the file cannot be read, is no ``.npy`` file, or has not as many bytes as it says.
    ResourceError
        If the array takes more memory.
    """
    try:
        with path.open("rb") as file:
            return read_npy_stream(
                file,
                path.name,
                path.stat().st_size,
                memory_limit_bytes=memory_limit_bytes,
                bytes_per_value=bytes_per_value,
            )
    except OSError as error:
        raise CaseError(f"{path.name} cannot be read as a .npy array: {error.strerror}") from error


def read_npy_stream(
    file: IO[bytes], name: str, length: int, *, memory_limit_bytes: int, bytes_per_value: int
) -> NDArray[np.generic]:
    """Read an array from a stream of ``length`` bytes; errors as of `read_npy`."""
    header = _header(file, name)
    count, size = math.prod(header.shape), header.dtype.itemsize
    remaining = length - file.tell()
    if count * size != remaining:
        raise CaseError(
            f"{name} cannot be read as a .npy array: it states {_times(header.shape)} "
            f"= {count:.4g} values of {size} bytes, {count * size:.4g} bytes, but "
            f"{remaining:.4g} bytes follow: truncated or altered; write it again"
        )
    need = count * (size + bytes_per_value)
    if need > memory_limit_bytes:
        raise ResourceError(
            f"{name} holds {_times(header.shape)} = {count:.4g} values, which take "
            f"about {need / 1e9:.3g} GB; found run.memory of "
            f"{memory_limit_bytes / 1e9:.3g} GB; raise it or write a coarser map"
        )
    content = bytearray(count * size)
    if file.readinto(content) != len(content) or file.read(1):  # type: ignore[attr-defined]
        raise CaseError(
            f"{name} cannot be read as a .npy array: it has not the {remaining:.4g} bytes that it "
            f"states: truncated or altered; write it again"
        )
    values = np.frombuffer(content, header.dtype)
    return values.reshape(header.shape, order="F" if header.fortran_order else "C")


def _header(file: IO[bytes], name: str) -> _Header:
    """Read and check the header (NumPy enhancement proposal 1, version 3)."""
    start = file.read(8)
    if start[:6] != _MAGIC or len(start) < 8:
        start_words = "an .npz archive of arrays" if start[:2] == b"PK" else f"bytes {start[:6]!r}"
        raise CaseError(
            f"{name} cannot be read as a .npy array: it begins as {start_words}; expected what "
            f"numpy.save writes"
        )
    if start[6] not in _VERSIONS or start[7] != 0:
        raise CaseError(
            f"{name} cannot be read as a .npy array: version {start[6]}.{start[7]} of the "
            f"format, expected 1.0 to 3.0"
        )
    how, encoding = _VERSIONS[start[6]]
    try:
        (length,) = struct.unpack(how, file.read(struct.calcsize(how)))
        if length > _LONGEST_HEADER:
            raise CaseError(
                f"{name} cannot be read as a .npy array: its header has {length} bytes, expected "
                f"some hundred"
            )
        header = ast.literal_eval(file.read(length).decode(encoding).strip())
    except (struct.error, ValueError, TypeError, SyntaxError, MemoryError, RecursionError) as error:
        # What literal_eval says it raises; UnicodeDecodeError is a ValueError.
        raise CaseError(
            f"{name} cannot be read as a .npy array: its header is damaged ({error}); write it "
            f"again"
        ) from error
    return _checked(header, name)


def _checked(header: object, name: str) -> _Header:
    """Turn what the header says into the type and shape of an array of numbers."""
    if not isinstance(header, dict) or set(header) != {"descr", "fortran_order", "shape"}:
        raise CaseError(
            f"{name} cannot be read as a .npy array: its header is damaged, expected the keys "
            f"descr, fortran_order and shape; write it again"
        )
    descr, shape, fortran = header["descr"], header["shape"], header["fortran_order"]
    if not isinstance(descr, str) or not _NUMBERS.fullmatch(descr):
        raise CaseError(
            f"{name} cannot be read as a .npy array of numbers: its values are of type "
            f"{str(descr)[:40]!r}; expected floats or whole numbers"
        )
    try:
        dtype = np.dtype(descr)
    except TypeError as error:
        raise CaseError(
            f"{name} cannot be read as a .npy array: numpy has no type {descr!r}"
        ) from error
    if (
        not isinstance(shape, tuple)
        or len(shape) > _MOST_AXES
        or not all(type(n) is int and n >= 0 for n in shape)
        or not isinstance(fortran, bool)
        or math.prod(shape) >= _MOST_VALUES
    ):
        raise CaseError(
            f"{name} cannot be read as a .npy array: its header states the shape "
            f"{str(shape)[:60]} in order {str(fortran)[:20]}; expected a tuple of whole numbers"
        )
    return _Header(dtype=dtype, shape=shape, fortran_order=fortran)


def _times(shape: tuple[int, ...]) -> str:
    return " x ".join(f"{n:.6g}" for n in shape) or "1"
