"""Compiled depth buffer: which triangles of a surface a picture shows."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

#: Samples along a tile, whose farthest depth hides whole triangles, and samples that change before
#: it is looked up again. So many neighbouring triangles, which share vertices, are taken together.
_TILE, _STALE, _RUN = 16, 64, 512


@njit(cache=True)
def _depth_order(vertices, faces, back):
    """Runs of neighbouring triangles, from near to far by their first corners."""
    depth = np.zeros((len(faces) + _RUN - 1) // _RUN)
    for run in range(len(depth)):
        v = faces[run * _RUN, 0]
        depth[run] = vertices[v, 0] * back[0] + vertices[v, 1] * back[1] + vertices[v, 2] * back[2]
    return np.argsort(-depth)


@njit(cache=True)
def _farthest(depth, p, q):
    """Least depth of a tile; higher is nearer."""
    least = np.inf
    for i in range(p * _TILE, min((p + 1) * _TILE, depth.shape[0])):
        for j in range(q * _TILE, min((q + 1) * _TILE, depth.shape[1])):
            least = min(least, depth[i, j])
    return least


@njit(cache=True)
def _is_hidden(depth, farthest, changes, nearest, low_i, high_i, low_j, high_j):
    """Whether all tiles between samples are nearer than a depth throughout."""
    for p in range(low_i // _TILE, high_i // _TILE + 1):
        for q in range(low_j // _TILE, high_j // _TILE + 1):
            if changes[p, q] >= _STALE:
                farthest[p, q] = _farthest(depth, p, q)
                changes[p, q] = 0
            if nearest > farthest[p, q]:
                return False
    return True


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
    tiles = (shape[0] // _TILE + 1, shape[1] // _TILE + 1)
    farthest = np.full(tiles, -np.inf)
    changes = np.zeros(tiles, dtype=np.int64)
    x, y, z = np.zeros(3), np.zeros(3), np.zeros(3)
    for run in _depth_order(vertices, faces, back):
        for f in range(run * _RUN, min((run + 1) * _RUN, len(faces))):
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
            low_i = max(int(np.ceil(min(x[0], x[1], x[2]))), 0)
            high_i = min(int(np.floor(max(x[0], x[1], x[2]))), shape[0] - 1)
            low_j = max(int(np.ceil(min(y[0], y[1], y[2]))), 0)
            high_j = min(int(np.floor(max(y[0], y[1], y[2]))), shape[1] - 1)
            if low_i > high_i or low_j > high_j:
                continue
            nearest = max(z[0], z[1], z[2])
            if _is_hidden(depth, farthest, changes, nearest, low_i, high_i, low_j, high_j):
                continue
            u_up, v_up = (x[2] - x[1]) / area, (x[0] - x[2]) / area
            z_u, z_v = z[0] - z[2], z[1] - z[2]
            for i in range(low_i, high_i + 1):
                u_start = ((x[1] - i) * y[2] - (x[2] - i) * y[1]) / area
                v_start = ((x[2] - i) * y[0] - (x[0] - i) * y[2]) / area
                for j in range(low_j, high_j + 1):
                    u, v = u_start + u_up * j, v_start + v_up * j
                    if u < 0.0 or v < 0.0 or u + v > 1.0:
                        continue
                    here = z[2] + u * z_u + v * z_v
                    if here > depth[i, j]:
                        depth[i, j] = here
                        owner[i, j] = f
                        changes[i // _TILE, j // _TILE] += 1
    seen = np.zeros(len(faces), dtype=np.bool_)
    for i in range(shape[0]):
        for j in range(shape[1]):
            if owner[i, j] >= 0:
                seen[owner[i, j]] = True
    return seen
