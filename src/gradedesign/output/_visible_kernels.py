"""Compiled depth buffer: which triangles of a surface a picture shows."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def front_triangles(vertices, faces, right, up, back, middle, spacing, shape):
    """Mark the triangles that are foremost at a sample of the picture, ``(m,)``.

    Parameters
    ----------
    vertices, faces : (n, 3), (m, 3) arrays
    right, up, back, middle : (3,) arrays
        Of the picture's frame; parallel projection along ``-back``.
    spacing : float
        Distance of samples, mm.
    shape : (int, int)
        Samples along right and up; the middle lies between the two middle ones.
    """
    depth = np.full(shape, -np.inf, dtype=np.float32)
    owner = np.full(shape, -1, dtype=np.int32)
    x, y, z = np.zeros(3), np.zeros(3), np.zeros(3)
    for f in range(len(faces)):
        for c in range(3):
            v = faces[f, c]
            a, b, d = (
                vertices[v, 0] - middle[0],
                vertices[v, 1] - middle[1],
                vertices[v, 2] - middle[2],
            )
            x[c] = (a * right[0] + b * right[1] + d * right[2]) / spacing + 0.5 * (shape[0] - 1)
            y[c] = (a * up[0] + b * up[1] + d * up[2]) / spacing + 0.5 * (shape[1] - 1)
            z[c] = a * back[0] + b * back[1] + d * back[2]
        area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])
        if area == 0.0:
            continue
        low_i, high_i = max(int(np.ceil(x.min())), 0), min(int(np.floor(x.max())), shape[0] - 1)
        low_j, high_j = max(int(np.ceil(y.min())), 0), min(int(np.floor(y.max())), shape[1] - 1)
        for i in range(low_i, high_i + 1):
            for j in range(low_j, high_j + 1):
                u = ((x[1] - i) * (y[2] - j) - (x[2] - i) * (y[1] - j)) / area
                v = ((x[2] - i) * (y[0] - j) - (x[0] - i) * (y[2] - j)) / area
                w = 1.0 - u - v
                if min(u, v, w) < 0.0:
                    continue
                here = u * z[0] + v * z[1] + w * z[2]
                if here > depth[i, j]:
                    depth[i, j] = here
                    owner[i, j] = f
    seen = np.zeros(len(faces), dtype=np.bool_)
    for i in range(shape[0]):
        for j in range(shape[1]):
            if owner[i, j] >= 0:
                seen[owner[i, j]] = True
    return seen
