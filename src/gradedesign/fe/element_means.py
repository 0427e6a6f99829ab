"""Exact element means on straight quadratic tetrahedra, for sensitivities."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.fe.space import TetSpace
from gradedesign.mesh.tet_mesh import signed_volumes

#: Vertex pairs of the six mid-edge nodes, in scikit-fem's order.
EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))


def barycentric_gradients(space: TetSpace) -> FloatArray:
    """Gradients of the four barycentric coordinates, ``(4, 3, M)``, 1/mm."""
    p = space.mesh.points[:, space.mesh.tets]
    a, b, c = (p[:, k] - p[:, 0] for k in (1, 2, 3))
    det = np.einsum("ij,ij->j", a, np.cross(b, c, axis=0))
    g1 = np.cross(b, c, axis=0) / det
    g2 = np.cross(c, a, axis=0) / det
    g3 = np.cross(a, b, axis=0) / det
    return np.stack([-(g1 + g2 + g3), g1, g2, g3])


def mean_strain(space: TetSpace, displacement: FloatArray) -> FloatArray:
    """Mean strain of every element, ``(6, M)``, Voigt with engineering shear.

    The strain of a quadratic element is linear, so its mean is its value at the centroid.
    """
    g = barycentric_gradients(space)
    gradient = np.zeros((3, 3, space.elements.shape[1]))
    if space.order == 1:
        for k in range(4):
            gradient += displacement[:, None, space.elements[k]] * g[k][None]
    else:
        for k, (i, j) in enumerate(EDGES):
            gradient += displacement[:, None, space.elements[4 + k]] * (g[i] + g[j])[None]
    return np.stack(
        [
            gradient[0, 0],
            gradient[1, 1],
            gradient[2, 2],
            gradient[1, 2] + gradient[2, 1],
            gradient[0, 2] + gradient[2, 0],
            gradient[0, 1] + gradient[1, 0],
        ]
    )


def body_force_work(
    space: TetSpace, acceleration: FloatArray, displacement: FloatArray
) -> FloatArray:
    """Integral of ``acceleration . displacement`` over every element, ``(M,)``, mm^5/s^2.

    Multiplied by mass per volume it is the work of inertia forces in N mm.
    """
    projected = np.asarray(acceleration) @ displacement
    values = projected[space.elements]
    if space.order == 1:
        mean = values.mean(axis=0)
    else:
        mean = 0.2 * values[4:].sum(axis=0) - 0.05 * values[:4].sum(axis=0)
    return signed_volumes(space.mesh) * mean
