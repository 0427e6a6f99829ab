"""Compiled field of round struts in equal cells with a net-skin, trimmed by a surface.

Inner functions take plain arrays: records of arrays are unpacked once, ahead of the loops, since
compilers do not lift their fields out of them.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gradedesign.fields import FloatArray
from gradedesign_layers._surface_band_kernels import cube_of, nearest_listed

#: Halvings of the distance of depths about the best one, see `net_skin`.
HALVINGS = 3
#: Farthest that they reach together, in steps of the depths.
REACH = 1.0 - 0.5**HALVINGS
#: Nearer to the surface, mm, its normal gives the direction, see `SurfaceDistance`.
AT_SURFACE = 1e-6
#: Values this much apart, mm, differ by rounding: of equal ones that at the least depth counts.
TIED = 1e-9


class StrutArrays(NamedTuple):
    """Round struts of period 1 in straight cells, and the level that bounds them.

    Attributes
    ----------
    bins : int
        Of the cell along each axis.
    first, member : (bins^3 + 1,), (k,) int32 arrays
        Struts that may be the nearest in each bin.
    strut : (c, 8) array, cell units
        End, unit direction and length of each, and one over its relative thickness.
    matrix : (3, 3) array, 1/mm
        Points to cell coordinates.
    start : (3,) array, mm
        Where a corner of a cell lies.
    scale : float, mm
        Cell's values to mm.
    level : float, cell units
    steep : float
        Largest slope of the field, mm per mm.
    """

    bins: int
    first: NDArray[np.int32]
    member: NDArray[np.int32]
    strut: FloatArray
    matrix: FloatArray
    start: FloatArray
    scale: float
    level: float
    steep: float


@njit(cache=True, inline="always")
def cell_value(bins, first, member, strut, matrix, start, scale, level, x, y, z):
    """Field of the struts, about mm, negative inside; the others are those of `StrutArrays`."""
    x, y, z = x - start[0], y - start[1], z - start[2]
    u = matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2] * z
    v = matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2] * z
    w = matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2] * z
    u, v, w = u - math.floor(u), v - math.floor(v), w - math.floor(w)
    # A tiny negative coordinate rounds to 1, which is the far side of the last bin.
    a, b, c = (
        min(int(u * bins), bins - 1),
        min(int(v * bins), bins - 1),
        min(int(w * bins), bins - 1),
    )
    place = (a * bins + b) * bins + c
    least = np.inf
    for entry in range(first[place], first[place + 1]):
        k = member[entry]
        dx, dy, dz = u - strut[k, 0], v - strut[k, 1], w - strut[k, 2]
        along = dx * strut[k, 3] + dy * strut[k, 4] + dz * strut[k, 5]
        foot = min(max(along, 0.0), strut[k, 6])
        dx, dy, dz = dx - foot * strut[k, 3], dy - foot * strut[k, 4], dz - foot * strut[k, 5]
        least = min(least, (dx * dx + dy * dy + dz * dz) * (strut[k, 7] * strut[k, 7]))
    return scale * (math.sqrt(least) - level)


@njit(cache=True)
def least_sample(
    bins, first, member, strut, matrix, start, scale, level, steep,
    foot, outward, depths, enough, limit, stack, ends,
):  # fmt: skip
    """Least value below a foot of samples at even depths, and the number of its depth.

    It ends at a value of at most ``enough``; one above ``limit`` need not be the least. Between two
    depths the value cannot fall faster than its largest slope: where that leaves no room below the
    least yet, nothing is evaluated.
    """
    last = len(depths) - 1
    fall = steep * (depths[1] - depths[0])
    x, y, z = foot
    nx, ny, nz = outward
    least, best = np.inf, 0
    for k in (0, last):
        d = depths[k]
        value = cell_value(
            bins, first, member, strut, matrix, start, scale, level,
            x - d * nx, y - d * ny, z - d * nz,
        )  # fmt: skip
        ends[0, 0 if k == 0 else 1] = value
        if value < least:
            least, best = value, k
            if least <= enough:
                return least, best
    stack[0, 0], stack[0, 1], depth = 0, last, 1
    while depth > 0:
        depth -= 1
        a, b = stack[depth, 0], stack[depth, 1]
        va, vb = ends[depth, 0], ends[depth, 1]
        if b - a < 2 or 0.5 * (va + vb - fall * (b - a)) > min(least, limit) + TIED:
            continue
        k = math.floor(0.5 * (a + b) + 0.5 * (va - vb) / fall + 0.5)
        k = min(max(k, a + 1), b - 1)
        d = depths[k]
        value = cell_value(
            bins, first, member, strut, matrix, start, scale, level,
            x - d * nx, y - d * ny, z - d * nz,
        )  # fmt: skip
        if value < least or (value == least and k < best):
            least, best = value, k
            if least <= enough:
                return least, best
        stack[depth, 0], stack[depth, 1] = k, b
        ends[depth, 0], ends[depth, 1] = value, vb
        stack[depth + 1, 0], stack[depth + 1, 1] = a, k
        ends[depth + 1, 0], ends[depth + 1, 1] = va, value
        depth += 2
    return least, best


@njit(cache=True)
def refined(
    bins, first, member, strut, matrix, start, scale, level,
    foot, outward, depths, least, best, enough,
):  # fmt: skip
    """Least value about the depth of the least sample; it ends at a value of at most ``enough``."""
    x, y, z = foot
    nx, ny, nz = outward
    last = len(depths) - 1
    at, step = depths[best], depths[1] - depths[0]
    for _ in range(HALVINGS):
        step *= 0.5
        middle = at
        for shift in (-step, step):
            d = min(max(middle + shift, depths[0]), depths[last])
            value = cell_value(
                bins, first, member, strut, matrix, start, scale, level,
                x - d * nx, y - d * ny, z - d * nz,
            )  # fmt: skip
            if value < least:
                least, at = value, d
                if least <= enough:
                    return least
    return least


@njit(cache=True, inline="always")
def foot_of(distance, toward, normal, x, y, z):
    """Nearest point of the surface, and the unit vector in which the distance grows there."""
    ax, ay, az = normal if abs(distance) <= AT_SURFACE else toward
    length = math.sqrt(ax * ax + ay * ay + az * az)
    out = (ax / length, ay / length, az / length)
    return (x - distance * out[0], y - distance * out[1], z - distance * out[2]), out


@njit(cache=True)
def trimmed_value(
    bins, first, member, strut, matrix, start, scale, level, steep,
    tri, flat, ball, normals, origin, edge, slot, bound, begin, listed,
    thickness, exact, depths, x, y, z, stack, ends,
):  # fmt: skip
    """Field of the trimmed lattice at a point, exact where it is at most ``exact``."""
    a, b, c = cube_of(origin, edge, slot.shape, x, y, z)
    if a < 0:
        return 2.0 * exact
    s = slot[a, b, c]
    if s < 0:
        far = float(bound[a, b, c])
        if far > 0.0:
            return far
        return max(
            far, cell_value(bins, first, member, strut, matrix, start, scale, level, x, y, z)
        )
    distance, toward, normal, _, _ = nearest_listed(
        tri, flat, ball, normals, listed, begin[s], begin[s + 1], x, y, z
    )
    if distance > exact:
        return distance
    value = cell_value(bins, first, member, strut, matrix, start, scale, level, x, y, z)
    layer = -distance - thickness
    # Nothing below the one or the other changes what is returned.
    enough = max(layer, distance)
    if layer < exact and value > enough and len(depths):
        foot, out = foot_of(distance, toward, normal, x, y, z)
        limit = min(value, exact) + REACH * steep * (depths[1] - depths[0])
        least, best = least_sample(
            bins, first, member, strut, matrix, start, scale, level, steep,
            foot, out, depths, enough, limit, stack, ends,
        )  # fmt: skip
        if enough < least <= limit:
            least = refined(
                bins, first, member, strut, matrix, start, scale, level,
                foot, out, depths, least, best, enough,
            )  # fmt: skip
        value = min(value, max(layer, least))
    return max(distance, value)


@njit(cache=True, nogil=True)
def fill_values(low, high, points, cells, band, thickness, exact, depths, value):
    """Fill the field of the trimmed lattice at points (3, n), mm.

    Parameters
    ----------
    cells : StrutArrays
    band : BandArrays
    thickness, depths : float, (k,) array, mm
        Of the net-skin, and where struts are looked for; no depths: no net-skin.
    exact : float, mm
        Farther from the surface of the lattice values have the right sign only.
    """
    bins, first, member, strut = cells.bins, cells.first, cells.member, cells.strut
    matrix, start, scale = cells.matrix, cells.start, cells.scale
    level, steep = cells.level, cells.steep
    tri, flat, ball, normals, origin, edge, slot, bound, begin, listed = band
    stack = np.zeros((len(depths) + 2, 2), dtype=np.int64)
    ends = np.zeros((len(depths) + 2, 2))
    for i in range(low, high):
        value[i] = trimmed_value(
            bins, first, member, strut, matrix, start, scale, level, steep,
            tri, flat, ball, normals, origin, edge, slot, bound, begin, listed,
            thickness, exact, depths, points[0, i], points[1, i], points[2, i], stack, ends,
        )  # fmt: skip
