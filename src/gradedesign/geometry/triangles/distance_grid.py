"""Signed distance to triangles on a regular grid, exact near them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gradedesign.arrays import locked
from gradedesign.errors import MeshError
from gradedesign.geometry.triangles.grid_classifier import marked_inside
from gradedesign.geometry.triangles.surface_mesh import (
    SurfaceMesh,
    corner_points,
    unbalanced_edge_count,
)
from gradedesign.geometry.triangles.triangle_tree import build_triangle_tree, distance_within
from gradedesign.geometry.triangles.winding import agreeing, winding_tree, windings_about

#: Nodes along the edge of a brick, in which distances are found or not. Chosen, not measured.
_SIDE = 8
#: Winding number from which on a point is inside triangles that may leave holes.
_INSIDE = 0.5


def distance_grid(
    surface: SurfaceMesh,
    lower: ArrayLike,
    spacing: float,
    shape: tuple[int, int, int],
    *,
    band: float = 3.0,
) -> NDArray[np.float32]:
    """Signed distance at every node of a grid, mm, negative inside.

    Inside is where the winding number is at least 1. Triangles may be missing, doubled or turned
    around: where an edge is open or passed unequally often, triangles that disagree with those
    about them count turned around, and inside is where the winding number is above one half.

    Parameters
    ----------
    surface : SurfaceMesh
        Closed or not.
    lower : (3,) array_like, mm
        First node.
    spacing : float, mm
    shape : (int, int, int)
        Nodes along x, y, z.
    band : float
        Spacings from the triangles up to which distances are exact, as float32 holds them; beyond,
        this with the sign. Infinite for all distances, in a time that grows with the nodes and not
        with the surface.

    Returns
    -------
    (nx, ny, nz) float32 array

    Raises
    ------
    MeshError
        If there is no triangle, or the grid cannot be used.

    References
    ----------
    Barill, Dickson, Schmidt, Levin & Jacobson, "Fast winding numbers for soups and clouds", ACM
    Transactions on Graphics 37(4), 43, 2018.

    Examples
    --------
    >>> from gradedesign.geometry.part.box import box_surface
    >>> grid = distance_grid(box_surface((4.0, 4.0, 4.0)), (-0.5, 2, 2), 1.0, (4, 1, 1))
    >>> grid.ravel()
    array([ 0.5, -0.5, -1.5, -1.5], dtype=float32)
    """
    lower = locked(lower, (3,), name="lower")
    if min(shape) < 1 or not spacing > 0 or not band > 0:
        raise MeshError(
            f"distance on a grid: found {shape} nodes, a spacing of {spacing:g} mm and a band of "
            f"{band:g} spacings; expected at least one node, a positive spacing and a positive band"
        )
    corners = (corner_points(surface) - lower) / spacing
    tree = build_triangle_tree(corners)
    closed = unbalanced_edge_count(surface) == 0
    soup = None if closed else agreeing(winding_tree(tree))
    inside = marked_inside(corners, shape).view(np.bool_) if closed else np.zeros(shape, dtype=bool)
    result = np.full(shape, band, dtype=np.float32)
    # By cubes of four and of two nodes: neighbours that follow each other share a search.
    node = np.indices((_SIDE,) * 3).reshape(3, *(2,) * 9)
    node = node.transpose(0, 1, 4, 7, 2, 5, 8, 3, 6, 9).reshape(3, 1, -1)
    reach = band + 0.5 * 3.0**0.5 * (_SIDE - 1)  # from the middle of a brick
    for i in range(0, shape[0], _SIDE):
        j, k = np.meshgrid(*(np.arange(0, n, _SIDE) for n in shape[1:]), indexing="ij")
        brick = np.stack([np.full(j.size, i), j.ravel(), k.ravel()])
        middle = brick + 0.5 * (_SIDE - 1)
        near = distance_within(tree, middle, reach) < reach
        if soup is not None:
            for corner in brick[:, ~near][:, windings_about(soup, middle[:, ~near]) > _INSIDE].T:
                inside[tuple(slice(c, c + _SIDE) for c in corner)] = True
        places = (brick[:, near, None] + node).reshape(3, -1)
        places = places[:, (places < np.array(shape)[:, None]).all(axis=0)]
        points = places.astype(np.float64)
        result[tuple(places)] = distance_within(tree, points, band)
        if soup is not None:
            inside[tuple(places)] = windings_about(soup, points) > _INSIDE
    result *= np.float32(spacing)
    np.negative(result, out=result, where=inside)
    return result
