"""Compiled distances on a grid: triangles into bricks, exact bands, signs, far fields.

Lengths are in grid spacings from the first node. Above 300 lines: bands, signs and sweeps share
the bricks' indices and the nearest point of a triangle.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit, prange

from gradedesign.geometry.triangles._closest_kernels import DEPTH, nearest_on_triangle
from gradedesign.geometry.triangles._fast_winding_kernels import winding

#: Nodes along the edge of a brick, and in it.
SIDE = 8
NODES = SIDE**3
#: Winding number from which on a point is inside.
INSIDE = 0.5
#: Rows along the edge of a tile that one thread sweeps.
TILE = 16


@njit(cache=True)
def _visit(tri, flat, s, shape, reach, first, pairs):
    """Number of bricks within ``reach`` of a triangle; fills them in where ``pairs`` has room."""
    stack = np.zeros((DEPTH, 6), dtype=np.int64)
    box = np.zeros(6, dtype=np.int64)
    for a in range(3):
        low = tri[s, a] + min(0.0, tri[s, 3 + a], tri[s, 6 + a]) - reach
        high = tri[s, a] + max(0.0, tri[s, 3 + a], tri[s, 6 + a]) + reach
        # In the box of a brick's nodes there may be a gap to the next brick's.
        stack[0, a] = max(0, int(np.floor((low + 1.0) / SIDE)))
        stack[0, 3 + a] = min(shape[a] - 1, int(np.floor(high / SIDE)))
        if stack[0, a] > stack[0, 3 + a]:
            return 0
    found, depth = 0, 1
    while depth > 0:
        depth -= 1
        for a in range(6):
            box[a] = stack[depth, a]
        x = 0.5 * SIDE * (box[0] + box[3] + 1) - 0.5
        y = 0.5 * SIDE * (box[1] + box[4] + 1) - 0.5
        z = 0.5 * SIDE * (box[2] + box[5] + 1) - 0.5
        round2, axis, longest = 0.0, 0, 0
        for a in range(3):
            edge = box[3 + a] - box[a]
            half = 0.5 * SIDE * (edge + 1) - 0.5
            round2 += half * half
            if edge > longest:
                longest, axis = edge, a
        far, _, _, _ = nearest_on_triangle(tri, flat, s, x, y, z)
        if far > (reach + np.sqrt(round2)) ** 2:
            continue
        if longest == 0:
            if len(pairs):
                pairs[first + found] = (box[0] * shape[1] + box[1]) * shape[2] + box[2]
            found += 1
            continue
        middle = (box[axis] + box[3 + axis]) // 2
        for a in range(6):
            stack[depth, a] = box[a]
            stack[depth + 1, a] = box[a]
        stack[depth, 3 + axis] = middle
        stack[depth + 1, axis] = middle + 1
        depth += 2
    return found


@njit(cache=True, parallel=True, nogil=True)
def count_bricks(tri, flat, shape, reach, count):
    """Fill how many bricks lie within ``reach`` of every triangle."""
    none = np.zeros(0, dtype=np.int64)
    for s in prange(len(tri)):
        count[s] = _visit(tri, flat, s, shape, reach, 0, none)


@njit(cache=True, parallel=True, nogil=True)
def list_bricks(tri, flat, shape, reach, first, pairs):
    """Fill the bricks of every triangle from its ``first`` place on."""
    for s in prange(len(tri)):
        _visit(tri, flat, s, shape, reach, first[s], pairs)


@njit(cache=True, nogil=True)
def sort_pairs(pairs, first, slot, start, member):
    """Sort triangles by brick: those of the n-th are ``member[start[n]:start[n + 1]]``."""
    filled = start[:-1].copy()
    for s in range(len(first) - 1):
        for p in range(first[s], first[s + 1]):
            n = slot[pairs[p]]
            member[filled[n]] = s
            filled[n] += 1


@njit(cache=True, parallel=True, nogil=True)
def fill_bands(tri, flat, brick, shape, start, member, reach, values, near):
    """Fill distances up to ``reach`` at the nodes of bricks, and the triangle that is nearest.

    Parameters
    ----------
    brick : (n,) int array
        Number of every brick in the grid of ``shape`` bricks.
    values : (n, 512) float32 array
        ``reach`` where nothing is nearer.
    near : (n, 512) int32 array
        Sorted place of the triangle; -1 where nothing is nearer.
    """
    for n in prange(len(brick)):
        ox = SIDE * (brick[n] // (shape[1] * shape[2]))
        oy = SIDE * (brick[n] // shape[2] % shape[1])
        oz = SIDE * (brick[n] % shape[2])
        best = np.full(NODES, reach * reach)
        own = near[n]
        own[:] = -1
        for m in range(start[n], start[n + 1]):
            s = member[m]
            i0, i1 = _span(tri, s, 0, ox, reach)
            j0, j1 = _span(tri, s, 1, oy, reach)
            k0, k1 = _span(tri, s, 2, oz, reach)
            nx = tri[s, 4] * tri[s, 8] - tri[s, 5] * tri[s, 7]
            ny = tri[s, 5] * tri[s, 6] - tri[s, 3] * tri[s, 8]
            nz = tri[s, 3] * tri[s, 7] - tri[s, 4] * tri[s, 6]
            length = np.sqrt(nx * nx + ny * ny + nz * nz)
            scale = 0.0 if flat[s] else 1.0 / length
            nx, ny, nz = nx * scale, ny * scale, nz * scale
            for i in range(i0, i1):
                for j in range(j0, j1):
                    x, y = float(ox + i), float(oy + j)
                    height = nx * (x - tri[s, 0]) + ny * (y - tri[s, 1])
                    for k in range(k0, k1):
                        z = float(oz + k)
                        off = height + nz * (z - tri[s, 2])
                        at = (i * SIDE + j) * SIDE + k
                        if off * off > best[at]:
                            continue
                        d, _, _, _ = nearest_on_triangle(tri, flat, s, x, y, z)
                        if d < best[at]:
                            best[at] = d
                            own[at] = s
        for at in range(NODES):
            values[n, at] = np.sqrt(best[at])


@njit(cache=True)
def _span(tri, s, axis, origin, reach):
    """Range of a brick's nodes along an axis that a triangle may be near to."""
    low = tri[s, axis] + min(0.0, tri[s, 3 + axis], tri[s, 6 + axis]) - reach - origin
    high = tri[s, axis] + max(0.0, tri[s, 3 + axis], tri[s, 6 + axis]) + reach - origin
    return max(0, int(np.ceil(low))), min(SIDE, int(np.floor(high)) + 1)


