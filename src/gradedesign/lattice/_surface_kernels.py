"""Compiled loops of the surface extraction: marching, edge pairing, shell labels."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray, IntArray

_EDGE_AXIS = np.array([0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2], dtype=np.int64)
_EDGE_BASE = np.array(
    [
        [0, 0, 0], [0, 1, 0], [0, 0, 1], [0, 1, 1],
        [0, 0, 0], [1, 0, 0], [0, 0, 1], [1, 0, 1],
        [0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0],
    ],
    dtype=np.int64,
)  # fmt: skip


@njit(cache=True)
def cut_at_box(
    values: FloatArray, points: FloatArray, middle: FloatArray, half: FloatArray
) -> None:
    """Raise values (n,) at points (3, n) to the distance outside a box, by its faces."""
    for i in range(len(values)):
        for axis in range(3):
            outside = abs(points[axis, i] - middle[axis]) - half[axis]
            if outside > values[i]:  # what is not a number stays so
                values[i] = outside


@njit(cache=True)
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


@njit(cache=True)
def count_brick(values: FloatArray, counts: NDArray[np.int8]) -> tuple[int, int]:
    """Triangles, and grid edges whose ends differ in sign, in a brick of node values."""
    nx, ny, nz = values.shape
    triangles, edges = 0, 0
    for i in range(nx - 1):
        for j in range(ny - 1):
            above = square_case(values, i, j, 0)
            for k in range(nz - 1):
                below, above = above, square_case(values, i, j, k + 1)
                triangles += counts[below + 16 * above]
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                inside = values[i, j, k] < 0.0
                edges += i + 1 < nx and inside != (values[i + 1, j, k] < 0.0)
                edges += j + 1 < ny and inside != (values[i, j + 1, k] < 0.0)
                edges += k + 1 < nz and inside != (values[i, j, k + 1] < 0.0)
    return triangles, edges


@njit(cache=True, nogil=True)
def march_brick(
    values: FloatArray,
    start: IntArray,
    grid: IntArray,
    triangles: NDArray[np.int8],
    counts: NDArray[np.int8],
    total: tuple[int, int],
    earlier: int,
) -> tuple[IntArray, FloatArray, IntArray]:
    """Triangles of one brick over vertices named by the grid edge they lie on.

    ``total`` is the answer of `count_brick`, and ``earlier`` the number of vertices of the bricks
    before. Returns the edge keys (n,), the node values at both ends (n, 2) and faces (m, 3) into
    the keys of all bricks. A key is ``3 (linear index of the edge's lower node) + axis``. Cases of
    cubes have bit ``a + 2 b + 4 c`` set where the corner is inside.
    """
    nx, ny, nz = values.shape
    number = np.full(3 * nx * ny * nz, -1, dtype=np.int32)
    place = np.zeros(12, dtype=np.int64)  # of an edge in `number`, from its cube's
    for e in range(12):
        node = (_EDGE_BASE[e, 0] * ny + _EDGE_BASE[e, 1]) * nz + _EDGE_BASE[e, 2]
        place[e] = 3 * node + _EDGE_AXIS[e]
    keys = np.zeros(total[1], dtype=np.int64)
    ends = np.zeros((total[1], 2))
    faces = np.zeros((total[0], 3), dtype=np.int64)
    used, row = 0, 0
    for i in range(nx - 1):
        for j in range(ny - 1):
            above = square_case(values, i, j, 0)
            for k in range(nz - 1):
                below, above = above, square_case(values, i, j, k + 1)
                case = below + 16 * above
                cube = 3 * ((i * ny + j) * nz + k)
                for t in range(counts[case]):
                    for c in range(3):
                        e = triangles[case, t, c]
                        at = cube + place[e]
                        if number[at] < 0:
                            number[at] = used
                            axis = _EDGE_AXIS[e]
                            p = i + _EDGE_BASE[e, 0]
                            q = j + _EDGE_BASE[e, 1]
                            r = k + _EDGE_BASE[e, 2]
                            node = ((start[0] + p) * grid[1] + start[1] + q) * grid[2]
                            keys[used] = 3 * (node + start[2] + r) + axis
                            ends[used, 0] = values[p, q, r]
                            if axis == 0:
                                ends[used, 1] = values[p + 1, q, r]
                            elif axis == 1:
                                ends[used, 1] = values[p, q + 1, r]
                            else:
                                ends[used, 1] = values[p, q, r + 1]
                            used += 1
                        faces[row, c] = earlier + number[at]
                    row += 1
    return keys, ends, faces


@njit(cache=True)
def edge_starts(keys: IntArray, origin: FloatArray, grid: IntArray, h: float) -> FloatArray:
    """Lower nodes of grid edges with keys (n,), ``(3, n)``."""
    starts = np.zeros((3, len(keys)))
    for i in range(len(keys)):
        line, k = divmod(keys[i] // 3, grid[2])
        starts[0, i] = origin[0] + h * (line // grid[1])
        starts[1, i] = origin[1] + h * (line % grid[1])
        starts[2, i] = origin[2] + h * k
    return starts


@njit(cache=True)
def edge_points(starts: FloatArray, keys: IntArray, at: FloatArray, h: float) -> FloatArray:
    """Points ``at`` (n,) of the way along grid edges, ``(3, n)``."""
    points = starts.copy()
    for i in range(len(keys)):
        points[keys[i] % 3, i] += h * at[i]
    return points


@njit(cache=True, nogil=True)
def unpaired_edges(faces: IntArray, vertices: int) -> tuple[int, int]:
    """Edges not shared by exactly two opposed triangles: (open or misoriented, overloaded).

    The directed edges are bucketed by their lower vertex; a sound edge is met exactly once in
    each direction.
    """
    first = np.zeros(vertices + 1, dtype=np.int64)
    for f in range(len(faces)):
        for c in range(3):
            first[min(faces[f, c], faces[f, (c + 1) % 3]) + 1] += 1
    for v in range(vertices):
        first[v + 1] += first[v]
    fill = first[:-1].copy()
    far_end = np.zeros(3 * len(faces), dtype=np.int64)
    for f in range(len(faces)):
        for c in range(3):
            a, b = faces[f, c], faces[f, (c + 1) % 3]
            lower = min(a, b)
            far_end[fill[lower]] = b + 1 if a < b else -(a + 1)
            fill[lower] += 1
    torn, overloaded = 0, 0
    for v in range(vertices):
        for m in range(first[v], first[v + 1]):
            name = abs(far_end[m])
            ahead, back, earlier = 0, 0, False
            for n in range(first[v], first[v + 1]):
                if abs(far_end[n]) == name:
                    earlier = earlier or n < m
                    if far_end[n] > 0:
                        ahead += 1
                    else:
                        back += 1
            if earlier:
                continue
            if ahead + back > 2:
                overloaded += 1
            elif ahead != 1 or back != 1:
                torn += 1
    return torn, overloaded


@njit(cache=True, nogil=True)
def vertex_shells(faces: IntArray, vertices: int) -> IntArray:
    """Number of the connected shell of every vertex, in order of the shells' lowest vertex.

    Union-find with path halving; ``-1`` for a vertex without a triangle.
    """
    parent = np.arange(vertices)
    for f in range(len(faces)):
        for c in range(1, 3):
            a, b = faces[f, 0], faces[f, c]
            while parent[a] != a:
                parent[a] = parent[parent[a]]
                a = parent[a]
            while parent[b] != b:
                parent[b] = parent[parent[b]]
                b = parent[b]
            if a != b:
                parent[max(a, b)] = min(a, b)
    used = np.zeros(vertices, dtype=np.bool_)
    for f in range(len(faces)):
        for c in range(3):
            used[faces[f, c]] = True
    label = np.full(vertices, -1, dtype=np.int64)
    count = 0
    for v in range(vertices):
        if not used[v]:
            continue
        root = v
        while parent[root] != root:
            root = parent[root]
        if label[root] < 0:
            label[root] = count
            count += 1
        label[v] = label[root]
    return label


@njit(cache=True, nogil=True)
def shell_volumes(
    vertices: FloatArray, faces: IntArray, shells: IntArray, count: int
) -> FloatArray:
    """Signed volume of every shell ``(count,)``; ``shells`` numbers the shell of each vertex."""
    x, y, z = 0.0, 0.0, 0.0  # the mean vertex: near the surface, cones round off less
    for v in range(len(vertices)):
        x += vertices[v, 0] / len(vertices)
        y += vertices[v, 1] / len(vertices)
        z += vertices[v, 2] / len(vertices)
    volumes = np.zeros(count)
    for f in range(len(faces)):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        bx, by, bz = vertices[j, 0] - x, vertices[j, 1] - y, vertices[j, 2] - z
        cx, cy, cz = vertices[k, 0] - x, vertices[k, 1] - y, vertices[k, 2] - z
        volumes[shells[i]] += (
            (vertices[i, 0] - x) * (by * cz - bz * cy)
            + (vertices[i, 1] - y) * (bz * cx - bx * cz)
            + (vertices[i, 2] - z) * (bx * cy - by * cx)
        ) / 6.0
    return volumes
