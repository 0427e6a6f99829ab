"""Samples of the field on the sub-cells of elements: corrected, connected, compared on faces."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

#: Edges of `TETS` as steps in x, y, z, and how many of the six of a tetrahedron each is on average.
EDGES = np.array(
    [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 1, 1], [1, 0, 1], [1, 1, 1]], dtype=np.int64
)
EDGES_PER_TET = np.array([1.0, 1.0, 1.0, 2.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0, 1.0])
#: Sum of the second differences along the edges over what `unbias` takes off.
DIFFERENCES = 40.0


@njit(cache=True, nogil=True)
def unbias(low: int, high: int, f: Any, edges: Any, per_tet: Any, out: Any) -> None:
    """Samples whose linear interpolation has the mean of the field.

    On a tetrahedron with edges e the interpolated field is larger than the field by the sum of
    e H e / 40 on average, H the matrix of second derivatives (mean of the product of two
    barycentric coordinates: 1/20). Second differences along the edges take that off; plane
    surfaces stay where they are.

    Parameters
    ----------
    low, high : int
        Range in Y.
    f : (n + 2, Y, X) array
        Samples with one layer more on either side.
    edges, per_tet : arrays
        `EDGES` and `EDGES_PER_TET`.
    out : (n, Y, X) array
        Written. The two outermost samples in y and x stay: differences there see the limits of
        the part, which the grid ends at, as an edge of the solid.
    """
    for j in range(low, high):
        for k in range(out.shape[0]):
            for i in range(f.shape[2]):
                out[k, j, i] = f[k + 1, j, i]
                if min(i, j) < 2 or i >= f.shape[2] - 2 or j >= f.shape[1] - 2:
                    continue
                value = f[k + 1, j, i]
                total = 0.0
                for e in range(edges.shape[0]):
                    x, y, z = edges[e, 0], edges[e, 1], edges[e, 2]
                    along = f[k + 1 + z, j + y, i + x] + f[k + 1 - z, j - y, i - x]
                    total += per_tet[e] * (along - 2.0 * value)
                out[k, j, i] = value - total / DIFFERENCES


@njit(cache=True, nogil=True)
def label_components(
    low: int, high: int, samples: Any, edges: Any, labels: Any, count: Any
) -> None:
    """Number the connected components of the solid within each element.

    Corners inside are connected along the edges of the tetrahedra, so that no tetrahedron belongs
    to two components.

    Parameters
    ----------
    low, high : int
        Range of elements.
    samples : (k, s, s, s) array
        Field at the corners of the sub-cells, [element, z, y, x].
    edges : (7, 3) int array
        `EDGES`.
    labels : (k, s, s, s) int8 array
        Written: component of every corner inside, -1 elsewhere.
    count : (k,) int array
        Written: number of components.
    """
    side = samples.shape[1]
    stack = np.zeros((side * side * side, 3), np.int8)
    for e in range(low, high):
        for k in range(side):
            for j in range(side):
                for i in range(side):
                    labels[e, k, j, i] = -1
        components = 0
        for k in range(side):
            for j in range(side):
                for i in range(side):
                    if samples[e, k, j, i] >= 0.0 or labels[e, k, j, i] >= 0:
                        continue
                    labels[e, k, j, i] = components
                    stack[0, 0], stack[0, 1], stack[0, 2] = i, j, k
                    top = 1
                    while top > 0:
                        top -= 1
                        x, y, z = stack[top, 0], stack[top, 1], stack[top, 2]
                        for m in range(2 * edges.shape[0]):
                            sign = 1 if m & 1 else -1
                            a = x + sign * edges[m >> 1, 0]
                            b = y + sign * edges[m >> 1, 1]
                            c = z + sign * edges[m >> 1, 2]
                            if min(a, b, c) < 0 or max(a, b, c) >= side:
                                continue
                            if samples[e, c, b, a] < 0.0 and labels[e, c, b, a] < 0:
                                labels[e, c, b, a] = components
                                stack[top, 0], stack[top, 1], stack[top, 2] = a, b, c
                                top += 1
                    components += 1
        count[e] = components


@njit(cache=True, nogil=True)
def face_masks(low: int, high: int, samples: Any, masks: Any) -> None:
    """Corners inside on the six faces of each element, a bit each.

    Parameters
    ----------
    low, high : int
        Range of elements.
    samples : (k, s, s, s) array
        Field at the corners of the sub-cells, [element, z, y, x].
    masks : (k, 6) int64 array
        Written: of the faces 2 axis + side; bits are alike on faces that two elements share.
    """
    last = samples.shape[1] - 1
    for e in range(low, high):
        for side in range(6):
            masks[e, side] = 0
        for b in range(last + 1):
            for a in range(last + 1):
                bit = 1 << (b * (last + 1) + a)
                for side in range(2):
                    at = side * last
                    if samples[e, b, a, at] < 0.0:
                        masks[e, side] |= bit
                    if samples[e, b, at, a] < 0.0:
                        masks[e, 2 + side] |= bit
                    if samples[e, at, b, a] < 0.0:
                        masks[e, 4 + side] |= bit
