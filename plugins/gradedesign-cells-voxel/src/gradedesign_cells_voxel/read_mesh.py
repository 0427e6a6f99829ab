"""Triangles of one cell, from a file or an array, in cell units."""

from __future__ import annotations

from importlib.metadata import entry_points
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from gradedesign import PartReader, PluginError, RawTriangles, SurfaceMesh, supplied_by
from gradedesign.fields import FloatArray

#: What a cell's surface can be read from.
MeshSource: TypeAlias = str | Path | SurfaceMesh | RawTriangles | ArrayLike

#: Corners this near to a face of the cell, in cell units, lie on it.
_ON_FACE = 1e-4

#: Length of one unit of a file, mm; one that carries none is taken in mm.
_MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}

#: Corners are rounded to this, in cell units, so that neighbours share theirs exactly.
_GRAIN = 2.0**-20


def read_mesh(mesh: MeshSource, box: ArrayLike | None) -> FloatArray:
    """Read triangles and scale their cell to the unit cube.

    Parameters
    ----------
    mesh : path, SurfaceMesh, RawTriangles or (m, 3, 3) array_like
        A file of any format that an installed reader knows, such as STL; or corners, mm.
    box : (2, 3) array_like or None
        Least and largest corner of the cell, mm; the surface's bounding box unless given.

    Returns
    -------
    (m, 3 corners, 3 coordinates) array, cell units
        Without triangles of no area.

    Raises
    ------
    PluginError
        If there is no reader, no triangle, or a corner outside the box.
    PartError
        If the reader refuses the file.
    """
    corners = _corners(mesh)
    if corners.ndim != 3 or corners.shape[1:] != (3, 3) or len(corners) == 0:
        raise PluginError(f"triangles have shape {corners.shape}, expected (m, 3, 3), m above 0")
    if not np.isfinite(corners).all():
        raise PluginError(f"{np.count_nonzero(~np.isfinite(corners))} coordinates are not finite")
    flat = corners.reshape(-1, 3)
    ends = np.stack([flat.min(axis=0), flat.max(axis=0)]) if box is None else np.array(box, float)
    edges = ends[1] - ends[0] if ends.shape == (2, 3) else np.zeros(3)
    if not (np.isfinite(edges).all() and (edges > 0).all()):
        raise PluginError(
            f"the cell's box {ends.tolist()} mm is impossible, expected its least and its largest "
            f"corner"
        )
    placed = (corners - ends[0]) / edges
    if placed.min() < -_ON_FACE or placed.max() > 1 + _ON_FACE:
        raise PluginError(
            f"the surface leaves the cell's box: it reaches from {flat.min(axis=0).tolist()} to "
            f"{flat.max(axis=0).tolist()} mm, the box from {ends[0].tolist()} to "
            f"{ends[1].tolist()} mm; trim it or give the box of one period"
        )
    placed = np.round(placed / _GRAIN) * _GRAIN
    placed[np.abs(placed) <= _ON_FACE] = 0.0
    placed[np.abs(placed - 1) <= _ON_FACE] = 1.0
    a, b, c = np.moveaxis(placed, 1, 0)
    return np.asarray(placed[np.linalg.norm(np.cross(b - a, c - a), axis=1) > 0])


def _corners(mesh: MeshSource) -> FloatArray:
    """Corners of triangles, mm."""
    if isinstance(mesh, str | Path):
        reader = _reader(Path(mesh))
        read = None if reader.key else reader.read(Path(mesh))
        if not isinstance(read, RawTriangles):
            raise PluginError(
                f"{mesh} holds a voxel volume; expected triangles (STL, OBJ, PLY, OFF, 3MF)"
            )
        mesh = read
    if isinstance(mesh, SurfaceMesh):
        return np.array(mesh.vertices[mesh.faces])
    if isinstance(mesh, RawTriangles):
        return np.array(mesh.corners) * _MM[mesh.unit or "mm"]
    return np.array(mesh, dtype=np.float64)


def _reader(path: Path) -> PartReader:
    """Reader of a file's format, found through the hooks: first the core's, then others'."""
    points = sorted(
        entry_points(group="gradedesign"), key=lambda p: (not p.value.startswith("gradedesign."), p)
    )
    suffixes: list[str] = []
    for point in points:
        supply = getattr(point.load(), "gradedesign_readers", None)
        readers: list[PartReader] = [] if supply is None else list(supply())
        for reader in readers:
            if path.suffix.lower() in reader.suffixes:
                return reader
            suffixes.extend(reader.suffixes)
    near = supplied_by("suffixes", path.suffix.lower()) or f"known are {', '.join(suffixes)}"
    raise PluginError(
        f"no installed reader knows '{path.suffix}' files such as {path.name}; {near}"
    )
