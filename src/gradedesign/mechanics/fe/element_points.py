"""Evaluation points of the elements, and their shape functions there.

Each tetrahedron has two sets of four points: the Gauss points of the rule of degree 2, which stand
for a quarter of the volume each (Zienkiewicz and Taylor, The Finite Element Method, 5th ed.,
vol. 1, table 9.3), and the vertices.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_matrix

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.mechanics.fe._space_kernels import LOCAL_EDGES
from gradedesign.mechanics.fe.space import TetSpace

Where: TypeAlias = Literal["gauss", "vertices"]

#: A scalar field: one value, one per element (M,), one per point (M, 4), or a function of
#: points (3, ...) in mm returning (...).
ScalarField: TypeAlias = ArrayLike | Callable[[FloatArray], FloatArray]


def barycentric(at: Where) -> FloatArray:
    """Barycentric coordinates of the points, ``(4 points, 4)``.

    Examples
    --------
    >>> barycentric("gauss").round(4)[0].tolist()
    [0.5854, 0.1382, 0.1382, 0.1382]
    """
    if at == "vertices":
        return np.eye(4)
    if at == "gauss":
        near, far = (5.0 + 3.0 * 5.0**0.5) / 20.0, (5.0 - 5.0**0.5) / 20.0
        return np.full((4, 4), far) + (near - far) * np.eye(4)
    raise ValueError(f"points are asked for at {at!r}, expected 'gauss' or 'vertices'")


def shape_values(order: int, at: FloatArray) -> FloatArray:
    """Shape functions at barycentric coordinates ``(n, 4)``, as ``(n, 4 or 10)``."""
    if order == 1:
        return at
    corners = at * (2.0 * at - 1.0)
    edges = np.stack([4.0 * at[:, i] * at[:, j] for i, j in LOCAL_EDGES], axis=1)
    return np.concatenate([corners, edges], axis=1)


def shape_derivatives(order: int, at: FloatArray) -> FloatArray:
    """Derivatives of the shape functions by barycentric coordinates.

    ``at (n, 4)``: barycentric coordinates. Returns ``(n, 4 or 10, 4)``: point, node, coordinate.
    """
    if order == 1:
        return np.tile(np.eye(4), (len(at), 1, 1))
    derivatives = np.zeros((len(at), 10, 4))
    for k in range(4):
        derivatives[:, k, k] = 4.0 * at[:, k] - 1.0
    for k, (i, j) in enumerate(LOCAL_EDGES):
        derivatives[:, 4 + k, i] = 4.0 * at[:, j]
        derivatives[:, 4 + k, j] = 4.0 * at[:, i]
    return derivatives


def element_points(space: TetSpace, at: Where = "gauss") -> FloatArray:
    """Positions of the points of every element, ``(3, M, 4)``, mm."""
    corners = space.mesh.points[:, space.mesh.tets]
    return np.einsum("dkm,qk->dmq", corners, barycentric(at))


def gauss_interpolation(space: TetSpace) -> csr_matrix:
    """Matrix ``(4 M, N)`` from values at nodes to those at Gauss points, all first points first."""
    nodes = space.elements.T
    shapes = shape_values(space.order, barycentric("gauss"))
    rows = np.arange(len(shapes) * space.element_count)
    return csr_matrix(
        (
            np.repeat(shapes, space.element_count, axis=0).ravel(),
            (np.repeat(rows, nodes.shape[1]), np.tile(nodes, (len(shapes), 1)).ravel()),
        ),
        shape=(rows.size, space.node_count),
    )


def coordinate_gradients(space: TetSpace, part: slice = slice(None)) -> FloatArray:
    """Gradients of the barycentric coordinates of some elements, ``(m, 4, 3)``, 1/mm."""
    corners = space.nodes[:, space.elements[:4, part]]
    edges = (corners[:, 1:] - corners[:, :1]).transpose(2, 1, 0)
    inverse = np.linalg.inv(edges).transpose(0, 2, 1)
    return np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)


def values_at(space: TetSpace, field: ScalarField, at: Where = "gauss") -> FloatArray:
    """Values of a field at the points of every element.

    ``field``, (M,) or (M, 4) array, or callable. ``at``: "gauss" or "vertices"; where a function is
    evaluated; arrays are taken as they are. Returns ``(1, 1), (M, 1) or (M, 4)``: as much as is
    needed: it broadcasts to (M, 4).
    """
    count = space.element_count
    if callable(field):
        values = np.asarray(field(element_points(space, at)), dtype=np.float64)
        if values.shape != (count, 4):
            raise ValueError(
                f"the field returned shape {values.shape} for points (3, {count}, 4), "
                f"expected ({count}, 4)"
            )
        return np.ascontiguousarray(values)
    values = np.asarray(field, dtype=np.float64)
    if values.shape not in {(), (count,), (count, 4)}:
        raise ValueError(
            f"the field has shape {values.shape}, expected one value, ({count},) or ({count}, 4)"
        )
    return np.ascontiguousarray(
        values.reshape(1, 1) if values.ndim == 0 else values.reshape(count, -1)
    )


def interpolate(
    space: TetSpace, field: FloatArray, tets: IntArray, barycentric: FloatArray
) -> FloatArray:
    """Evaluate a nodal field in given tetrahedra.

    ``field (..., N)``: at the nodes of the space, such as displacement ``(3, N)`` in mm.
    ``tets (n,)``: the tetrahedron of every point. ``barycentric (4, n)``: barycentric coordinates
    in it. Returns ``(..., n)``: in the unit of the field.
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
