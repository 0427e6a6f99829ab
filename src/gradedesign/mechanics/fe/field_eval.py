"""Nodal fields between the nodes, by the shape functions of the elements."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.mechanics.fe.element_points import shape_values
from gradedesign.mechanics.fe.space import TetSpace


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
