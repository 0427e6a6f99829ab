"""The arrays of a VTU file, decoded within a memory budget and checked against its header.

Inline and appended data, as text, base64 or raw bytes, plain or compressed with zlib or lzma, are
read (VTK file formats, kitware, "XML file formats").
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from gradedesign import CaseError, ResourceError
from gradedesign_volumes._vtu_data import Damaged, VtuFile, decoded, whole

_APPENDED = re.compile(rb"<AppendedData\b([^>]*)>\s*_")
_ENCODING = re.compile(rb"""encoding\s*=\s*["'](raw|base64)["']""")
_END = b"</AppendedData>"
#: Memory for every byte of a file: it, its text, and numbers written as text.
_BYTES_PER_BYTE = 12


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


def read_vtu_pieces(path: Path, memory_limit_bytes: int) -> list[VtuPiece]:
    """Read a VTU file.

    Parameters
    ----------
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
        file = VtuFile(
            name=path.name,
            order=order,
            header=np.dtype(f"{order}u{8 if root.get('header_type') == 'UInt64' else 4}"),
            compressor=root.get("compressor"),
            appended=appended,
            encoding=encoding,
            remaining_bytes=memory_limit_bytes - size * _BYTES_PER_BYTE,
        )
        pieces = [_piece(file, piece) for piece in root.iterfind("UnstructuredGrid/Piece")]
    except Damaged as error:
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
            raise Damaged("appended data that do not end, or neither raw nor base64")
        appended, encoding = raw[section.end() : end], named[1].decode("ascii")
        raw = raw[: section.end() - 1] + raw[end:]
    if b"<!" in raw.replace(b"<!--", b"").replace(b"<![CDATA[", b""):
        raise Damaged("it declares a document type, which a VTU file has not")
    try:
        root = ElementTree.fromstring(raw)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        # ValueError and LookupError are of an encoding that is not known.
        raise Damaged(str(error)) from error
    if root.tag != "VTKFile" or root.get("type") != "UnstructuredGrid":
        raise Damaged(
            f"found {root.tag} of type {root.get('type')}, expected VTKFile of UnstructuredGrid"
        )
    return root, appended, encoding


def _piece(file: VtuFile, piece: ElementTree.Element) -> VtuPiece:
    """Decode one piece and compare its arrays with each other."""
    count, cells = whole(piece, "NumberOfPoints"), whole(piece, "NumberOfCells")
    points = [decoded(file, a) for a in piece.iterfind("Points/DataArray")]
    if len(points) != 1 or points[0].shape != (count, 3):
        shapes = [p.shape for p in points]
        raise Damaged(f"points of shape {shapes}, expected {count} of 3 coordinates")
    inner = {
        str(a.get("Name")): decoded(file, a).reshape(-1) for a in piece.iterfind("Cells/DataArray")
    }
    missing = [name for name in ("connectivity", "offsets", "types") if name not in inner]
    if missing:
        raise Damaged(f"cells without {', '.join(missing)}")
    if any(inner[name].dtype.kind not in "iu" for name in ("connectivity", "offsets", "types")):
        raise Damaged("cells numbered by something else than whole numbers")
    connectivity, offsets, types = (
        inner[name].astype(np.int64) for name in ("connectivity", "offsets", "types")
    )
    if offsets.shape != (cells,) or types.shape != (cells,):
        raise Damaged(f"{len(offsets)} offsets and {len(types)} types of {cells} cells")
    ends = np.concatenate([[0], offsets])
    if (np.diff(ends) < 0).any() or ends[-1] != len(connectivity):
        raise Damaged("offsets of cells that do not fit their corners")
    if len(connectivity) and not 0 <= connectivity.min() <= connectivity.max() < count:
        raise Damaged(
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
    file: VtuFile, piece: ElementTree.Element, group: str, count: int
) -> dict[str, NDArray[Any]]:
    """Fields of a piece; texts are passed over."""
    fields = {}
    for array in piece.iterfind(f"{group}/DataArray"):
        if array.get("type") == "String":
            continue
        name, values = str(array.get("Name")), decoded(file, array)
        if len(values) != count:
            raise Damaged(f"{len(values)} values of '{name}', expected {count}")
        fields[name] = values
    return fields