@njit(cache=True, parallel=True, nogil=True)
def sign_bands(tri, turn, right, first, count, moments, brick, shape, values, apart, several):
    """Turn distances inside negative, by the winding number.

    Nodes farther than ``apart`` from all triangles that are connected along the grid within their
    brick share the sign of one of them. With ``several`` it is asked at their six extreme nodes,
    and at each node where these disagree: a hole may connect inside and outside.
    """
    for n in prange(len(brick)):
        ox = SIDE * (brick[n] // (shape[1] * shape[2]))
        oy = SIDE * (brick[n] // shape[2] % shape[1])
        oz = SIDE * (brick[n] % shape[2])
        stack = np.zeros(DEPTH, dtype=np.int64)
        queue = np.zeros(NODES, dtype=np.int64)
        done = np.zeros(NODES, dtype=np.bool_)
        extreme = np.zeros(6, dtype=np.int64)
        for at in range(NODES):
            if done[at]:
                continue
            done[at] = True
            queue[0], filled = at, 1
            if values[n, at] > apart:
                filled = _flood(values[n], apart, done, queue)
            asked = 1
            extreme[0] = at
            if several and filled > 1:
                asked = 6
                _extremes(queue, filled, extreme)
            inside, last = 0, 0
            for e in range(asked):
                if e > 0 and extreme[e] == extreme[e - 1]:
                    inside += last
                    continue
                x, y, z = _place(ox, oy, oz, extreme[e])
                w = winding(tri, turn, right, first, count, moments, x, y, z, stack)
                last = int(w > INSIDE)
                inside += last
            for q in range(filled):
                here = inside == asked
                if 0 < inside < asked:
                    x, y, z = _place(ox, oy, oz, queue[q])
                    w = winding(tri, turn, right, first, count, moments, x, y, z, stack)
                    here = w > INSIDE
                if here:
                    values[n, queue[q]] = -values[n, queue[q]]


@njit(cache=True)
def _place(ox, oy, oz, at):
    """Coordinates of a node of a brick."""
    return float(ox + at // (SIDE * SIDE)), float(oy + at // SIDE % SIDE), float(oz + at % SIDE)


@njit(cache=True)
def _flood(values, apart, done, queue):
    """Collect the nodes that are connected to the first of the queue; returns their number."""
    read, filled = 0, 1
    while read < filled:
        at = queue[read]
        read += 1
        for step in (SIDE * SIDE, SIDE, 1):
            along = at // step % SIDE
            for ahead in (-1, 1):
                if not 0 <= along + ahead < SIDE:
                    continue
                to = at + ahead * step
                if not done[to] and values[to] > apart:
                    done[to] = True
                    queue[filled] = to
                    filled += 1
    return filled


@njit(cache=True)
def _extremes(queue, filled, extreme):
    """First nodes along each axis, which are often one, then last ones."""
    for a, step in enumerate((SIDE * SIDE, SIDE, 1)):
        low, high = SIDE, -1
        for q in range(filled):
            along = queue[q] // step % SIDE
            if along < low:
                low, extreme[a] = along, queue[q]
            if along > high:
                high, extreme[3 + a] = along, queue[q]


@njit(cache=True, parallel=True, nogil=True)
def sign_rest(tri, turn, right, first, count, moments, slot, shape, inside):
    """Mark bricks without triangles that lie inside, by the winding number at their centre."""
    for row in prange(shape[0] * shape[1]):
        stack = np.zeros(DEPTH, dtype=np.int64)
        for k in range(shape[2]):
            brick = row * shape[2] + k
            if slot[brick] < 0:
                x = SIDE * (row // shape[1]) + 0.5 * (SIDE - 1)
                y = SIDE * (row % shape[1]) + 0.5 * (SIDE - 1)
                z = SIDE * k + 0.5 * (SIDE - 1)
                w = winding(tri, turn, right, first, count, moments, x, y, z, stack)
                inside[brick] = w > INSIDE


@njit(cache=True, parallel=True, nogil=True)
def count_seeds(values, most, count):
    """Fill how many even nodes of every brick lie within ``most`` of the triangles."""
    for n in prange(len(values)):
        for at in range(NODES):
            count[n] += _even(at) and abs(values[n, at]) <= most


@njit(cache=True)
def _even(at):
    """Whether a node of a brick has even numbers along all axes."""
    return (at // (SIDE * SIDE) | at // SIDE | at) & 1 == 0


@njit(cache=True, parallel=True, nogil=True)
def place_seeds(tri, flat, brick, shape, values, near, most, first, points, seed, square):
    """Fill the closest points of the even nodes near the triangles.

    Parameters
    ----------
    points : (k, 3) float32 array
    seed, square : (a, b, c) arrays, int32 and float32
        Of the even nodes: which point is nearest, and its squared distance.
    """
    for n in prange(len(brick)):
        ox = SIDE * (brick[n] // (shape[1] * shape[2]))
        oy = SIDE * (brick[n] // shape[2] % shape[1])
        oz = SIDE * (brick[n] % shape[2])
        p = first[n]
        for at in range(NODES):
            if not _even(at) or abs(values[n, at]) > most:
                continue
            x, y, z = _place(ox, oy, oz, at)
            s = near[n, at]
            d, v, w, _ = nearest_on_triangle(tri, flat, s, x, y, z)
            for a in range(3):
                points[p, a] = tri[s, a] + v * tri[s, 3 + a] + w * tri[s, 6 + a]
            i, j, k = int(x) // 2, int(y) // 2, int(z) // 2
            if i < seed.shape[0] and j < seed.shape[1] and k < seed.shape[2]:
                seed[i, j, k] = p
                square[i, j, k] = d
            p += 1


@njit(cache=True)
def _take(points, seed, square, i, j, k, s):
    """Let an even node take a neighbour's seed if that is nearer than its own."""
    if s >= 0 and s != seed[i, j, k]:
        dx, dy, dz = 2 * i - points[s, 0], 2 * j - points[s, 1], 2 * k - points[s, 2]
        d = dx * dx + dy * dy + dz * dz
        if d < square[i, j, k]:
            square[i, j, k] = d
            seed[i, j, k] = s


@njit(cache=True)
def _sweep_row(points, seed, square, i, j, back_x, back_y):
    """Let a row along z take the seeds of the rows before it, then hand them on both ways."""
    nx, ny, nz = seed.shape
    if 0 <= i + back_x < nx:
        for k in range(nz):
            _take(points, seed, square, i, j, k, seed[i + back_x, j, k])
    if 0 <= j + back_y < ny:
        for k in range(nz):
            _take(points, seed, square, i, j, k, seed[i, j + back_y, k])
    for k in range(1, nz):
        _take(points, seed, square, i, j, k, seed[i, j, k - 1])
    for k in range(nz - 2, -1, -1):
        _take(points, seed, square, i, j, k, seed[i, j, k + 1])


@njit(cache=True, parallel=True, nogil=True)
def sweep(points, seed, square, forward_x, forward_y):
    """Sweep seeds over the even nodes, one way along x and y, both ways along z.

    Tiles of rows along z of one diagonal across x and y depend on the diagonal before only.
    """
    nx, ny, _ = seed.shape
    across, along = (nx + TILE - 1) // TILE, (ny + TILE - 1) // TILE
    back_x, back_y = -1 if forward_x else 1, -1 if forward_y else 1
    for diagonal in range(across + along - 1):
        low = max(0, diagonal - along + 1)
        for tile in prange(min(diagonal, across - 1) - low + 1):
            u, v = TILE * (low + tile), TILE * (diagonal - low - tile)
            for a in range(u, min(u + TILE, nx)):
                i = a if forward_x else nx - 1 - a
                for b in range(v, min(v + TILE, ny)):
                    j = b if forward_y else ny - 1 - b
                    _sweep_row(points, seed, square, i, j, back_x, back_y)


@njit(cache=True)
def _swept(points, seed, i, j, k):
    """Distance of a node to the nearer of the seeds of the even nodes before and behind it."""
    s = seed[i // 2, j // 2, k // 2]
    dx, dy, dz = i - points[s, 0], j - points[s, 1], k - points[s, 2]
    best = dx * dx + dy * dy + dz * dz
    a = min((i + 1) // 2, seed.shape[0] - 1)
    b = min((j + 1) // 2, seed.shape[1] - 1)
    c = min((k + 1) // 2, seed.shape[2] - 1)
    if seed[a, b, c] != s:
        s = seed[a, b, c]
        dx, dy, dz = i - points[s, 0], j - points[s, 1], k - points[s, 2]
        best = min(best, dx * dx + dy * dy + dz * dz)
    return np.sqrt(best)


@njit(cache=True, parallel=True, nogil=True)
def finish(slot, shape, values, inside, reach, points, seed, spacing, result):
    """Fill signed distances, mm: exact ones where bricks hold them, else to the nearest seed."""
    nx, ny, nz = result.shape
    for i in prange(nx):
        for j in range(ny):
            row = (i // SIDE * shape[1] + j // SIDE) * shape[2]
            in_brick = (i % SIDE * SIDE + j % SIDE) * SIDE
            for k in range(nz):
                n = slot[row + k // SIDE]
                known = np.float32(0.0)
                if n >= 0:
                    known = values[n, in_brick + k % SIDE]
                    if abs(known) < reach:
                        result[i, j, k] = spacing * known
                        continue
                d = spacing * _swept(points, seed, i, j, k)
                within = inside[row + k // SIDE] if n < 0 else known < 0
                result[i, j, k] = -d if within else d
