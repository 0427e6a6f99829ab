"""One array of a VTU file: from text, base64 or raw bytes, plain or compressed, to numbers."""

from __future__ import annotations

import base64
import binascii
import lzma
import re
import warnings
import zlib
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from gradedesign import ResourceError

_TYPES = {
    **{f"Float{8 * n}": f"f{n}" for n in (4, 8)},
    **{f"Int{8 * n}": f"i{n}" for n in (1, 2, 4, 8)},
    **{f"UInt{8 * n}": f"u{n}" for n in (1, 2, 4, 8)},
}
#: A dictionary of lzma needs no more, bytes. Chosen, not measured.
_MOST_LZMA = 1 << 28


class Damaged(Exception):  # noqa: N818 - becomes a CaseError that names the file
    """Something in the file contradicts itself or the format."""


@dataclass(slots=True, kw_only=True)
class VtuFile:
    """State that all arrays of a file share, with the bytes of memory left for them."""

    name: str
    order: str
    header: np.dtype[Any]
    compressor: str | None
    appended: bytes
    encoding: str
    remaining_bytes: int


def whole(element: ElementTree.Element, key: str) -> int:
    text = element.get(key, "0").strip()
    if not re.fullmatch(r"[0-9]{1,18}", text):
        raise Damaged(f"{key} is {text[:30]!r}, expected a whole number")
    return int(text)


def decoded(file: VtuFile, array: ElementTree.Element) -> NDArray[Any]:
    """Values of a ``DataArray``, ``(n,)`` or with several components ``(n, c)``."""
    name, kind, how = array.get("Name"), array.get("type", ""), array.get("format", "ascii")
    if kind not in _TYPES:
        raise Damaged(f"'{name}' is of type {kind!r}, expected one of {', '.join(_TYPES)}")
    dtype = np.dtype(file.order + _TYPES[kind])
    if how == "ascii":
        values = _from_text(array.text or "", dtype, name)
    elif how in ("binary", "appended"):
        data, encoding = file.appended, file.encoding
        if how == "binary":
            # The decoder refuses anything but ASCII.
            data, encoding = (array.text or "").strip().encode("utf-8"), "base64"
        else:
            data = data[whole(array, "offset") :]
        content = _unpacked(file, memoryview(data), encoding == "base64", name)
        if len(content) % dtype.itemsize:
            raise Damaged(f"'{name}' has {len(content)} bytes of {dtype.itemsize} byte numbers")
        values = np.frombuffer(content, dtype)
    else:
        raise Damaged(f"'{name}' has format {how!r}, expected ascii, binary or appended")
    parts = whole(array, "NumberOfComponents") if array.get("NumberOfComponents") else 1
    if parts == 1:
        return values
    if parts == 0 or values.size % parts:
        raise Damaged(f"'{name}' has {values.size} values of {parts} components")
    return values.reshape(-1, parts)


def _from_text(text: str, dtype: np.dtype[Any], name: str | None) -> NDArray[Any]:
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)  # numpy's remark on bad numbers
        try:
            return np.fromstring(text, dtype.newbyteorder("="), sep=" ")
        except (ValueError, DeprecationWarning) as error:
            raise Damaged(f"'{name}' is not made of numbers: {error}") from error


def _unpacked(file: VtuFile, data: memoryview, is_text: bool, name: str | None) -> bytes:
    """The bytes of an array: one block of a stated length, or several compressed ones."""
    size = file.header.itemsize
    if file.compressor is None:
        (length,) = _numbers(file, _taken(data, 0, size, is_text, name), 1)
        _require_present(data, 0, size + length, is_text, name)
        _require_room(file, length, name)
        return _taken(data, 0, size + length, is_text, name)[size:]
    blocks, block, last = _numbers(file, _taken(data, 0, 3 * size, is_text, name), 3)
    if blocks == 0:
        return b""
    head = (3 + blocks) * size
    packed = _numbers(file, _taken(data, 0, head, is_text, name), 3 + blocks)[3:]
    _require_room(file, (blocks - 1) * block + (last or block), name)
    start = 4 * -(-head // 3) if is_text else head
    content = _taken(data, start, sum(packed), is_text, name)
    result, at = bytearray(), 0
    for number, length in enumerate(packed):
        whole = last if number == blocks - 1 and last else block
        result += _decompressed(file.compressor, content[at : at + length], whole, name)
        at += length
    return bytes(result)


def _numbers(file: VtuFile, head: bytes, count: int) -> list[int]:
    return [int(n) for n in np.frombuffer(head, file.header, count)]


def _require_present(
    data: memoryview, start: int, length: int, is_text: bool, name: str | None
) -> int:
    """Refuse a stated length beyond the data; return the characters that encode so many bytes."""
    chars = 4 * -(-length // 3) if is_text else length
    if start + chars > len(data):
        raise Damaged(
            f"'{name}' says that it has {length} bytes more, but there are "
            f"{max(0, len(data) - start) * (3 if is_text else 4) // 4}: truncated or altered"
        )
    return chars


def _taken(data: memoryview, start: int, length: int, is_text: bool, name: str | None) -> bytes:
    """Take so many bytes; of text the characters that stand for them are decoded."""
    chars = _require_present(data, start, length, is_text, name)
    part = bytes(data[start : start + chars])
    if not is_text:
        return part
    try:
        content = base64.b64decode(part, validate=True)
    except (binascii.Error, ValueError) as error:
        raise Damaged(f"'{name}' is not in base64: {error}") from error
    if len(content) < length:
        raise Damaged(f"'{name}' ends early in base64")
    return content[:length]


def _decompressed(compressor: str, part: bytes, length: int, name: str | None) -> bytes:
    """Decompress one block; refuse more bytes than it states."""
    try:
        if compressor == "vtkZLibDataCompressor":
            block = zlib.decompressobj().decompress(part, length + 1)
        elif compressor == "vtkLZMADataCompressor":
            block = lzma.LZMADecompressor(memlimit=_MOST_LZMA).decompress(part, length + 1)
        else:
            raise Damaged(f"it is compressed by {compressor}, expected zlib, lzma or nothing")
    except (zlib.error, lzma.LZMAError) as error:
        raise Damaged(f"a block of '{name}' cannot be decompressed: {error}") from error
    if len(block) != length:
        raise Damaged(f"a block of '{name}' does not have the {length} bytes it states")
    return block


def _require_room(file: VtuFile, length: int, name: str | None) -> None:
    """Account for an array, in bytes as decoded, joined and as 8 byte numbers."""
    needed = 6 * length
    if needed > file.remaining_bytes:
        raise ResourceError(
            f"{file.name}: '{name}' states {length / 1e9:.3g} GB, which take about "
            f"{needed / 1e9:.3g} GB to read; found {max(0, file.remaining_bytes) / 1e9:.3g} GB "
            f"left of run.memory; raise it or write a coarser field"
        )
    file.remaining_bytes -= needed
