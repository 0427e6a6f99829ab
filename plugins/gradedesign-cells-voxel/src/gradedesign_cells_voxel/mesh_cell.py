"""A cell family from a closed surface mesh of one cell."""

from __future__ import annotations

import logging
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gradedesign import CellFamily, PluginError
from gradedesign.fields import Field, FloatArray, periodic_spline
from gradedesign_cells_voxel._mesh_kernels import add_crossings
from gradedesign_cells_voxel.read_mesh import MeshSource, read_mesh
from gradedesign_cells_voxel.sampling import require_volume
from gradedesign_cells_voxel.triangle_distance import periodic_triangle_distance
from gradedesign_cells_voxel.voxel_cell import Symmetry

log = logging.getLogger(__name__)

#: Just inside the far faces of the cell: nearer than any corner of a triangle that is not on them.
_FAR = 1.0 - 2.0**-22


def cell_from_mesh(
    mesh: MeshSource,
    *,
    name: str,
    box: ArrayLike | None = None,
    resolution: int = 64,
    tolerance: float = 0.01,
    symmetry: Symmetry = "none",
    source: str = "",
) -> CellFamily:
    """Make a cell family of a closed surface mesh of one cell.

    The shape is the signed distance to the surface, negative inside, of period 1: level 0 is the
    cell as given, others grow and shrink it evenly. Where the solid meets a face of the cell the
    mesh is closed by a cap; caps are left out of the distance, since the solid goes on behind them.
    Everything is read, checked and tabulated when the shape is first evaluated; errors come then.

    Parameters
    ----------
    mesh : path, SurfaceMesh, RawTriangles or (m, 3, 3) array_like
        See `read_mesh`. A cell of unequal edges is stretched to the unit cube, distances too.
    box : (2, 3) array_like, optional
        Least and largest corner of the cell, mm; the surface's bounding box unless given.
    resolution : int
        Steps of the table of distances, 16 to 256; edges are rounded over one step.
    tolerance : float
        Share of opposite faces in which the solid may differ.
    symmetry : {"cubic", "tetragonal", "orthotropic", "none"}
        Of the stiffness, if known; the conformance kit checks it.
    source : str
        Where the mesh comes from.
    """
    if not 16 <= resolution <= 256:
        raise PluginError(f"cell '{name}': resolution is {resolution}, expected 16 to 256 steps")

    @cache
    def distance() -> Field:
        return _mesh_distance(read_mesh(mesh, box), resolution, tolerance)

    return CellFamily(
        name=name,
        shape=lambda u: distance()(u),
        source=source or "surface mesh of one cell",
        symmetry=symmetry,
    )


def _mesh_distance(corners: FloatArray, resolution: int, tolerance: float) -> Field:
    """Signed distance to a closed surface of one cell, repeated, as a table.

    Parameters
    ----------
    corners : (m, 3, 3) array, cell units
        Triangles within the unit cell, counter-clockwise seen from outside.
    tolerance : float
        Share of opposite faces in which the solid may differ.

    Returns
    -------
    callable
        Points ``(3, ...)`` in cell units to distances ``(...)``.

    Raises
    ------
    PluginError
        If the surface is open, inside out or does not repeat, or is too fine for the table.
    """
    axis = np.append(np.arange(resolution) / resolution, _FAR)
    solid = inside_surface(corners, axis)
    _require_equal_faces(solid, tolerance)
    caps = np.any(
        [(corners[:, :, a] == end).all(axis=1) for a in range(3) for end in (0, 1)], axis=0
    )
    if caps.all():
        raise PluginError("the surface has no triangle inside the cell: the cell is all solid")
    solid = solid[:-1, :-1, :-1]
    nodes = np.stack(np.meshgrid(*[axis[:-1]] * 3, indexing="ij"))
    away = periodic_triangle_distance(corners[~caps], nodes)
    field = periodic_spline(np.where(solid, -away, away))
    a, b, c = np.moveaxis(corners, 1, 0)
    volume = float((a * np.cross(b, c)).sum() / 6.0)
    log.info("mesh cell: %d triangles, %d of them caps", len(corners), np.count_nonzero(caps))
    require_volume(field, volume, resolution)
    return field


def inside_surface(corners: FloatArray, axis: FloatArray) -> NDArray[np.bool_]:
    """Mask of the grid nodes that lie inside a closed surface.

    Counts the crossings of columns along z, exactly also where a column meets an edge or a corner.

    Parameters
    ----------
    corners : (m, 3, 3) array
        Counter-clockwise seen from outside; shells that overlap count as united.
    axis : (n,) array
        Increasing coordinates of the nodes, along each axis. Nodes count as moved towards larger
        coordinates by less than anything.

    Returns
    -------
    (n, n, n) bool array

    Raises
    ------
    PluginError
        If the surface is open or inside out.
    """
    count = len(axis)
    change = np.zeros((count, count, count + 1), dtype=np.int64)
    add_crossings(np.ascontiguousarray(corners), axis, axis, axis, change)
    open_columns = int(np.count_nonzero(change.sum(axis=2)))
    if open_columns:
        raise PluginError(
            f"the surface is not closed: {open_columns} of {count**2} lines along z enter it more "
            f"or less often than they leave; repair the mesh, with caps where it meets the cell"
        )
    winding = np.cumsum(change, axis=2)[:, :, :-1]
    if winding.min() < 0:
        raise PluginError(
            f"{np.mean(winding < 0):.1%} of the cell lies in parts of the surface that are inside "
            f"out; turn their triangles around"
        )
    return np.asarray(winding > 0)


def _require_equal_faces(solid: NDArray[np.bool_], tolerance: float) -> None:
    """Refuse a solid whose cuts by opposite faces of the cell differ."""
    for axis, name in enumerate("xyz"):
        slices = np.moveaxis(solid, axis, 0)
        apart = slices[0, :-1, :-1] != slices[-1, :-1, :-1]
        share = float(apart.mean())
        if share > tolerance:
            place = np.argwhere(apart).mean(axis=0) / apart.shape[0]
            axes = [letter for letter in "xyz" if letter != name]
            raise PluginError(
                f"the mesh does not repeat along {name}: the solid at the faces {name} = 0 and "
                f"{name} = 1 differs in {share:.1%} of the face (allowed {tolerance:.1%}), about "
                f"({axes[0]}, {axes[1]}) = ({place[0]:.2f}, {place[1]:.2f}) cells; cut it to "
                f"exactly one period, give its box, or shift it where a face of the solid lies in "
                f"a face of the cell"
            )
