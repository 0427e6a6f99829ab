"""Compiled search for triangles of one surface that pass through each other."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit, prange

from gradedesign.geometry.triangles._cell_kernels import cell_range
from gradedesign.geometry.triangles._closest_kernels import CHUNK, DEPTH
from gradedesign.geometry.triangles._collapse_kernels import between


@njit(cache=True)
def _pierces(vertices, p, q, a, b, c, margin):
    """Whether the segment pq goes through the triangle abc, clear of both ends and all sides."""
    ux, uy, uz = between(vertices, a, b)
    vx, vy, vz = between(vertices, a, c)
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    area2 = np.sqrt(nx * nx + ny * ny + nz * nz)
    if area2 <= 0.0:
        return False
    px, py, pz = between(vertices, a, p)
    qx, qy, qz = between(vertices, a, q)
    dp = (px * nx + py * ny + pz * nz) / area2
    dq = (qx * nx + qy * ny + qz * nz) / area2
    if not ((dp > margin and dq < -margin) or (dp < -margin and dq > margin)):
        return False
    s = dp / (dp - dq)
    x, y, z = px + s * (qx - px), py + s * (qy - py), pz + s * (qz - pz)
    # Twice the signed areas over each side, along the normal; over its length, distances.
    nx, ny, nz = nx / area2, ny / area2, nz / area2
    ab = nx * (uy * z - uz * y) + ny * (uz * x - ux * z) + nz * (ux * y - uy * x)
    ca = -(nx * (vy * z - vz * y) + ny * (vz * x - vx * z) + nz * (vx * y - vy * x))
    bc = area2 - ab - ca
    wx, wy, wz = vx - ux, vy - uy, vz - uz
    return (
        ab > margin * np.sqrt(ux * ux + uy * uy + uz * uz)
        and ca > margin * np.sqrt(vx * vx + vy * vy + vz * vz)
        and bc > margin * np.sqrt(wx * wx + wy * wy + wz * wz)
    )


@njit(cache=True)
def _cross(vertices, faces, i, j, margin):
    """Whether two triangles pass through each other; neighbours across an edge never do."""
    common, at_i, at_j = 0, 0, 0
    for k in range(3):
        for m in range(3):
            if faces[i, k] == faces[j, m]:
                common += 1
                at_i, at_j = k, m
    if common >= 2:
        return False
    for k in range(3):
        m = (k + 1) % 3
        if (common == 0 or (at_i not in (k, m))) and _pierces(
            vertices, faces[i, k], faces[i, m], faces[j, 0], faces[j, 1], faces[j, 2], margin
        ):
            return True
        if (common == 0 or (at_j not in (k, m))) and _pierces(
            vertices, faces[j, k], faces[j, m], faces[i, 0], faces[i, 1], faces[i, 2], margin
        ):
            return True
    return False


@njit(cache=True)
def _bound(vertices, faces, i, low, high, plane):
    """Fill the box of triangle i, its unit normal and offset; zero for one without area."""
    for a in range(3):
        x, y, z = vertices[faces[i, 0], a], vertices[faces[i, 1], a], vertices[faces[i, 2], a]
        low[a], high[a] = min(x, y, z), max(x, y, z)
    ux, uy, uz = between(vertices, faces[i, 0], faces[i, 1])
    vx, vy, vz = between(vertices, faces[i, 0], faces[i, 2])
    plane[0], plane[1], plane[2] = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    area2 = np.sqrt(plane[0] ** 2 + plane[1] ** 2 + plane[2] ** 2)
    plane[3] = 0.0
    for a in range(3):
        plane[a] = plane[a] / area2 if area2 > 0.0 else 0.0
        plane[3] += plane[a] * vertices[faces[i, 0], a]


@njit(cache=True)
def _node_meets(box, node, low, high, plane, thin):
    """Whether a node's box meets the box from low to high and lies on both sides of the plane."""
    middle, reach = -plane[3], 0.0
    for a in range(3):
        if box[node, a] > high[a] or box[node, 3 + a] < low[a]:
            return False
        middle += plane[a] * 0.5 * (box[node, a] + box[node, 3 + a])
        reach += abs(plane[a]) * 0.5 * (box[node, 3 + a] - box[node, a])
    return middle - reach < -thin and middle + reach > thin


