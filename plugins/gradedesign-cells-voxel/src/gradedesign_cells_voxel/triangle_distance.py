"""Distance to a set of triangles of period 1, exact."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from gradedesign.fields import FloatArray, compiled_values
from gradedesign_cells_voxel._mesh_kernels import nearest_distance

#: Bits of each coordinate in the order of the leaves.
_BITS = 10


def periodic_triangle_distance(corners: FloatArray, points: FloatArray) -> FloatArray:
    """Distance of points to the nearest copy of triangles.

    Parameters
    ----------
    corners : (m, 3 corners, 3 coordinates) array, cell units
        One of each set of copies, within the unit cell.
    points : (3, ...) array, cell units

    Returns
    -------
    (...) array, cell units
        Never negative.
    """
    triangles = corners[np.argsort(_morton(corners.mean(axis=1)), kind="stable")]
    lower, upper = _boxes(triangles)
    # The cell itself first: what is found there rules out most of the copies.
    shifts = np.array(sorted(product((-1.0, 0.0, 1.0), repeat=3), key=np.linalg.norm))
    rows = np.ascontiguousarray(triangles.reshape(-1, 9))
    inside = np.mod(np.asarray(points, dtype=np.float64), 1.0)
    return compiled_values(nearest_distance, inside, shifts, rows, lower, upper)


def _morton(places: FloatArray) -> NDArray[np.int64]:
    """Numbers that are close for places that are close, by interleaving bits, ``(m,)``."""
    steps = np.clip(places * 2**_BITS, 0, 2**_BITS - 1).astype(np.int64)
    code = np.zeros(len(places), dtype=np.int64)
    for bit in range(_BITS):
        for axis in range(3):
            code |= ((steps[:, axis] >> bit) & 1) << (3 * bit + axis)
    return code


def _boxes(triangles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Boxes of a full binary tree over triangles in order, node 1 the root, ``(2 p, 3)`` each."""
    leaves = 1 << max(len(triangles) - 1, 0).bit_length()
    lower = np.full((2 * leaves, 3), np.inf)
    upper = np.full((2 * leaves, 3), -np.inf)
    lower[leaves : leaves + len(triangles)] = triangles.min(axis=1)
    upper[leaves : leaves + len(triangles)] = triangles.max(axis=1)
    first = leaves // 2
    while first:
        lower[first : 2 * first] = lower[2 * first : 4 * first].reshape(-1, 2, 3).min(axis=1)
        upper[first : 2 * first] = upper[2 * first : 4 * first].reshape(-1, 2, 3).max(axis=1)
        first //= 2
    return lower, upper
