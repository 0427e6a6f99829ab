"""Compiled lists of the triangles that may be nearest in small cubes along a closed surface."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.mesh._closest_kernels import DEPTH, _box_distance2, _nearest_on_triangle, _search

#: Half diagonal of a cube of edge 1.
_HALF = 0.5 * math.sqrt(3.0)
#: Triangles are kept that are farther than others by rounding only, mm per mm.
_ROUNDING = 1e-9
#: Cubes per unit of threaded work.
CHUNK = 256


class BandArrays(NamedTuple):
    """A closed surface and the cubes around it.

    Attributes
    ----------
    tri : (m, 9) array, mm
        First corner and the two edge vectors from it.
    flat : (m,) bool array
        Triangles without area.
    ball : (m, 8) array, mm
        Centre and radius of a ball around each triangle, its plane's unit normal and place along
        it; of triangles without area both are 0.
    normals : (m, 7, 3) array
        Pseudonormals of the triangles, by feature.
    origin : (3,) array, mm
        Lower corner of the first cube.
    edge : float, mm
        Of a cube.
    slot : (a, b, c) int32 array
        List of every cube; -1 where the surface is too far away.
    bound : (a, b, c) float32 array, mm
        There, nearer to zero than the signed distance of any place in the cube. Of a cube with a
        list, the signed distance of its middle.
    first, member : (n + 1,), (k,) int arrays
        Triangles ``member[first[s]:first[s + 1]]`` of list s.
    """

    tri: FloatArray
    flat: BoolArray
    ball: FloatArray
    normals: FloatArray
    origin: FloatArray
    edge: float
    slot: NDArray[np.int32]
    bound: NDArray[np.float32]
    first: IntArray
    member: NDArray[np.int32]


@njit(cache=True, inline="always")
def cube_of(origin, edge, shape, x, y, z):
    """Cube that a point lies in; the first index is -1 outside all cubes."""
    i = math.floor((x - origin[0]) / edge)
    j = math.floor((y - origin[1]) / edge)
    k = math.floor((z - origin[2]) / edge)
    if 0 <= i < shape[0] and 0 <= j < shape[1] and 0 <= k < shape[2]:
        return i, j, k
    return -1, -1, -1


@njit(cache=True)
def _beyond(ball, t, x, y, z, within):
    """Whether the ball around a triangle, or its plane, is farther from a point than a distance."""
    dx, dy, dz = x - ball[t, 0], y - ball[t, 1], z - ball[t, 2]
    most = within + ball[t, 3]
    if dx * dx + dy * dy + dz * dz > most * most:
        return True
    off = x * ball[t, 4] + y * ball[t, 5] + z * ball[t, 6] - ball[t, 7]
    return abs(off) > within + _ROUNDING


@njit(cache=True)
def nearest_listed(tri, flat, ball, normals, member, low, high, x, y, z):
    """Signed distance to the nearest of listed triangles, its outward direction, not of unit length.

    The list is ``member[low:high]``. Baerentzen & Aanaes (2005): the pseudonormal of the nearest
    feature gives the sign. The direction is followed by the pseudonormal, the triangle and its
    feature.
    """
    best, near, at, v, w, feature = np.inf, np.inf, 0, 0.0, 0.0, 0
    for m in range(low, high):
        t = member[m]
        if _beyond(ball, t, x, y, z, near):
            continue
        d, share_v, share_w, code = _nearest_on_triangle(tri, flat, t, x, y, z)
        if d < best:
            best, at, v, w, feature = d, t, share_v, share_w, code
            near = math.sqrt(best)
    ax = x - tri[at, 0] - v * tri[at, 3] - w * tri[at, 6]
    ay = y - tri[at, 1] - v * tri[at, 4] - w * tri[at, 7]
    az = z - tri[at, 2] - v * tri[at, 5] - w * tri[at, 8]
    nx, ny, nz = normals[at, feature, 0], normals[at, feature, 1], normals[at, feature, 2]
    distance = near
    if ax * nx + ay * ny + az * nz < 0.0:
        return -distance, (-ax, -ay, -az), (nx, ny, nz), at, feature
    return distance, (ax, ay, az), (nx, ny, nz), at, feature


@njit(cache=True, parallel=True, nogil=True)
def banded_distances(band, beyond, points, distance):
    """Fill signed distances at points (3, n), or bounds where no list is; ``beyond`` all cubes."""
    tri, flat, ball, normals, origin, edge, slot, bound, first, member = band
    for i in prange(points.shape[1]):
        x, y, z = points[0, i], points[1, i], points[2, i]
        a, b, c = cube_of(origin, edge, slot.shape, x, y, z)
        if a < 0:
            distance[i] = beyond
            continue
        s = slot[a, b, c]
        if s < 0:
            distance[i] = bound[a, b, c]
        else:
            distance[i] = nearest_listed(
                tri, flat, ball, normals, member, first[s], first[s + 1], x, y, z
            )[0]


@njit(cache=True)
def _walk(tri, flat, tree, x, y, z, within, out, start, stack):
    """Triangles within a distance of a point; fills them in where ``out`` has room."""
    box, right, first, count = tree
    hits, depth, most = 0, 1, within * within
    stack[0] = 0
    while depth > 0:
        depth -= 1
        node = stack[depth]
        if _box_distance2(box, node, x, y, z) > most:
            continue
        if right[node] >= 0:
            stack[depth], stack[depth + 1] = right[node], node + 1
            depth += 2
            continue
        for s in range(first[node], first[node] + count[node]):
            if _nearest_on_triangle(tri, flat, s, x, y, z)[0] <= most:
                if len(out):
                    out[start + hits] = s
                hits += 1
    return hits


@njit(cache=True, parallel=True, nogil=True)
def list_roots(tri, flat, tree, centres, half, band, start, out):
    """List the triangles that may be nearest in large cubes, where the band may meet them.

    Parameters
    ----------
    tree : tuple of box, right, first, count
        Of a triangle tree.
    centres : (3, n) array, mm
    half : float, mm
        Half diagonal of the cubes.
    band : float, mm
        Farther cubes get one triangle, the nearest to their centre.
    start : (n + 1,) int array
        Where the lists begin; lengths are filled in while ``out`` is empty.
    out : (k,) int32 array
    """
    box, right, first, count = tree
    for n in prange(centres.shape[1]):
        stack = np.zeros(DEPTH, dtype=np.int64)
        far = np.zeros(DEPTH)
        x, y, z = centres[0, n], centres[1, n], centres[2, n]
        s, best = _search(tri, flat, box, right, first, count, x, y, z, 0, np.inf, stack, far)
        best = math.sqrt(best)
        if best - half > band:
            if len(out):
                out[start[n]] = s
            else:
                start[n] = 1
            continue
        within = best + 2.0 * half + _ROUNDING
        hits = _walk(tri, flat, tree, x, y, z, within, out, start[n], stack)
        if not len(out):
            start[n] = hits


@njit(cache=True)
def _toward(tri, s, v, w, x, y, z, distance):
    """Unit vector from the nearest point of a triangle; zero at the surface."""
    if distance <= 0.0:
        return 0.0, 0.0, 0.0
    return (
        (x - tri[s, 0] - v * tri[s, 3] - w * tri[s, 6]) / distance,
        (y - tri[s, 1] - v * tri[s, 4] - w * tri[s, 7]) / distance,
        (z - tri[s, 2] - v * tri[s, 5] - w * tri[s, 8]) / distance,
    )


@njit(cache=True, parallel=True, nogil=True)
def settle(
    tri, flat, ball, normals, lists, origin, edge, cubes, parent, reach, bound, start, out, count
):
    """Settle cubes that the band does not meet; list the triangles that may be nearest in others.

    The distance to a triangle is convex: in the cube it is at least its value at the centre plus
    its gradient there times the shift. The nearest triangle's is at most that to its nearest point
    at the centre. A triangle whose least is above that is left out.

    Parameters
    ----------
    lists : (first, member)
        Triangles of the parents.
    cubes : (n, 3) int array
        Indices of the cubes, of ``edge`` mm.
    parent : (n,) int array
        List that holds the triangles of each.
    reach : (inner, outer), mm
        Of the band.
    bound : (n,) float32 array, mm
        Filled: bounds of settled cubes, distances of the middles of others.
    start : (n + 1,) int array
        Where each cube has room for as many triangles as its parent.
    out : (k,) int32 array
        Filled from there; the nearest triangle to the centre comes first.
    count : (n,) int array
        Filled: triangles of each cube; 0 where it is settled.
    """
    first, member = lists
    inner, outer = reach
    half = _HALF * edge
    for chunk in prange((len(cubes) + CHUNK - 1) // CHUNK):
        longest = 0
        for n in range(chunk * CHUNK, min((chunk + 1) * CHUNK, len(cubes))):
            longest = max(longest, first[parent[n] + 1] - first[parent[n]])
        candidates = np.zeros((longest, 4))
        for n in range(chunk * CHUNK, min((chunk + 1) * CHUNK, len(cubes))):
            low, high = first[parent[n]], first[parent[n] + 1]
            x = origin[0] + edge * (cubes[n, 0] + 0.5)
            y = origin[1] + edge * (cubes[n, 1] + 0.5)
            z = origin[2] + edge * (cubes[n, 2] + 0.5)
            best, at, feature = np.inf, 0, 0
            for m in range(low, high):
                s = member[m]
                if _beyond(ball, s, x, y, z, best + 2.0 * half + _ROUNDING):
                    candidates[m - low, 0] = np.inf
                    continue
                d, v, w, code = _nearest_on_triangle(tri, flat, s, x, y, z)
                d = math.sqrt(d)
                own = candidates[m - low]
                own[0] = d
                own[1], own[2], own[3] = _toward(tri, s, v, w, x, y, z, d)
                if d < best:
                    best, at, feature = d, m - low, code
            gx, gy, gz = candidates[at, 1], candidates[at, 2], candidates[at, 3]
            normal = normals[member[low + at], feature]
            outside = gx * normal[0] + gy * normal[1] + gz * normal[2] >= 0.0
            if best - half > (outer if outside else inner):
                # Nearer to zero by more than float32 rounds.
                near = (best - half) * (1.0 - 1e-6)
                bound[n] = near if outside else -near
                count[n] = 0
                continue
            bound[n] = best if outside else -best
            kept = 1
            out[start[n]] = member[low + at]
            for m in range(high - low):
                d, hx, hy, hz = candidates[m]
                if m == at or d > best + 2.0 * half + _ROUNDING:
                    continue
                apart = half + min(half, 0.5 * edge * (abs(hx) + abs(hy) + abs(hz)))
                if best > 0.0 and d > 0.0:
                    turn = 0.5 * edge * (abs(gx - hx) + abs(gy - hy) + abs(gz - hz))
                    apart = min(apart, turn + half * half / (2.0 * best))
                if d - best <= apart + _ROUNDING:
                    out[start[n] + kept] = member[low + m]
                    kept += 1
            count[n] = kept


@njit(cache=True, nogil=True)
def gather(start, count, out, first, member):
    """Put lists with room between them (see `settle`) one behind the other."""
    for n in range(len(count)):
        for m in range(count[n]):
            member[first[n] + m] = out[start[n] + m]


@njit(cache=True, nogil=True)
def paint(cubes, bound, wide, kept, slot, grid):
    """Write the bounds of settled cubes of ``wide`` small ones, and the numbers of kept ones.

    Of the last kept ones the distances of their middles are written too.
    """
    for n in range(len(cubes)):
        if kept[n] >= 0 and slot.size:
            slot[cubes[n, 0], cubes[n, 1], cubes[n, 2]] = kept[n]
        if kept[n] < 0 or slot.size:
            i, j, k = wide * cubes[n, 0], wide * cubes[n, 1], wide * cubes[n, 2]
            grid[i : i + wide, j : j + wide, k : k + wide] = bound[n]
