"""Compiled distances to a closed surface by lists of the triangles that may be nearest."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gradedesign import nearest_on_triangle
from gradedesign.fields import BoolArray, FloatArray, IntArray

#: Triangles are kept that are farther than others by rounding only, mm per mm.
ROUNDING = 1e-9


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
def beyond_ball(ball, t, x, y, z, within):
    """Whether the ball around a triangle, or its plane, is farther from a point than a distance."""
    dx, dy, dz = x - ball[t, 0], y - ball[t, 1], z - ball[t, 2]
    most = within + ball[t, 3]
    if dx * dx + dy * dy + dz * dz > most * most:
        return True
    off = x * ball[t, 4] + y * ball[t, 5] + z * ball[t, 6] - ball[t, 7]
    return abs(off) > within + ROUNDING


@njit(cache=True)
def nearest_listed(tri, flat, ball, normals, member, low, high, x, y, z):
    """Signed distance to the nearest of listed triangles, and its outward direction.

    The list is ``member[low:high]``; the direction is not of unit length. Baerentzen & Aanaes
    (2005): the pseudonormal of the nearest feature gives the sign. The direction is followed by the
    pseudonormal, the triangle and its feature.
    """
    best, near, at, v, w, feature = np.inf, np.inf, 0, 0.0, 0.0, 0
    for m in range(low, high):
        t = member[m]
        if beyond_ball(ball, t, x, y, z, near):
            continue
        d, share_v, share_w, code = nearest_on_triangle(tri, flat, t, x, y, z)
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


@njit(cache=True, nogil=True)
def banded_distances(low, high, points, band, beyond, distance):
    """Fill signed distances at points (3, n), or bounds where no list is; ``beyond`` all cubes."""
    tri, flat, ball, normals = band.tri, band.flat, band.ball, band.normals
    origin, edge, slot, bound = band.origin, band.edge, band.slot, band.bound
    first, member = band.first, band.member
    for i in range(low, high):
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
