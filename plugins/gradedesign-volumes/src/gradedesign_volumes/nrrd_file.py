"""Volumes from NRRD files, strictly: one attached raw or gzip block along x, y and z.

Definition of NRRD file format, teem.sourceforge.net/nrrd/format.html, versions 1 to 5.
"""

from __future__ import annotations

import math
import re
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from gradedesign import UNIT_MM, PartError, ResourceError
from gradedesign_volumes.voxel_volume import VoxelVolume

#: Longest header and line of one, bytes.
_LONGEST_HEADER, _LONGEST_LINE = 100_000, 10_000
#: Directions of axes may miss x, y and z by this share.
_STRAIGHT = 1e-4
#: Types by the names that the format gives them, without their byte order.
_TYPES = {
    name: code
    for code, names in {
        "i1": "signed char|int8|int8_t",
        "u1": "uchar|unsigned char|uint8|uint8_t",
        "i2": "short|short int|signed short|signed short int|int16|int16_t",
        "u2": "ushort|unsigned short|unsigned short int|uint16|uint16_t",
        "i4": "int|signed int|int32|int32_t",
        "u4": "uint|unsigned int|uint32|uint32_t",
        "i8": "longlong|long long|long long int|signed long long|int64|int64_t",
        "u8": "ulonglong|unsigned long long|unsigned long long int|uint64|uint64_t",
        "f4": "float",
        "f8": "double",
    }.items()
    for name in names.split("|")
}


def read_nrrd_file(path: Path, *, memory_limit_bytes: int, bytes_per_value: int) -> VoxelVolume:
    """Read a volume with the edges of its voxels, and their unit where it is written.

    Axes that run backwards are turned around, so that the part is not mirrored. Where the volume
    lies in space is left out.

    Parameters
    ----------
    memory_limit_bytes : int
        Bytes that reading and using the volume may take.
    bytes_per_value : int
        Bytes that using it takes, beside the array itself.

    Raises
    ------
    PartError
        If the file is no such volume: the field is named.
    ResourceError
        If it takes more memory; found out before anything is decompressed.
    """
    name = path.name
    try:
        with path.open("rb") as file:
            fields = _fields(file, name)
            shape, dtype = _layout(fields, name)
            size = math.prod(shape) * dtype.itemsize
            need = size + math.prod(shape) * bytes_per_value
            if need > memory_limit_bytes:
                raise ResourceError(
                    f"{name} holds {' x '.join(map(str, shape))} voxels, which take about "
                    f"{need / 1e9:.3g} GB; found run.memory of {memory_limit_bytes / 1e9:.3g} GB; "
                    f"raise it or write a coarser volume"
                )
            content = _content(file, fields, size, name)
    except OSError as error:
        raise PartError(f"{name} cannot be read: {error.strerror}") from error
    values: NDArray[np.generic] = np.frombuffer(content, dtype).reshape(shape, order="F")
    spacing, backwards = _spacing(fields, name)
    for axis in backwards:
        values = np.flip(values, axis)
    return VoxelVolume(values=values, spacing=spacing, unit=_unit(fields, name))


def _fields(file: IO[bytes], name: str) -> dict[str, str]:
    """Fields of the header by their lower-case name."""
    if not re.fullmatch(rb"NRRD000[1-5]\r?\n", file.readline(_LONGEST_LINE)):
        raise PartError(f"{name}: not NRRD of version 1 to 5; export it again")
    fields: dict[str, str] = {}
    while file.tell() < _LONGEST_HEADER:
        line = file.readline(_LONGEST_LINE)
        if not line.endswith(b"\n"):
            break
        text = line.decode("utf-8", errors="replace").strip()
        if not text:
            return fields
        key, colon, value = text.partition(":")
        if text.startswith("#") or value.startswith("="):  # a comment, or a key of one's own
            continue
        if not colon or key.strip().lower() in fields:
            raise PartError(f"{name}: damaged header at {text[:60]!r}; export it again")
        fields[key.strip().lower()] = value.strip()
    raise PartError(f"{name}: its header has no end; it is truncated or damaged, export it again")


