"""Displacements at arbitrary points by the shape functions of the elements."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import SolverError
from gradedesign.fe.element_points import shape_values
from gradedesign.fe.space import TetSpace
from gradedesign.mesh.point_location import TetLocator, locate

#: Distance outside the mesh that counts as rounding, over the diagonal of the mesh.
ROUNDING = 1e-6


def interpolate(
    space: TetSpace, field: FloatArray, tets: IntArray, barycentric: FloatArray
) -> FloatArray:
    """Evaluate a nodal field in given tetrahedra.

    Parameters
    ----------
    space : TetSpace
    field : (..., N) array
        At the nodes of the space, such as displacement ``(3, N)`` in mm.
    tets : (n,) int array
        The tetrahedron of every point.
    barycentric : (4, n) array
        Barycentric coordinates in it.

    Returns
    -------
    (..., n) array
        In the unit of the field.
    """
    values = np.asarray(field, dtype=np.float64)
    if values.shape[-1] != space.node_count:
        raise ValueError(f"the field has {values.shape[-1]} nodes, the space {space.node_count}")
    weights = np.asarray(barycentric, dtype=np.float64)
    if weights.shape != (4, len(tets)):
        raise ValueError(f"barycentric has shape {weights.shape}, expected (4, {len(tets)})")
    shapes = shape_values(space.order, weights.T)
    result = np.zeros((*values.shape[:-1], len(tets)))
    # One node at a time: gathering all ten at once would cost ten times the memory.
    for a, nodes in enumerate(space.elements[:, tets]):
        result += values[..., nodes] * shapes[:, a]
    return result


def displacement_at(
    space: TetSpace,
    displacement: FloatArray,
    points: ArrayLike,
    *,
    reach: float | None = None,
    locator: TetLocator | None = None,
) -> FloatArray:
    """Displacement at arbitrary points.

    Parameters
    ----------
    space : TetSpace
    displacement : (3, N) array, mm
    points : (3, n) array, mm
    reach : float, mm, optional
        How far outside the mesh a point may lie; it then takes the value of the nearest point of
        the mesh. A millionth of the mesh's diagonal if not given: rounding only.
    locator : TetLocator, optional
        Of the same mesh, where it is asked more than once.

    Returns
    -------
    (3, n) array, mm

    Raises
    ------
    SolverError
        If a point lies farther outside than `reach`.
    """
    places = np.asarray(points, dtype=np.float64)
    tets, barycentric, distance = locate(space.mesh, places, locator=locator)
    diagonal = float(np.linalg.norm(np.ptp(space.mesh.points, axis=1)))
    allowed = ROUNDING * diagonal if reach is None else reach
    far = distance > allowed
    if far.any():
        worst = int(distance.argmax())
        x, y, z = places[:, worst]
        raise SolverError(
            f"{np.count_nonzero(far)} of {far.size} points lie outside the analysed mesh; "
            f"({x:g}, {y:g}, {z:g}) mm is {distance[worst]:.3g} mm away, expected at most "
            f"{allowed:.3g} mm; ask inside the solid or allow a longer reach"
        )
    return interpolate(space, displacement, tets, barycentric)
