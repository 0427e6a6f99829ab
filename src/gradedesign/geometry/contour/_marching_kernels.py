"""Compiled marching cubes over a slab of nodes, vertices numbered by their grid edge.

Above 300 lines: counting, numbering, capping and marching share one numbering of grid edges.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.geometry.contour._side_kernels import BEYOND, DEEP, NEAR

#: First axis of grid edges and the one after the last: along to the next node plane, and in one.
_ALONG, _ACROSS = (0, 1), (1, 3)
#: Axis and lower node of each of the twelve edges of a cube.
_EDGE_AXIS = np.array([0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2], dtype=np.int64)
_EDGE_BASE = np.array(
    [
        [0, 0, 0], [0, 1, 0], [0, 0, 1], [0, 1, 1],
        [0, 0, 0], [1, 0, 0], [0, 0, 1], [1, 0, 1],
        [0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0],
    ],
    dtype=np.int64,
)  # fmt: skip


@njit(cache=True, nogil=True)
def square_case(values: FloatArray, i: int, j: int, k: int) -> int:
    """Bit ``a + 2 b`` is set where node ``(i + a, j + b, k)`` is inside."""
    case = 0
    if values[i, j, k] < 0.0:
        case |= 1
    if values[i + 1, j, k] < 0.0:
        case |= 2
    if values[i, j + 1, k] < 0.0:
        case |= 4
    if values[i + 1, j + 1, k] < 0.0:
        case |= 8
    return case


@njit(cache=True, nogil=True)
def count_slab(
    values: FloatArray, first: int, counts: NDArray[np.int8], sides: NDArray[np.uint8]
) -> tuple[int, int, int, int, int, int]:
    """Largest counts of `march_slab` in a slab whose first node plane is ``first``.

    Triangles in deep, near and other cubes, grid edges whose ends differ in sign, and faces with a
    node inside between near cubes and deep ones, and between near cubes and others.
    """
    nx, ny, nz = values.shape
    deep, near, beside, edges, inner, outer = 0, 0, 0, 0, 0, 0
    for i in range(nx - 1):
        for j in range(ny - 1):
            above = square_case(values, i, j, 0)
            for k in range(nz - 1):
                below, above = above, square_case(values, i, j, k + 1)
                case = below + 16 * above
                if case == 0:
                    continue
                here = sides[first + i, j, k]
                if here == DEEP:
                    deep += counts[case]
                elif here == NEAR:
                    near += counts[case]
                elif here != BEYOND:
                    beside += counts[case]
                for axis in range(3):
                    p, q, r = first + i - (axis == 0), j - (axis == 1), k - (axis == 2)
                    if min(p, q, r) < 0 or (here == NEAR) == (sides[p, q, r] == NEAR):
                        continue
                    to_deep = here == DEEP or sides[p, q, r] == DEEP
                    inner += to_deep
                    outer += not to_deep
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                inside = values[i, j, k] < 0.0
                edges += i + 1 < nx and inside != (values[i + 1, j, k] < 0.0)
                edges += j + 1 < ny and inside != (values[i, j + 1, k] < 0.0)
                edges += k + 1 < nz and inside != (values[i, j, k + 1] < 0.0)
    return deep, near, beside, edges, inner, outer


@njit(cache=True, nogil=True)
def _add_vertex(
    values: FloatArray,
    i: int,
    j: int,
    k: int,
    axis: int,
    used: int,
    nodes: IntArray,
    ends: FloatArray,
) -> bool:
    """Note the grid edge along ``axis`` from a node if its ends differ in sign."""
    b = values[i + (axis == 0), j + (axis == 1), k + (axis == 2)]
    if (values[i, j, k] < 0.0) == (b < 0.0):
        return False
    nodes[used, 0], nodes[used, 1], nodes[used, 2], nodes[used, 3] = i, j, k, axis
    ends[used, 0], ends[used, 1] = values[i, j, k], b
    return True


@njit(cache=True, nogil=True)
def _number_plane(
    values: FloatArray,
    i: int,
    axes: tuple[int, int],
    number: NDArray[np.int32],
    start: int,
    used: int,
    nodes: IntArray,
    ends: FloatArray,
) -> int:
    """Number the vertices on the grid edges of node plane ``i`` along some axes."""
    _, ny, nz = values.shape
    for j in range(ny):
        for k in range(nz):
            for axis in range(axes[0], axes[1]):
                number[axis, j, k] = -1
                if (axis == 1 and j + 1 == ny) or (axis == 2 and k + 1 == nz):
                    continue
                if _add_vertex(values, i, j, k, axis, used, nodes, ends):
                    number[axis, j, k] = start + used
                    used += 1
    return used


@njit(cache=True, nogil=True)
def _cap(
    values: FloatArray,
    cube: tuple[int, int, int],
    axis: int,
    forward: bool,
    number: NDArray[np.int32],
    corner: NDArray[np.int32],
    corners: IntArray,
    counted: tuple[int, int],
    caps: NDArray[np.int32],
    row: int,
) -> tuple[int, int]:
    """Triangles over the inside of a cube's lower face across an axis.

    ``number`` (2, 3, ny, nz) holds the vertices of the two node planes and ``corner`` (2, ny, nz)
    the inside nodes that are corners already, as ``-1 - number``; 0 is none. ``counted`` is the
    number of corners before this slab and in it. Returns the corners in it and the next row.
    """
    i, j, k = cube
    earlier, fresh = counted
    u, v = (axis + 1) % 3, (axis + 2) % 3
    ring = np.zeros(8, dtype=np.int32)
    length = 0
    for c in range(4):
        pu, pv = (c == 1 or c == 2), (c == 2 or c == 3)
        di = (u == 0 and pu) or (v == 0 and pv)
        q = j + ((u == 1 and pu) or (v == 1 and pv))
        r = k + ((u == 2 and pu) or (v == 2 and pv))
        if values[i + di, q, r] < 0.0:
            if corner[int(di), q, r] == 0:
                corners[fresh, 0], corners[fresh, 1], corners[fresh, 2] = i + di, q, r
                corner[int(di), q, r] = -1 - (earlier + fresh)
                fresh += 1
            ring[length] = corner[int(di), q, r]
            length += 1
        # The side of the face from this corner to the next, from its lower node.
        along = u if c % 2 == 0 else v
        su, sv = c == 1, c == 2
        di = (u == 0 and su) or (v == 0 and sv)
        q = j + ((u == 1 and su) or (v == 1 and sv))
        r = k + ((u == 2 and su) or (v == 2 and sv))
        vertex = number[int(di), along, q, r]
        if vertex >= 0:
            ring[length] = vertex
            length += 1
    for n in range(1, length - 1):
        caps[row, 0] = ring[0]
        caps[row, 1] = ring[n] if forward else ring[n + 1]
        caps[row, 2] = ring[n + 1] if forward else ring[n]
        row += 1
    return fresh, row


@njit(cache=True, nogil=True)
def march_slab(
    values: FloatArray,
    first: int,
    table: tuple[NDArray[np.int8], NDArray[np.int8]],
    sides: NDArray[np.uint8],
    total: tuple[int, int, int, int, int, int],
    earlier: tuple[int, int],
    number: NDArray[np.int32],
    corner: NDArray[np.int32],
) -> tuple[
    IntArray,
    FloatArray,
    IntArray,
    NDArray[np.int32],
    NDArray[np.int32],
    NDArray[np.int32],
    NDArray[np.int32],
    NDArray[np.int32],
]:
    """Triangles of a slab of node values (nx, ny, nz) whose first plane has grid index ``first``.

    Parameters
    ----------
    table : triangles and counts of `marching_table`
        Cases of cubes have bit ``a + 2 b + 4 c`` set where the corner is inside.
    sides : (a, b, c) uint8 array
        Of all cubes of the grid, see `cube_sides`; those beyond are left out.
    total : answer of `count_slab`
    earlier : (int, int)
        Vertices and corners of caps of the slabs before.
    number : (2, 3, ny, nz) int32 array
        Vertices on the grid edges of two node planes, -1 without one; those of the first plane
        are given, those of the last plane come back in their place.
    corner : (2, ny, nz) int32 array
        Likewise the corners of caps, ``-1 - number``; 0 is none.

    Returns
    -------
    nodes : (n, 4) array
        Lower node, from the slab's first, and axis of the grid edge of every new vertex.
    ends : (n, 2) array
        Node values at its ends.
    corners : (c, 3) array
        New corners of caps, as nodes from the slab's first.
    deep, near, beside, inner, outer : (m, 3) int32 arrays
        Triangles of those cubes, and caps over the faces between near cubes and deep ones, and
        between near cubes and others, outward from the near ones; a negative number is a corner of
        a cap.
    """
    triangles, counts = table
    nx, ny, nz = values.shape
    nodes = np.zeros((total[3], 4), dtype=np.int64)
    ends = np.zeros((total[3], 2))
    corners = np.zeros((4 * (total[4] + total[5]), 3), dtype=np.int64)
    deep = np.zeros((total[0], 3), dtype=np.int32)
    near = np.zeros((total[1], 3), dtype=np.int32)
    beside = np.zeros((total[2], 3), dtype=np.int32)
    inner = np.zeros((4 * total[4], 3), dtype=np.int32)
    outer = np.zeros((4 * total[5], 3), dtype=np.int32)
    rows, row_near, row_beside = 0, 0, 0
    # Plain zeros are types of their own: what takes them would be compiled for them too.
    used, fresh, row_in, row_out = np.int64(0), np.int64(0), np.int64(0), np.int64(0)
    for i in range(nx - 1):
        if first + i == 0:
            used = _number_plane(values, i, _ACROSS, number[0], earlier[0], used, nodes, ends)
        # Of the last plane there are no edges along x.
        used = _number_plane(values, i, _ALONG, number[0], earlier[0], used, nodes, ends)
        used = _number_plane(values, i + 1, _ACROSS, number[1], earlier[0], used, nodes, ends)
        for j in range(ny):
            for k in range(nz):
                corner[1, j, k] = 0
        for j in range(ny - 1):
            above = square_case(values, i, j, 0)
            for k in range(nz - 1):
                below, above = above, square_case(values, i, j, k + 1)
                case = below + 16 * above
                if case == 0:
                    continue
                here = sides[first + i, j, k]
                for t in range(counts[case] if here != BEYOND else 0):
                    for c in range(3):
                        e = triangles[case, t, c]
                        vertex = number[
                            _EDGE_BASE[e, 0],
                            _EDGE_AXIS[e],
                            j + _EDGE_BASE[e, 1],
                            k + _EDGE_BASE[e, 2],
                        ]
                        if here == DEEP:
                            deep[rows, c] = vertex
                        elif here == NEAR:
                            near[row_near, c] = vertex
                        else:
                            beside[row_beside, c] = vertex
                    rows += here == DEEP
                    row_near += here == NEAR
                    row_beside += here != DEEP and here != NEAR
                for axis in range(3):
                    p, q, r = first + i - (axis == 0), j - (axis == 1), k - (axis == 2)
                    if min(p, q, r) < 0 or (here == NEAR) == (sides[p, q, r] == NEAR):
                        continue
                    if here == DEEP or sides[p, q, r] == DEEP:
                        fresh, row_in = _cap(
                            values, (i, j, k), axis, here != NEAR, number, corner, corners,
                            (earlier[1], fresh), inner, row_in,
                        )  # fmt: skip
                    else:
                        fresh, row_out = _cap(
                            values, (i, j, k), axis, here != NEAR, number, corner, corners,
                            (earlier[1], fresh), outer, row_out,
                        )  # fmt: skip
        # Assigning whole planes would link numba's text of shapes: 3 s more to compile.
        for j in range(ny):
            for k in range(nz):
                corner[0, j, k] = corner[1, j, k]
                for axis in range(3):
                    number[0, axis, j, k] = number[1, axis, j, k]
    return (
        nodes[:used],
        ends[:used],
        corners[:fresh],
        deep,
        near,
        beside,
        inner[:row_in],
        outer[:row_out],
    )


@njit(cache=True, nogil=True)
def edge_points(nodes: IntArray, at: FloatArray, first: FloatArray, h: float) -> FloatArray:
    """Points ``at`` (n,) of the way along grid edges (n, 4) from a first node, ``(3, n)``."""
    points = np.zeros((3, len(nodes)))
    for v in range(len(nodes)):
        for axis in range(3):
            points[axis, v] = first[axis] + h * nodes[v, axis]
        points[nodes[v, 3], v] += h * at[v]
    return points