def _layout(fields: Mapping[str, str], name: str) -> tuple[tuple[int, ...], np.dtype[np.generic]]:
    """Shape and type of the values."""
    for key in ("data file", "datafile", "line skip", "lineskip", "byte skip", "byteskip"):
        if fields.get(key, "0") != "0":
            raise PartError(
                f"{name}: has the field {key!r}; expected the values in the file itself"
            )
    for key in ("type", "dimension", "sizes", "encoding"):
        if key not in fields:
            raise PartError(f"{name}: the field {key!r} is missing; export it again")
    sizes = fields["sizes"].split()
    if fields["dimension"] != "3" or len(sizes) != 3:
        raise PartError(f"{name}: dimension {fields['dimension'][:20]!r}; expected 3")
    if not all(re.fullmatch(r"[1-9][0-9]{0,8}", size) for size in sizes):
        raise PartError(f"{name}: sizes {fields['sizes'][:60]!r}; expected three whole numbers")
    kind = fields["type"].lower()
    if kind not in _TYPES:
        raise PartError(f"{name}: type {kind[:40]!r} is not read; expected grey values or floats")
    code = _TYPES[kind]
    order = {"little": "<", "big": ">"}.get(fields.get("endian", "").lower())
    if order is None and code[1] != "1":
        raise PartError(f"{name}: endian {fields.get('endian')!r}; expected little or big")
    return tuple(int(size) for size in sizes), np.dtype(f"{order or '|'}{code}")


def _content(file: IO[bytes], fields: Mapping[str, str], size: int, name: str) -> bytes:
    """The values as bytes, no more of them than the header states."""
    encoding = fields["encoding"].lower()
    if encoding == "raw":
        content = file.read(size + 1)
    elif encoding in ("gzip", "gz"):
        content = _unpacked(file, size, name)
    else:
        raise PartError(f"{name}: encoding {encoding[:40]!r} is not read; write raw or gzip")
    if len(content) != size:
        more = "more" if len(content) > size else f"{len(content)}"
        raise PartError(f"{name}: holds {more} bytes, expected {size}; truncated or altered")
    return content


def _unpacked(file: IO[bytes], size: int, name: str) -> bytes:
    unpack = zlib.decompressobj(zlib.MAX_WBITS | 16)
    parts, remaining = [], size + 1
    try:
        while remaining > 0 and not unpack.eof:
            packed = unpack.unconsumed_tail or file.read(1 << 20)
            if not packed:
                raise PartError(f"{name}: its gzip data end too early; it is truncated")
            parts.append(unpack.decompress(packed, remaining))
            remaining -= len(parts[-1])
    except zlib.error as error:
        raise PartError(f"{name}: its gzip data are damaged: {error}") from error
    return b"".join(parts)


def _spacing(
    fields: Mapping[str, str], name: str
) -> tuple[tuple[float, float, float] | None, list[int]]:
    """Edges of a voxel, and the axes that run backwards."""
    directions = fields.get("space directions")
    if directions is not None:
        rows = re.findall(r"\(([^()]*)\)", directions)
        matrix = [_numbers(row.replace(",", " "), name, "space directions") for row in rows]
        if len(matrix) != 3:
            raise PartError(f"{name}: space directions {directions[:60]!r}; expected three vectors")
        vectors = np.array(matrix)
        edges = np.diag(vectors)
        if (np.abs(vectors - np.diag(edges)) > _STRAIGHT * np.abs(edges).max()).any():
            raise PartError(
                f"{name}: its axes do not run along x, y and z: {directions[:80]!r}; export it "
                f"resampled along them"
            )
        backwards = np.flatnonzero(edges < 0).tolist()
        edges = np.abs(edges)
    elif "spacings" in fields:
        edges, backwards = np.array(_numbers(fields["spacings"], name, "spacings")), []
    else:
        return None, []
    x, y, z = (float(e) for e in edges)
    return (x, y, z), backwards


def _numbers(text: str, name: str, field: str) -> list[float]:
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) != 3 or not all(math.isfinite(n) for n in numbers):
        raise PartError(f"{name}: {field} {text[:60]!r}; expected three numbers")
    return numbers


def _unit(fields: Mapping[str, str], name: str) -> str | None:
    words = set(re.findall(r'"([^"]*)"', fields.get("space units", "")))
    if not words or words == {""}:
        return None
    unit: str = words.pop()
    if words or unit not in UNIT_MM:
        raise PartError(
            f"{name}: space units {fields['space units'][:60]!r}; expected one of "
            f"{', '.join(UNIT_MM)}"
        )
    return unit
