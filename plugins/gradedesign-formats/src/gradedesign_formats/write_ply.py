"""The printed surface as binary PLY, written and read back a batch of triangles at a time."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gradedesign import (
    LatticeError,
    PrintedLattice,
    SurfaceMesh,
    float32_vertices,
    report_step,
    require_read_back,
)

_FACE = np.dtype([("count", "u1"), ("corners", "<i4", (3,))])  # 13 bytes
#: Triangles that are written at a time. Bounds the memory of one step; the result does not depend
#: on it. Chosen, not measured.
_BATCH = 1 << 15


def export_ply(path: Path, lattice: PrintedLattice) -> None:
    """Write the printed lattice as binary PLY, in mm, with its metadata as comments.

    Raises
    ------
    LatticeError
        If float32 cannot hold its detail, or 32 bits the numbers of its vertices.
    ResourceError
        If what is read back differs.
    """
    surface = lattice.surface
    if max(len(surface.vertices), len(surface.faces)) >= 2**31:
        raise LatticeError(f"PLY numbers 2147483647 vertices, {len(surface.vertices)} are there")
    vertices = float32_vertices(surface.vertices).astype("<f4")
    header = _header(lattice).encode()
    with path.open("wb") as file:
        file.write(header)
        file.write(vertices.tobytes())
        for low in range(0, len(surface.faces), _BATCH):
            report_step("triangles", low / len(surface.faces))
            some = np.zeros(min(_BATCH, len(surface.faces) - low), dtype=_FACE)
            some["count"], some["corners"] = 3, surface.faces[low : low + _BATCH]
            file.write(some.tobytes())
    require_read_back(path, _pieces(path, header, surface), surface)


def _header(lattice: PrintedLattice) -> str:
    # Readers end the header at the first line that holds "end_header", comment or not.
    lines = [
        re.sub("(?i)end_header", "end header", f"comment {key}: {value}")
        for key, value in lattice.metadata.items()
    ]
    return "\n".join(
        [
            "ply",
            "format binary_little_endian 1.0",
            *("".join(c if c.isprintable() else " " for c in line) for line in lines),
            f"element vertex {len(lattice.surface.vertices)}",
            *(f"property float {axis}" for axis in "xyz"),
            f"element face {len(lattice.surface.faces)}",
            "property list uchar int vertex_indices",
            "end_header\n",
        ]
    )


def _pieces(path: Path, header: bytes, surface: SurfaceMesh) -> Iterator[NDArray[np.floating]]:
    """Corners ``(k, 3, 3)`` of the sound triangles of a file; none where it has another size."""
    places = 12 * len(surface.vertices)
    if path.stat().st_size != len(header) + places + _FACE.itemsize * len(surface.faces):
        return
    with path.open("rb") as file:
        same = file.read(len(header)) == header
        vertices = np.frombuffer(file.read(places), dtype="<f4").reshape(-1, 3)
        while same and (block := file.read(_FACE.itemsize * _BATCH)):
            some = np.frombuffer(block, dtype=_FACE)
            numbers = some["corners"]
            sound = (some["count"] == 3) & ((numbers >= 0) & (numbers < len(vertices))).all(1)
            yield vertices[numbers[sound]]