@njit(cache=True)
def _triangle_meets(vertices, faces, j, low, high, plane, thin):
    """Whether triangle j's box meets the box from low to high, and triangle j crosses the plane."""
    for a in range(3):
        x, y, z = vertices[faces[j, 0], a], vertices[faces[j, 1], a], vertices[faces[j, 2], a]
        if min(x, y, z) > high[a] or max(x, y, z) < low[a]:
            return False
    below, above = np.inf, -np.inf
    for k in range(3):
        v = faces[j, k]
        side = (
            plane[0] * vertices[v, 0]
            + plane[1] * vertices[v, 1]
            + plane[2] * vertices[v, 2]
            - plane[3]
        )
        below, above = min(below, side), max(above, side)
    return below < -thin and above > thin


@njit(cache=True)
def _first_crossed(vertices, faces, box, right, first, count, order, i, margin, low, high, stack):
    """The first triangle of the tree of higher number that passes through triangle i, or -1."""
    plane, thin = high[3:], 1e-3 * margin
    _bound(vertices, faces, i, low, high, plane)
    stack[0], depth = 0, 1
    while depth > 0:
        depth -= 1
        node = stack[depth]
        if not _node_meets(box, node, low, high, plane, thin):
            continue
        if right[node] >= 0:
            stack[depth], stack[depth + 1] = right[node], node + 1
            depth += 2
            continue
        for s in range(first[node], first[node] + count[node]):
            j = order[s]
            near = j > i and _triangle_meets(vertices, faces, j, low, high, plane, thin)
            if near and _cross(vertices, faces, i, j, margin):
                return j
    return -1


@njit(cache=True, parallel=True)
def find_crossed(vertices, faces, box, right, first, count, order, margin, crossed):
    """Fill, for every triangle, one of higher number that passes through it, or -1."""
    n = len(faces)
    for chunk in prange((n + CHUNK - 1) // CHUNK):
        stack = np.zeros(2 * DEPTH, dtype=np.int64)
        low, high = np.zeros(3), np.zeros(7)  # high, then the plane
        for i in range(chunk * CHUNK, min(n, (chunk + 1) * CHUNK)):
            crossed[i] = _first_crossed(
                vertices, faces, box, right, first, count, order, i, margin, low, high, stack
            )


@njit(cache=True, parallel=True, nogil=True)
def find_crossed_in_cells(
    vertices, faces, origin, spacing, shape, reach, start, users, margin, crossed
):
    """As `find_crossed`, from the triangles that share a cell of a cubic grid."""
    n = len(faces)
    thin = 1e-3 * margin
    for chunk in prange((n + CHUNK - 1) // CHUNK):
        low, high = np.zeros(3), np.zeros(7)  # high, then the plane
        cells = np.zeros((2, 3), dtype=np.int64)
        for t in range(chunk * CHUNK, min(n, (chunk + 1) * CHUNK)):
            plane = high[3:]
            _bound(vertices, faces, t, low, high, plane)
            cell_range(vertices, faces, t, origin, spacing, shape, reach, cells)
            for i in range(cells[0, 0], cells[1, 0] + 1):
                for j in range(cells[0, 1], cells[1, 1] + 1):
                    for k in range(cells[0, 2], cells[1, 2] + 1):
                        at = (i * shape[1] + j) * shape[2] + k
                        for s in range(start[at + 1] - 1, start[at] - 1, -1):
                            other = users[s]
                            if other <= t or crossed[t] >= 0:
                                break  # those of a cell are in order
                            if _triangle_meets(
                                vertices, faces, other, low, high, plane, thin
                            ) and _cross(vertices, faces, t, other, margin):
                                crossed[t] = other
