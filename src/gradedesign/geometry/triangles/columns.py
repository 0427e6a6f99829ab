"""Winding numbers of points about a closed surface, by columns of triangles along an axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import MeshError
from gradedesign.geometry.triangles import _column_kernels as kernels
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points, enclosed_volume
from gradedesign.geometry.triangles.unbalanced_edges import unbalanced_edge_count

#: Columns per triangle, at most. Chosen, not measured.
MOST_COLUMNS = 4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TriangleColumns:
    """Triangles of a closed surface sorted into columns along the shortest side of its box.

    Attributes
    ----------
    corners : (m, 3, 3) array, mm
        Coordinates in the order of ``axes``.
    tops : (m,) array, mm
        Largest last coordinate of every triangle.
    axes : (3,) int array
        Columns run along the last of them.
    lower : (2,) array, mm
    step : float, mm
        Edge of a column.
    shape : (2,) int array
    first, member : int arrays
        Triangles of column c are ``member[first[c]:first[c + 1]]``, from the top down.
    """

    corners: FloatArray
    tops: FloatArray
    axes: IntArray
    lower: FloatArray
    step: float
    shape: IntArray
    first: IntArray
    member: IntArray


def build_columns(surface: SurfaceMesh) -> TriangleColumns:
    """Sort the triangles of a closed surface into columns.

    Raises
    ------
    MeshError
        If the surface is empty, open or turned inside out.
    """
    open_edges = unbalanced_edge_count(surface)
    if len(surface.faces) == 0 or open_edges:
        raise MeshError(
            f"inside and outside: the surface has {len(surface.faces)} triangles and {open_edges} "
            "edges that are not passed equally often from both sides; expected a closed, "
            "consistently oriented surface, repair it"
        )
    volume = enclosed_volume(surface)
    if not volume > 0:
        raise MeshError(
            f"inside and outside: the surface encloses {volume:.6g} mm^3; expected a positive "
            "volume, turn its triangles around"
        )
    corners = corner_points(surface)
    extent = np.ptp(corners, axis=(0, 1))
    last = int(np.argmin(extent))
    axes = np.array([(last + 1) % 3, (last + 2) % 3, last])
    corners = np.ascontiguousarray(corners[:, :, axes])
    lower, extent = corners.min(axis=(0, 1))[:2], extent[axes[:2]]
    least = np.sqrt(extent.prod() / (MOST_COLUMNS * len(corners)))
    step = float(max(np.ptp(corners[:, :, :2], axis=1).mean(), least))
    shape = np.floor(extent / step).astype(np.int64) + 1
    tops = corners[:, :, 2].max(axis=1)
    order = np.argsort(-tops, kind="stable")
    first = np.zeros(int(shape.prod()) + 1, dtype=np.int64)
    grid = (corners, order, lower, step, shape)
    kernels.fill_columns(*grid, first, np.zeros(0, dtype=np.int64))
    np.cumsum(first, out=first)
    member = np.zeros(int(first[-1]), dtype=np.int64)
    kernels.fill_columns(*grid, first[:-1].copy(), member)
    return TriangleColumns(
        corners=corners,
        tops=tops,
        axes=axes,
        lower=lower,
        step=step,
        shape=shape,
        first=first,
        member=member,
    )


def winding_at(
    columns: TriangleColumns, points: FloatArray, clearance: FloatArray | None = None
) -> IntArray:
    """Winding number of a closed surface about points.

    Parameters
    ----------
    columns : TriangleColumns
    points : (3, n) array, mm
    clearance : (n,) array, optional, mm
        Lower bounds of the points' distances to the surface: consecutive points that the surface
        cannot separate are evaluated together.

    Returns
    -------
    (n,) int array
        1 inside an outward surface and 0 outside; more where it overlaps itself, negative where it
        is turned inside out. Of a point on the surface, that of either side.
    """
    n = points.shape[1]
    result = np.zeros(n, dtype=np.int64)
    kernels.windings(
        columns.corners,
        columns.tops,
        columns.lower,
        columns.step,
        columns.shape,
        columns.first,
        columns.member,
        np.ascontiguousarray(points, dtype=np.float64),
        columns.axes,
        np.zeros(n) if clearance is None else clearance,
        result,
    )
    return result
