"""The arrays of a VTU file, decoded within a budget of memory and checked against what it says.

Inline and appended data, as text, base64 or raw bytes, plain or compressed with zlib or lzma, are
read (VTK file formats, kitware, "XML file formats").
"""

from __future__ import annotations

import base64
import binascii
import lzma
import re
import warnings
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from gradedesign.errors import CaseError, ResourceError

_TYPES = {
    **{f"Float{8 * n}": f"f{n}" for n in (4, 8)},
    **{f"Int{8 * n}": f"i{n}" for n in (1, 2, 4, 8)},
    **{f"UInt{8 * n}": f"u{n}" for n in (1, 2, 4, 8)},
}
_APPENDED = re.compile(rb"<AppendedData\b([^>]*)>\s*_")
_ENCODING = re.compile(rb"""encoding\s*=\s*["'](raw|base64)["']""")
_END = b"</AppendedData>"
#: Memory for every byte of a file: it, its text, and numbers written as text.
_BYTES_PER_BYTE = 12
#: A dictionary of lzma needs no more, bytes.
_MOST_LZMA = 1 << 28


class _Damaged(Exception):  # noqa: N818 - becomes a CaseError that names the file
    """Something in the file contradicts itself or the format."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VtuPiece:
    """The arrays of one ``Piece``.

    Attributes
    ----------
    points : (n, 3) array
    connectivity : (k,) array of int64
    offsets, types : (m,) array of int64
        End of every cell in ``connectivity``, and VTK's number of its type.
    point_data, cell_data : mapping of str to (n,), (m,), (n, c) or (m, c) array
    """

    points: NDArray[Any]
    connectivity: NDArray[np.int64]
    offsets: NDArray[np.int64]
    types: NDArray[np.int64]
    point_data: Mapping[str, NDArray[Any]]
    cell_data: Mapping[str, NDArray[Any]]


@dataclass(slots=True, kw_only=True)
class _File:
    """State that all arrays of a file share, with the bytes of memory left for them."""

    name: str
    order: str
    header: np.dtype[Any]
    compressor: str | None
    appended: bytes
    encoding: str
    left: int


def read_vtu_pieces(path: Path, memory_limit_bytes: int) -> list[VtuPiece]:
    """Read a VTU file.

    Parameters
    ----------
    path : Path
    memory_limit_bytes : int
        For the file and its arrays.

    Raises
    ------
    CaseError
        If it cannot be read, is damaged, or written in a way that is not known.
    ResourceError
        If it, or its arrays as they say themselves, need more memory.
    """
    try:
        size = path.stat().st_size
        if size * _BYTES_PER_BYTE > memory_limit_bytes:
            raise ResourceError(
                f"{path.name} has {size / 1e6:.4g} MB, which take about "
                f"{size * _BYTES_PER_BYTE / 1e9:.3g} GB to read; found run.memory of "
                f"{memory_limit_bytes / 1e9:.3g} GB; raise it or write a coarser field"
            )
        raw = path.read_bytes()
    except OSError as error:
        raise CaseError(f"{path.name} cannot be read: {error.strerror}") from error
    try:
        root, appended, encoding = _parse(raw)
        order = ">" if root.get("byte_order") == "BigEndian" else "<"
        file = _File(
            name=path.name,
            order=order,
            header=np.dtype(f"{order}u{8 if root.get('header_type') == 'UInt64' else 4}"),
            compressor=root.get("compressor"),
            appended=appended,
            encoding=encoding,
            left=memory_limit_bytes - size * _BYTES_PER_BYTE,
        )
        pieces = [_piece(file, piece) for piece in root.iterfind("UnstructuredGrid/Piece")]
    except _Damaged as error:
        raise CaseError(
            f"{path.name} cannot be read as VTU: {error}; write it again, or choose another file"
        ) from error
    if not pieces:
        raise CaseError(f"{path.name} cannot be read as VTU: there is no Piece in it")
    return pieces


def _parse(raw: bytes) -> tuple[ElementTree.Element, bytes, str]:
    """The tree without appended data, and that data with its encoding."""
    appended, encoding = b"", "base64"
    section = _APPENDED.search(raw)
    if section:
        named = _ENCODING.search(section[1])
        end = raw.rfind(_END)
        if named is None or end < section.end():
            raise _Damaged("appended data that do not end, or neither raw nor base64")
        appended, encoding = raw[section.end() : end], named[1].decode("ascii")
        raw = raw[: section.end() - 1] + raw[end:]
    if b"<!" in raw.replace(b"<!--", b"").replace(b"<![CDATA[", b""):
        raise _Damaged("it declares a document type, which a VTU file has not")
    try:
        root = ElementTree.fromstring(raw)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        # ValueError and LookupError are of an encoding that is not known.
        raise _Damaged(str(error)) from error
    if root.tag != "VTKFile" or root.get("type") != "UnstructuredGrid":
        raise _Damaged(
            f"found {root.tag} of type {root.get('type')}, expected VTKFile of UnstructuredGrid"
        )
    return root, appended, encoding


def _piece(file: _File, piece: ElementTree.Element) -> VtuPiece:
    """Decode one piece and compare its arrays with each other."""
    count, cells = _whole(piece, "NumberOfPoints"), _whole(piece, "NumberOfCells")
    points = [_decoded(file, a) for a in piece.iterfind("Points/DataArray")]
    if len(points) != 1 or points[0].shape != (count, 3):
        shapes = [p.shape for p in points]
        raise _Damaged(f"points of shape {shapes}, expected {count} of 3 coordinates")
    inner = {
        str(a.get("Name")): _decoded(file, a).reshape(-1) for a in piece.iterfind("Cells/DataArray")
    }
    missing = [name for name in ("connectivity", "offsets", "types") if name not in inner]
    if missing:
        raise _Damaged(f"cells without {', '.join(missing)}")
    if any(inner[name].dtype.kind not in "iu" for name in ("connectivity", "offsets", "types")):
        raise _Damaged("cells numbered by something else than whole numbers")
    connectivity, offsets, types = (
        inner[name].astype(np.int64) for name in ("connectivity", "offsets", "types")
    )
    if offsets.shape != (cells,) or types.shape != (cells,):
        raise _Damaged(f"{len(offsets)} offsets and {len(types)} types of {cells} cells")
    ends = np.concatenate([[0], offsets])
    if (np.diff(ends) < 0).any() or ends[-1] != len(connectivity):
        raise _Damaged("offsets of cells that do not fit their corners")
    if len(connectivity) and not 0 <= connectivity.min() <= connectivity.max() < count:
        raise _Damaged(
            f"cells with points {connectivity.min()} to {connectivity.max()}, but there are {count}"
        )
    return VtuPiece(
        points=points[0],
        connectivity=connectivity,
        offsets=offsets,
        types=types,
        point_data=_fields(file, piece, "PointData", count),
        cell_data=_fields(file, piece, "CellData", cells),
    )


def _fields(
    file: _File, piece: ElementTree.Element, group: str, count: int
) -> dict[str, NDArray[Any]]:
    """Fields of a piece; texts are passed over."""
    fields = {}
    for array in piece.iterfind(f"{group}/DataArray"):
        if array.get("type") == "String":
            continue
        name, values = str(array.get("Name")), _decoded(file, array)
        if len(values) != count:
            raise _Damaged(f"{len(values)} values of '{name}', expected {count}")
        fields[name] = values
    return fields


def _whole(element: ElementTree.Element, key: str) -> int:
    text = element.get(key, "0").strip()
    if not re.fullmatch(r"[0-9]{1,18}", text):
        raise _Damaged(f"{key} is {text[:30]!r}, expected a whole number")
    return int(text)


def _decoded(file: _File, array: ElementTree.Element) -> NDArray[Any]:
    """Values of a ``DataArray``, ``(n,)`` or with several components ``(n, c)``."""
    name, kind, how = array.get("Name"), array.get("type", ""), array.get("format", "ascii")
    if kind not in _TYPES:
        raise _Damaged(f"'{name}' is of type {kind!r}, expected one of {', '.join(_TYPES)}")
    dtype = np.dtype(file.order + _TYPES[kind])
    if how == "ascii":
        values = _from_text(array.text or "", dtype, name)
    elif how in ("binary", "appended"):
        data, encoding = file.appended, file.encoding
        if how == "binary":
            # Anything but ASCII is refused by what decodes it.
            data, encoding = (array.text or "").strip().encode("utf-8"), "base64"
        else:
            data = data[_whole(array, "offset") :]
        content = _unpacked(file, memoryview(data), encoding == "base64", name)
        if len(content) % dtype.itemsize:
            raise _Damaged(f"'{name}' has {len(content)} bytes of {dtype.itemsize} byte numbers")
        values = np.frombuffer(content, dtype)
    else:
        raise _Damaged(f"'{name}' has format {how!r}, expected ascii, binary or appended")
    parts = _whole(array, "NumberOfComponents") if array.get("NumberOfComponents") else 1
    if parts == 1:
        return values
    if parts == 0 or values.size % parts:
        raise _Damaged(f"'{name}' has {values.size} values of {parts} components")
    return values.reshape(-1, parts)


def _from_text(text: str, dtype: np.dtype[Any], name: str | None) -> NDArray[Any]:
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)  # how numpy reports what is no number
        try:
            return np.fromstring(text, dtype.newbyteorder("="), sep=" ")
        except (ValueError, DeprecationWarning) as error:
            raise _Damaged(f"'{name}' is not made of numbers: {error}") from error


def _unpacked(file: _File, data: memoryview, is_text: bool, name: str | None) -> bytes:
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


def _numbers(file: _File, head: bytes, count: int) -> list[int]:
    return [int(n) for n in np.frombuffer(head, file.header, count)]


def _require_present(
    data: memoryview, start: int, length: int, is_text: bool, name: str | None
) -> int:
    """Compare what is stated with what there is; return the characters of so many bytes."""
    chars = 4 * -(-length // 3) if is_text else length
    if start + chars > len(data):
        raise _Damaged(
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
        raise _Damaged(f"'{name}' is not in base64: {error}") from error
    if len(content) < length:
        raise _Damaged(f"'{name}' ends early in base64")
    return content[:length]


def _decompressed(compressor: str, part: bytes, length: int, name: str | None) -> bytes:
    """One block, of the length that is stated and no more."""
    try:
        if compressor == "vtkZLibDataCompressor":
            plain = zlib.decompressobj().decompress(part, length + 1)
        elif compressor == "vtkLZMADataCompressor":
            plain = lzma.LZMADecompressor(memlimit=_MOST_LZMA).decompress(part, length + 1)
        else:
            raise _Damaged(f"it is compressed by {compressor}, expected zlib, lzma or nothing")
    except (zlib.error, lzma.LZMAError) as error:
        raise _Damaged(f"a block of '{name}' cannot be decompressed: {error}") from error
    if len(plain) != length:
        raise _Damaged(f"a block of '{name}' does not have the {length} bytes it states")
    return plain


def _require_room(file: _File, length: int, name: str | None) -> None:
    """Account for an array, in bytes as decoded, joined and as 8 byte numbers."""
    needed = 6 * length
    if needed > file.left:
        raise ResourceError(
            f"{file.name}: '{name}' states {length / 1e9:.3g} GB, which take about "
            f"{needed / 1e9:.3g} GB to read; found {max(0, file.left) / 1e9:.3g} GB left of "
            f"run.memory; raise it or write a coarser field"
        )
    file.left -= needed
