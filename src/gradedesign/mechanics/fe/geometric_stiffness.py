"""Geometric stiffness of tetrahedra: what a stress adds to the stiffness of a displaced solid.

Its matrix joins equal components of the displacement alone, and these alike, so that it is kept for
one of them.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix

from gradedesign.arrays import FloatArray
from gradedesign.geometry.tets.tet_mesh import signed_volumes
from gradedesign.mechanics.fe.element_points import (
    barycentric,
    coordinate_gradients,
    shape_derivatives,
)
from gradedesign.mechanics.fe.space import TetSpace

#: Elements whose gradients are held at once. Chosen, not measured.
_CHUNK = 20_000


def geometric_stiffness(space: TetSpace, stress: FloatArray) -> csr_matrix:
    """Integrals of ``grad Na . stress . grad Nb``, ``(N, N)``, N/mm.

    ``stress (3, 3, M, 4)``, MPa: at the Gauss points, as by `element_stress`.
    """
    volumes, count = signed_volumes(space.mesh) / 4.0, space.element_count
    nodes = space.elements.T.astype(np.int64)
    rows, columns, values = [], [], []
    for first in range(0, count, _CHUNK):
        part = slice(first, min(first + _CHUNK, count))
        slopes = _slopes(space, part)
        flux = np.einsum("xymq,mqby->mqbx", stress[:, :, part], slopes, optimize=True)
        own = np.einsum("m,mqax,mqbx->mab", volumes[part], slopes, flux, optimize=True)
        rows.append(np.repeat(nodes[part], nodes.shape[1], axis=1).ravel())
        columns.append(np.tile(nodes[part], (1, nodes.shape[1])).ravel())
        values.append(own.ravel())
    entries = (np.concatenate(rows), np.concatenate(columns))
    shape = (space.node_count, space.node_count)
    return csr_matrix(coo_matrix((np.concatenate(values), entries), shape=shape))


def gradient_products(space: TetSpace, u: FloatArray) -> FloatArray:
    """Sums over the components of products of two derivatives of ``u`` ``(3, N)``, (3, 3, M, 4).

    Times a stress, over the volume, they are the work of its geometric stiffness on ``u``.
    """
    count = space.element_count
    out = np.zeros((3, 3, count, 4))
    for first in range(0, count, _CHUNK):
        part = slice(first, min(first + _CHUNK, count))
        moved = u[:, space.elements[:, part]]
        gradient = np.einsum("mqay,kam->kymq", _slopes(space, part), moved, optimize=True)
        out[:, :, part] = np.einsum("kxmq,kymq->xymq", gradient, gradient)
    return out


def _slopes(space: TetSpace, part: slice) -> FloatArray:
    """Gradients of the shape functions at the Gauss points of some elements, ``(m, 4, a, 3)``."""
    shapes = shape_derivatives(space.order, barycentric("gauss"))
    gradients = coordinate_gradients(space, part)
    return np.asarray(np.einsum("qav,mvy->mqay", shapes, gradients, optimize=True))
