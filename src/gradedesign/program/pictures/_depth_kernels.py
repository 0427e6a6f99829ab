"""Compiled depth buffer and painting of surfaces, on the processor alone."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

#: Samples along a tile, whose farthest depth hides whole triangles, and samples that change before
#: it is looked up again. So many neighbouring triangles, which share vertices, are taken together.
_TILE, _STALE, _RUN = 16, 64, 512

#: Towards the light, in the picture: right, up, to the viewer. Chosen, not measured.
_LIGHT = (0.2, 0.35, 0.915)
#: Share of its colour that a triangle along the light shows. Chosen, not measured.
_DARKEST = 0.5


@njit(cache=True)
def _depth_order(places, faces):
    """Runs of neighbouring triangles, from near to far by their first corners."""
    depth = np.zeros((len(faces) + _RUN - 1) // _RUN)
    for run in range(len(depth)):
        depth[run] = places[faces[run * _RUN, 0], 2]
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
def front_triangles(places, faces, shape):
    """Depth of a surface at every sample of a picture, and the triangle that is foremost there.

    Returns two arrays of ``shape``: higher is nearer, -inf where nothing is; -1 there.

    Parameters
    ----------
    places : (n, 3) array
        Of its vertices in the picture: samples along right and up, and towards the viewer.
    faces : (m, 3) array
    shape : (int, int)
        Samples along right and up.
    """
    depth = np.full(shape, -np.inf, dtype=np.float32)
    owner = np.full(shape, -1, dtype=np.int32)
    tiles = (shape[0] // _TILE + 1, shape[1] // _TILE + 1)
    farthest = np.full(tiles, -np.inf)
    changes = np.zeros(tiles, dtype=np.int64)
    x, y, z = np.zeros(3), np.zeros(3), np.zeros(3)
    for run in _depth_order(places, faces):
        for f in range(run * _RUN, min((run + 1) * _RUN, len(faces))):
            for c in range(3):
                x[c], y[c], z[c] = (
                    places[faces[f, c], 0],
                    places[faces[f, c], 1],
                    places[faces[f, c], 2],
                )
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
    return depth, owner


@njit(cache=True)
def _shade(places, a, b, c):
    """Share of its colour that a triangle shows, by how it faces the light; both its sides do."""
    p, q = np.zeros(3), np.zeros(3)
    for k in range(3):
        p[k], q[k] = places[b, k] - places[a, k], places[c, k] - places[a, k]
    n0, n1, n2 = p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]
    length = np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
    facing = abs(n0 * _LIGHT[0] + n1 * _LIGHT[1] + n2 * _LIGHT[2]) / max(length, 1e-300)
    return _DARKEST + (1.0 - _DARKEST) * facing


@njit(cache=True, nogil=True)
def paint(picture, nearest, front, places, faces, values, per_face, colours, bounds, opacity):
    """Paint a layer into a picture where nothing in it is nearer.

    Parameters
    ----------
    picture : (w, h, 3) array of uint8
        Changed in place.
    nearest : (w, h) array
        Depth of what hides a layer; an opaque one changes it.
    front : pair of arrays
        Of `front_triangles`.
    places, faces : (n, 3), (m, 3) arrays
    values : (n,) or (m,) array
        Of vertices, or ``per_face``.
    colours : (k + 1, 3) array
        From the lower to the upper of ``bounds``, and beyond it, 0 to 255.
    bounds : (float, float)
    opacity : float
    """
    depth, owner = front
    last = len(colours) - 2
    slack = 0.0 if opacity == 1.0 else 1.0  # a layer to look through lies on another
    for i in range(picture.shape[0]):
        for j in range(picture.shape[1]):
            f = owner[i, j]
            if f < 0 or depth[i, j] < nearest[i, j] - slack:
                continue
            a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
            if per_face:
                value = values[f]
            else:
                u0, v0 = places[b, 0] - places[a, 0], places[b, 1] - places[a, 1]
                u1, v1 = places[c, 0] - places[a, 0], places[c, 1] - places[a, 1]
                u, v = i - places[a, 0], j - places[a, 1]
                area = u0 * v1 - u1 * v0
                s, t = (u * v1 - u1 * v) / area, (u0 * v - u * v0) / area
                value = (1.0 - s - t) * values[a] + s * values[b] + t * values[c]
            step = last + 1
            if value <= bounds[1]:
                step = int(max(value - bounds[0], 0.0) / (bounds[1] - bounds[0]) * last + 0.5)
            shade = _shade(places, a, b, c)
            for k in range(3):
                under = (1.0 - opacity) * picture[i, j, k]
                picture[i, j, k] = np.uint8(under + opacity * shade * colours[step, k] + 0.5)
            if opacity == 1.0:
                nearest[i, j] = depth[i, j]
