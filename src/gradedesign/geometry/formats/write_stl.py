"""The printed surface as binary STL."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.system.atomic import replacing
from gradedesign.common.system.progress import report_step
from gradedesign.errors import LatticeError, ResourceError
from gradedesign.geometry.formats.printed_lattice import PrintedLattice
from gradedesign.geometry.formats.read_back import require_read_back
from gradedesign.geometry.triangles._triangle_kernels import (
    first_equal,
    triangle_numbers,
)
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

log = logging.getLogger(__name__)

#: First bytes of every file; must not begin with "solid", which would announce ASCII.
_HEADER = b"gradedesign lattice, unit mm, binary STL"

_RECORD = np.dtype(
    [("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")]
)  # 50 bytes, as the format wants
#: Triangles that are written at a time. Bounds the memory of one step; the result does not depend
#: on it. Chosen, not measured.
_BATCH = 1 << 15


def write_stl(path: Path, surface: SurfaceMesh, records: bytes = b"") -> str:
    """Write a closed surface as binary STL, atomically, and read it back.

    Coordinates are float32. Vertices that would fall together in float32 are moved apart by the
    smallest steps it can hold, so a reader that joins equal corners finds the same surface.

    Returns str: SHA-256 of the bytes that were written, hexadecimal. Raises LatticeError if the
    surface is empty, too large for the format or too fine for float32, or the records are not those
    of its first triangles. Raises CaseError or ResourceError if the file cannot be written, or what
    is read back differs.

    ``surface``: mm, outward oriented. ``records``: of the first triangles as another binary STL
    file holds them, to the byte; their corners are those of the surface.
    """
    count = len(surface.faces)
    if not 0 < count < 2**32:
        raise LatticeError(f"STL holds 1 to 4294967295 triangles, the surface has {count}")
    vertices = float32_vertices(surface.vertices)
    first = len(records) // _RECORD.itemsize
    if not same_triangles(records, vertices[surface.faces[:first]]):
        raise LatticeError(
            f"the {first} triangles that are written as a file has them are not the first ones of "
            f"the surface; pass a surface that begins with them"
        )
    digest = hashlib.sha256()
    with replacing(path) as handle:
        for block in _blocks(vertices, surface.faces, records):
            digest.update(block)
            handle.write(block)
    size = f"{path.stat().st_size} bytes of {84 + 50 * count}, "
    require_read_back(path, _pieces(path, count), surface, size)
    log.info("wrote %s: %d triangles, %.3g MB", path, count, (84 + 50 * count) / 1e6)
    return digest.hexdigest()


def export_stl(path: Path, lattice: PrintedLattice) -> None:
    """Write the printed lattice as `write_stl` does; errors likewise."""
    write_stl(path, lattice.surface, lattice.outer_records)


def float32_vertices(vertices: FloatArray) -> FloatArray:
    """Vertices ``(n, 3)`` rounded to values that float32 holds, all still different.

    Raises
    ------
    LatticeError
        If some stay together after 8 steps.

    Examples
    --------
    >>> near = np.array([[1.0, 0.0, 0.0], [1.0 + 1e-9, 0.0, 0.0]])  # the same in float32
    >>> moved = float32_vertices(near)
    >>> bool(moved[0, 0] != moved[1, 0]), bool(abs(moved - near).max() < 2e-7)
    (True, True)
    """
    rounded = np.ascontiguousarray(vertices, dtype=np.float32)
    for step in range(8):
        rounded = rounded + np.float32(0.0)  # no negative zero
        again = first_equal(rounded.view(np.uint32)) != np.arange(len(rounded))
        if not again.any():
            return rounded.astype(np.float64)
        if step == 0:
            log.info("moved %d vertices apart to survive float32", np.count_nonzero(again))
        axis = step % 3
        away = np.where(step < 3, np.float32(np.inf), np.float32(-np.inf))
        rounded[again, axis] = np.nextafter(rounded[again, axis], away)
    raise LatticeError(
        f"{np.count_nonzero(again)} vertices fall together in the float32 of STL; the detail "
        f"is too fine for coordinates up to {np.abs(vertices).max():g} mm: use a coarser grid or "
        f"move the part to the origin"
    )


def same_triangles(records: bytes, corners: FloatArray) -> bool:
    """Whether records of a binary STL hold the corners ``(m, 3, 3)`` mm, in their order."""
    stored_corners = np.frombuffer(records, dtype=_RECORD)["corners"]
    return stored_corners.shape == corners.shape and np.array_equal(stored_corners, corners)


def surface_of_stl(data: bytes, source: str) -> SurfaceMesh:
    """Surface of a binary STL file that `write_stl` wrote: equal corners are one vertex.

    Nothing is repaired: the caller checks that the surface closes as it is.

    Raises ResourceError if the size of the file is not that of its triangles.
    """
    count = int(np.frombuffer(data[80:84], dtype="<u4")[0]) if len(data) > 84 else 0
    if count == 0 or len(data) != 84 + 50 * count:
        raise ResourceError(
            f"{source} holds {len(data)} bytes for {count} triangles, expected {84 + 50 * count} "
            f"and at least one triangle; leave the folder of a run alone while it runs"
        )
    points = np.frombuffer(data, dtype=_RECORD, offset=84)["corners"].reshape(-1, 3)
    points = points + np.float32(0.0)  # no negative zero
    first = first_equal(points.view(np.uint32))
    fresh = first == np.arange(len(first))
    number = np.cumsum(fresh) - 1
    return SurfaceMesh(vertices=points[fresh], faces=number[first].reshape(-1, 3))


def _blocks(vertices: FloatArray, faces: IntArray, first_records: bytes) -> Iterator[bytes]:
    """Content of a file of triangles ``(m, 3)`` over vertices, the first ones as given."""
    yield _HEADER.ljust(80, b" ")
    yield np.array(len(faces), dtype="<u4").tobytes()
    yield first_records
    for low in range(len(first_records) // _RECORD.itemsize, len(faces), _BATCH):
        report_step("triangles", low / len(faces))
        some = faces[low : low + _BATCH]
        numbers = np.zeros((len(some), 12), dtype=np.float32)
        triangle_numbers(vertices, some, numbers)
        records = np.zeros(len(some), dtype=_RECORD)
        records["normal"] = numbers[:, :3]
        records["corners"] = numbers[:, 3:].reshape(-1, 3, 3)
        yield records.tobytes()


def _pieces(path: Path, count: int) -> Iterator[NDArray[np.float32]]:
    """Corners ``(k, 3, 3)`` of the triangles of a file; none where it has another size or count."""
    if path.stat().st_size != 84 + 50 * count:
        return
    with path.open("rb") as handle:
        handle.seek(80)
        if int(np.frombuffer(handle.read(4), dtype="<u4")[0]) != count:
            return
        while block := handle.read(50 * _BATCH):
            yield np.frombuffer(block, dtype=_RECORD)["corners"]
