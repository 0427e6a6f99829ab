"""The printed surface as binary PLY, written and read back a batch of triangles at a time."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from gradedesign.common.system.progress import report_step
from gradedesign.errors import LatticeError, ResourceError
from gradedesign.geometry.formats.printed_lattice import PrintedLattice
from gradedesign.geometry.formats.write_stl import VOLUME_TOLERANCE, float32_vertices
from gradedesign.geometry.triangles._triangle_kernels import cone_volume
from gradedesign.geometry.triangles.edge_balance import edge_balance
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, enclosed_volume

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
    _read_back(path, header, surface)


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


def _read_back(path: Path, header: bytes, surface: SurfaceMesh) -> None:
    """Compare size, count, closedness and volume of the file with those of the surface."""
    volume, middle = enclosed_volume(surface), surface.vertices.mean(axis=0)
    places = 12 * len(surface.vertices)
    triangles, balance, enclosed = 0, 0, 0.0
    if path.stat().st_size == len(header) + places + _FACE.itemsize * len(surface.faces):
        with path.open("rb") as file:
            same = file.read(len(header)) == header
            vertices = np.frombuffer(file.read(places), dtype="<f4").reshape(-1, 3)
            while same and (block := file.read(_FACE.itemsize * _BATCH)):
                some = np.frombuffer(block, dtype=_FACE)
                numbers = some["corners"]
                sound = (some["count"] == 3) & ((numbers >= 0) & (numbers < len(vertices))).all(1)
                corners = vertices[numbers[sound]]
                triangles += len(corners)
                balance += edge_balance(corners)
                enclosed += cone_volume(corners.astype(np.float64), *middle)
    closed = balance % 2**64 == 0
    if (
        triangles != len(surface.faces)
        or not closed
        or not abs(enclosed - volume) <= VOLUME_TOLERANCE * abs(volume)
    ):
        raise ResourceError(
            f"{path} reads back as {triangles} triangles that {'' if closed else 'do not '}"
            f"close, {enclosed:g} mm^3; expected {len(surface.faces)} that close, {volume:g} mm^3 "
            f"within 0.1 %; check the disk and write it again"
        )
