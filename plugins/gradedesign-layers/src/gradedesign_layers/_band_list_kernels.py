"""Compiled lists of the triangles that may be nearest in small cubes along a closed surface."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import math

import numpy as np
from numba import njit

from gradedesign import nearest_on_triangle
from gradedesign_layers._surface_band_kernels import ROUNDING, beyond_ball

#: Half diagonal of a cube of edge 1.
_HALF = 0.5 * math.sqrt(3.0)
#: Cubes per unit of threaded work; few, since the first have long lists. Chosen, not measured.
CUBES = 16


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


@njit(cache=True, nogil=True)
def settle(
    begin, end, tri, flat, ball, normals, lists, origin, edge, cubes, parent, reach, bound, start,
    out, count,
):  # fmt: skip
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
    longest = 0
    for n in range(begin, end):
        longest = max(longest, first[parent[n] + 1] - first[parent[n]])
    candidates = np.zeros((longest, 4))
    for n in range(begin, end):
        low, high = first[parent[n]], first[parent[n] + 1]
        x = origin[0] + edge * (cubes[n, 0] + 0.5)
        y = origin[1] + edge * (cubes[n, 1] + 0.5)
        z = origin[2] + edge * (cubes[n, 2] + 0.5)
        best, at, feature = np.inf, 0, 0
        for m in range(low, high):
            s = member[m]
            if beyond_ball(ball, s, x, y, z, best + 2.0 * half + ROUNDING):
                candidates[m - low, 0] = np.inf
                continue
            d, v, w, code = nearest_on_triangle(tri, flat, s, x, y, z)
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
            if m == at or d > best + 2.0 * half + ROUNDING:
                continue
            apart = half + min(half, 0.5 * edge * (abs(hx) + abs(hy) + abs(hz)))
            if best > 0.0 and d > 0.0:
                turn = 0.5 * edge * (abs(gx - hx) + abs(gy - hy) + abs(gz - hz))
                apart = min(apart, turn + half * half / (2.0 * best))
            if d - best <= apart + ROUNDING:
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
