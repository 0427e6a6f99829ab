"""Reading STL files, strictly: what is damaged is refused with the place and the reason."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import PartError
from gradedesign.geometry.formats._stl_ascii import parse_ascii
from gradedesign.geometry.part.raw_triangles import LARGEST_COORDINATE, RawTriangles, raw_triangles

log = logging.getLogger(__name__)

#: Bytes before the first triangle: 80 of text and the count.
_HEADER = 84
_RECORD = np.dtype([("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
#: Some exporters append a few bytes; more than this is not an afterthought. Chosen, not measured.
_MOST_TRAILING = 1024

#: First bytes of files that get renamed to .stl, lower case where they are text.
_MAGIC = (
    (b"\x89png", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"gif8", "a GIF picture"),
    (b"%pdf", "a PDF document"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"<!doctype html", "an HTML page"),
    (b"<html", "an HTML page"),
    (b"<?xml", "an XML file"),
    (b"iso-10303-21", "a STEP file"),
    (b"ply\n", "a PLY mesh"),
    (b"off\n", "an OFF mesh"),
    (b"gltf", "a glTF mesh"),
    (b"{", "a JSON file"),
)


def read_stl(path: Path) -> RawTriangles:
    """Read an ASCII or binary STL file.

    Facet normals are ignored: the order of the corners says where outside is.

    Returns RawTriangles: without a unit, which STL does not carry; with warnings about oddities
    that do not change the geometry. Raises PartError if the file is missing, damaged, empty or not
    STL.
    """
    name = path.name
    try:
        data = path.read_bytes()
    except OSError as error:
        raise PartError(
            f"{path}: cannot be read ({error.strerror}); check the file name"
        ) from error
    corners, warnings = parse_stl(data, name)
    log.info("%s: %d facets read", name, len(corners))
    return raw_triangles(corners, source=name, warnings=warnings)


def parse_stl(data: bytes, source: str) -> tuple[FloatArray, list[str]]:
    """Decode the bytes of an STL file into corners ``(m, 3, 3)`` in file units, and warnings."""
    if not data:
        raise PartError(f"{source}: empty file (0 bytes); export the part again")
    if _declared_size(data) == len(data):  # also binary files whose header starts with "solid"
        return _parse_binary(data, source)
    if _is_ascii_stl(data):
        return parse_ascii(data, source), []
    format_name = _looks_like(data)
    if format_name is not None:
        raise PartError(f"{source}: not STL, looks like {format_name}; export the part as STL")
    if len(data) < _HEADER:
        raise PartError(
            f"{source}: truncated header: the file has {len(data)} bytes, "
            f"a binary STL at least {_HEADER}; export the part again"
        )
    return _parse_binary(data, source)


def binary_records(data: bytes) -> bytes:
    """Triangles of the bytes of a binary STL file, 50 bytes each; empty for other files."""
    size = _declared_size(data)
    return data[_HEADER:size] if size <= len(data) else b""


def _declared_size(data: bytes) -> int:
    """Bytes that a binary STL with this header should have; 0 if there is no header."""
    if len(data) < _HEADER:
        return 0
    return _HEADER + _RECORD.itemsize * int.from_bytes(data[80:_HEADER], "little")


def _parse_binary(data: bytes, source: str) -> tuple[FloatArray, list[str]]:
    """Decode records after comparing the declared count with the file size."""
    count = int.from_bytes(data[80:_HEADER], "little")
    record_count, rest = divmod(len(data) - _HEADER, _RECORD.itemsize)
    if count == 0:
        raise PartError(
            f"{source}: no triangles: the header declares 0, the file holds {record_count} "
            "records; export the part again"
        )
    if count > record_count:
        raise PartError(
            f"{source}: truncated or damaged: declares {count} triangles, holds {record_count} "
            f"(+{rest} bytes); export or copy the file again"
        )
    trailing = len(data) - _HEADER - count * _RECORD.itemsize
    if trailing > _MOST_TRAILING:
        raise PartError(
            f"{source}: declares {count} triangles, but {trailing} bytes follow them "
            f"(at most {_MOST_TRAILING} are accepted); the count in the header is wrong or "
            "another file is attached"
        )
    lost = _facets_behind(data, count, record_count)
    if lost:
        raise PartError(
            f"{source}: declares {count} triangles, but {lost} more follow them; the count in the "
            "header is wrong or the file was put together from two; export the part again"
        )
    warnings = [f"{source}: {trailing} trailing bytes after the triangles ignored"]
    records = np.frombuffer(data, dtype=_RECORD, count=count, offset=_HEADER)
    with np.errstate(invalid="ignore"):  # a signalling NaN; refused with the other NaN
        corners = records["corners"].astype(np.float64)
    tiny = (corners != 0.0) & (np.abs(corners) < np.finfo(np.float32).tiny)
    if trailing and tiny.any():  # bytes put in between: what follows them is read out of step
        raise PartError(
            f"{source}: damaged: {np.count_nonzero(tiny.any(axis=(1, 2)))} facets have coordinates "
            f"that no program writes, and {trailing} bytes are left over; export or copy it again"
        )
    return corners, warnings if trailing else []


def _facets_behind(data: bytes, count: int, record_count: int) -> int:
    """Count records behind the declared ones that could be facets of a part."""
    records = np.frombuffer(data, dtype=_RECORD, count=record_count, offset=_HEADER)
    with np.errstate(invalid="ignore"):
        corners = records["corners"][count:].astype(np.float64)
    usable = (np.abs(corners) < LARGEST_COORDINATE).all(axis=(1, 2))
    a, b, c = np.moveaxis(corners[usable], 1, 0)
    return int(np.count_nonzero(np.cross(b - a, c - a).any(axis=1)))


def _is_ascii_stl(data: bytes) -> bool:
    """Whether the file starts with ``solid`` and continues as text."""
    start = data[:1024].lstrip(b"\xef\xbb\xbf \t\r\n").lower()
    return start.startswith(b"solid") and b"\0" not in start


def _looks_like(data: bytes) -> str | None:
    """Name the kind of a file that is not STL, if it is known."""
    start = data[:1024].lstrip(b"\xef\xbb\xbf \t\r\n").lower().replace(b"\r\n", b"\n")
    if start.startswith(b"pk\x03\x04"):
        return "a 3MF package (zip)" if b"3dmodel.model" in data[-65536:] else "a zip archive"
    for magic, kind in _MAGIC:
        if start.startswith(magic):
            return kind
    if any(byte < 9 or 13 < byte < 32 for byte in start):
        return None
    lines = start.splitlines()
    if any(line.startswith((b"v ", b"vn ", b"mtllib ", b"usemtl ")) for line in lines):
        return "an OBJ mesh"
    return "a text file that does not begin with 'solid'" if len(data) >= _HEADER else None
