"""Weights of elements that a surface cuts, from field values on their sub-cells.

Each sub-cell is divided into the six tetrahedra around its main diagonal, in which the field is
taken as linear: the solid is then a polyhedron. Samples are corrected beforehand for what linear
interpolation adds to a curved field on average, which took volume off struts.
An integral over it follows from the divergence theorem in x: polynomials integrated in x over the
cut triangles, and over the face at the far end of x. Above 300 lines: kernels inline each other.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, prange

#: Corners of the six tetrahedra of a cube along its diagonal from (0, 0, 0) to (1, 1, 1), as
#: x + 2 y + 4 z; the same division in every cube, so neighbours meet.
TETS = np.array(
    [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]],
    dtype=np.int64,
)
#: Dunavant's rule of degree 6 on a triangle: barycentric coordinates and weights (Int. J. Numer.
#: Methods Eng. 21, 1985, p. 1129).
_A, _B = 0.501426509658179, 0.249286745170910
_C, _D = 0.873821971016996, 0.063089014491502
_E, _F, _G = 0.053145049844817, 0.310352451033784, 0.636502499121399
RULE = np.array(
    [
        [_A, _B, _B, 0.116786275726379], [_B, _A, _B, 0.116786275726379],
        [_B, _B, _A, 0.116786275726379], [_C, _D, _D, 0.050844906370207],
        [_D, _C, _D, 0.050844906370207], [_D, _D, _C, 0.050844906370207],
        [_E, _F, _G, 0.082851075618374], [_E, _G, _F, 0.082851075618374],
        [_F, _E, _G, 0.082851075618374], [_F, _G, _E, 0.082851075618374],
        [_G, _E, _F, 0.082851075618374], [_G, _F, _E, 0.082851075618374],
    ]
)  # fmt: skip

#: Edges of `TETS` as steps in x, y, z, and how many of the six of a tetrahedron each is on average.
EDGES = np.array(
    [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 1, 1], [1, 0, 1], [1, 1, 1]], dtype=np.int64
)
EDGES_PER_TET = np.array([1.0, 1.0, 1.0, 2.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0, 1.0])


@njit(parallel=True, cache=True, nogil=True)
def unbias(f: Any, edges: Any, per_tet: Any, out: Any) -> None:
    """Samples whose linear interpolation has the mean of the field.

    On a tetrahedron with edges e the interpolated field is larger than the field by the sum of
    e H e / 40 on average, H the matrix of second derivatives (mean of the product of two
    barycentric coordinates: 1/20). Second differences along the edges take that off; plane
    surfaces stay where they are.

    Parameters
    ----------
    f : (n + 2, Y, X) array
        Samples with one layer more on either side.
    edges, per_tet : arrays
        `EDGES` and `EDGES_PER_TET`.
    out : (n, Y, X) array
        Written. The two outermost samples in y and x stay: differences there see the limits of
        the part, which the grid ends at, as an edge of the solid.
    """
    for j in prange(f.shape[1]):
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
                out[k, j, i] = value - total / 40.0


@njit(parallel=True, cache=True, nogil=True)
def label_components(samples: Any, edges: Any, labels: Any, count: Any) -> None:
    """Number the connected components of the solid within each element.

    Corners inside are connected along the edges of the tetrahedra, so that no tetrahedron belongs
    to two components.

    Parameters
    ----------
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
    for e in prange(samples.shape[0]):
        labels[e] = -1
        stack = np.zeros((side * side * side, 3), np.int8)
        found = 0
        for k in range(side):
            for j in range(side):
                for i in range(side):
                    if samples[e, k, j, i] >= 0.0 or labels[e, k, j, i] >= 0:
                        continue
                    labels[e, k, j, i] = found
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
                                labels[e, c, b, a] = found
                                stack[top, 0], stack[top, 1], stack[top, 2] = a, b, c
                                top += 1
                    found += 1
        count[e] = found


@njit(parallel=True, cache=True, nogil=True)
def face_masks(samples: Any, masks: Any) -> None:
    """Corners inside on the six faces of each element, a bit each.

    Parameters
    ----------
    samples : (k, s, s, s) array
        Field at the corners of the sub-cells, [element, z, y, x].
    masks : (k, 6) int64 array
        Written: of the faces 2 axis + side; bits are alike on faces that two elements share.
    """
    last = samples.shape[1] - 1
    for e in prange(samples.shape[0]):
        masks[e] = 0
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


#: Numbers of one row of a sum, padded to whole vectors: five by five products, five polynomials.
_ROW, _FIVE = 32, 8


@njit(fastmath={"contract"}, cache=True, nogil=True)
def _polynomials(t: float, table: Any, out: Any) -> None:
    """Values at t of polynomials, a padded row of coefficients for each power, lowest first."""
    top = table.shape[0] - 1
    for k in range(_FIVE):
        out[k] = table[top, k]
    for p in range(top - 1, -1, -1):
        for k in range(_FIVE):
            out[k] = out[k] * t + table[p, k]


@njit(fastmath={"contract"}, cache=True, nogil=True)
def _add_triangle(
    corners: Any, factor: float, rule: Any, values: Any, integrals: Any, work: Any, out: Any
) -> None:
    """Add factor times the mean of Q(x) L(y) L(z) over a triangle ``(3, 3)`` to out[z, y x]."""
    for r in range(rule.shape[0]):
        x = rule[r, 0] * corners[0, 0] + rule[r, 1] * corners[1, 0] + rule[r, 2] * corners[2, 0]
        y = rule[r, 0] * corners[0, 1] + rule[r, 1] * corners[1, 1] + rule[r, 2] * corners[2, 1]
        z = rule[r, 0] * corners[0, 2] + rule[r, 1] * corners[1, 2] + rule[r, 2] * corners[2, 2]
        _polynomials(x, integrals, work[0])
        _polynomials(y, values, work[1])
        _polynomials(z, values, work[2])
        w = factor * rule[r, 3]
        flat = work[3]
        for j in range(5):
            wy = w * work[1, j]
            for i in range(5):
                flat[5 * j + i] = wy * work[0, i]
        for k in range(5):
            wz = work[2, k]
            for m in range(_ROW):
                out[k, m] += wz * flat[m]


@njit(cache=True, nogil=True)
def _cut_tet(f: Any, p: Any, index: Any, cut: Any, triangles: Any) -> int:
    """Cut one tetrahedron where the linear field is 0; triangles point out of the solid.

    Returns the number of triangles written to ``(2, 3, 3)``; `index` ``(4, 4)`` and `cut`
    ``(4, 3)`` are scratch.
    """
    inside, outside, near, far = index[0], index[1], index[2], index[3]
    n = 0
    m = 0
    for k in range(4):
        if f[k] < 0.0:
            inside[n] = k
            n += 1
        else:
            outside[m] = k
            m += 1
    if n == 0 or n == 4:
        return 0
    if n == 2:
        count = 4
        near[0], far[0] = inside[0], outside[0]
        near[1], far[1] = inside[0], outside[1]
        near[2], far[2] = inside[1], outside[1]
        near[3], far[3] = inside[1], outside[0]
    else:
        count = 3
        for k in range(3):
            near[k] = inside[0] if n == 1 else inside[k]
            far[k] = outside[k] if n == 1 else outside[0]
    for k in range(count):
        a, b = near[k], far[k]
        t = f[a] / (f[a] - f[b])
        for d in range(3):
            cut[k, d] = p[a, d] + t * (p[b, d] - p[a, d])
    for t in range(count - 2):
        for d in range(3):
            triangles[t, 0, d] = cut[0, d]
            triangles[t, 1, d] = cut[t + 1, d]
            triangles[t, 2, d] = cut[t + 2, d]
    # All triangles of one tetrahedron turn alike: judge by the largest, against in -> out.
    nx, ny, nz = 0.0, 0.0, 0.0
    for t in range(count - 2):
        ax = triangles[t, 1, 0] - triangles[t, 0, 0]
        ay = triangles[t, 1, 1] - triangles[t, 0, 1]
        az = triangles[t, 1, 2] - triangles[t, 0, 2]
        bx = triangles[t, 2, 0] - triangles[t, 0, 0]
        by = triangles[t, 2, 1] - triangles[t, 0, 1]
        bz = triangles[t, 2, 2] - triangles[t, 0, 2]
        nx += ay * bz - az * by
        ny += az * bx - ax * bz
        nz += ax * by - ay * bx
    a, b = inside[0], outside[0]
    if nx * (p[b, 0] - p[a, 0]) + ny * (p[b, 1] - p[a, 1]) + nz * (p[b, 2] - p[a, 2]) < 0.0:
        for t in range(count - 2):
            for d in range(3):
                hold = triangles[t, 1, d]
                triangles[t, 1, d] = triangles[t, 2, d]
                triangles[t, 2, d] = hold
    return count - 2


@njit(cache=True, nogil=True)
def _add_far_face(
    f: Any, rule: Any, values: Any, integrals: Any, work: Any, corners: Any, out: Any
) -> None:
    """Add the integral over the solid part of the face x = 1; f is ``(s+1, s+1)``, [z, y]."""
    s = f.shape[0] - 1
    h = 1.0 / s
    poly = np.zeros((4, 2))
    for k in range(s):
        for j in range(s):
            for half in range(2):
                # Both halves hold the diagonal from (0, 0) to (1, 1), as the tetrahedra do.
                j1, k1 = (j + 1, k) if half == 0 else (j, k + 1)
                ys = (j, j1, j + 1)
                zs = (k, k1, k + 1)
                count = 0
                for c in range(3):
                    d = (c + 1) % 3
                    fa, fb = f[zs[c], ys[c]], f[zs[d], ys[d]]
                    if fa < 0.0:
                        poly[count, 0], poly[count, 1] = ys[c] * h, zs[c] * h
                        count += 1
                    if (fa < 0.0) != (fb < 0.0):
                        t = fa / (fa - fb)
                        poly[count, 0] = (ys[c] + t * (ys[d] - ys[c])) * h
                        poly[count, 1] = (zs[c] + t * (zs[d] - zs[c])) * h
                        count += 1
                for t in range(count - 2):
                    for c in range(3):
                        corners[c, 0] = 1.0
                    for d in range(2):
                        corners[0, d + 1] = poly[0, d]
                        corners[1, d + 1] = poly[t + 1, d]
                        corners[2, d + 1] = poly[t + 2, d]
                    area = 0.5 * abs(
                        (corners[1, 1] - corners[0, 1]) * (corners[2, 2] - corners[0, 2])
                        - (corners[1, 2] - corners[0, 2]) * (corners[2, 1] - corners[0, 1])
                    )
                    _add_triangle(corners, area, rule, values, integrals, work, out)


@njit(parallel=True, cache=True, nogil=True)
def fitted_weights(
    samples: Any, tets: Any, rule: Any, values: Any, integrals: Any, weights: Any
) -> None:
    """Integrals of the Lagrange polynomials of the Gauss points over the solid of each element.

    Parameters
    ----------
    samples : (n, s+1, s+1, s+1) array
        Field at the corners of the sub-cells, [element, z, y, x].
    tets : (6, 4) int array
    rule : (r, 4) array
    values, integrals : (5, 8) and (6, 8) array
        Coefficients of the five polynomials and of their integrals, a padded row for each power.
    weights : (n, 125) array
        Written: weights over the volume of the element, x fastest.
    """
    s = samples.shape[1] - 1
    h = 1.0 / s
    for e in prange(samples.shape[0]):
        out = np.zeros((5, _ROW))
        work = np.zeros((4, _ROW))
        corners = np.zeros((3, 3))
        f = np.zeros(4)
        p = np.zeros((4, 3))
        triangles = np.zeros((2, 3, 3))
        index = np.zeros((4, 4), np.int64)
        cut = np.zeros((4, 3))
        own = samples[e]
        for k in range(s):
            for j in range(s):
                for i in range(s):
                    negative = 0
                    for c in range(8):
                        if own[k + (c >> 2), j + ((c >> 1) & 1), i + (c & 1)] < 0.0:
                            negative += 1
                    if negative == 0 or negative == 8:
                        continue
                    for t in range(6):
                        for v in range(4):
                            c = tets[t, v]
                            x, y, z = i + (c & 1), j + ((c >> 1) & 1), k + (c >> 2)
                            f[v] = own[z, y, x]
                            p[v, 0], p[v, 1], p[v, 2] = x * h, y * h, z * h
                        for w in range(_cut_tet(f, p, index, cut, triangles)):
                            u = triangles[w]
                            across = (u[1, 1] - u[0, 1]) * (u[2, 2] - u[0, 2]) - (
                                u[1, 2] - u[0, 2]
                            ) * (u[2, 1] - u[0, 1])
                            if across != 0.0:
                                _add_triangle(u, 0.5 * across, rule, values, integrals, work, out)
        _add_far_face(own[:, :, s], rule, values, integrals, work, corners, out)
        for k in range(5):
            for m in range(25):
                weights[e, 25 * k + m] = out[k, m]


@njit(cache=True, nogil=True)
def _tet_solid(f: Any, p: Any, index: Any, q: Any, sums: Any) -> None:
    """Add volume and first moments of the solid part of one tetrahedron to ``sums (4,)``.

    Volumes count six times; `index` ``(2, 4)`` and `q` ``(6, 3)`` are scratch.
    """
    inside, outside = index[0], index[1]
    n = 0
    m = 0
    for k in range(4):
        if f[k] < 0.0:
            inside[n] = k
            n += 1
        else:
            outside[m] = k
            m += 1
    if n == 0:
        return
    if n == 4:
        _add_simplex(p, 0, 1, 2, 3, sums, 1.0)
    elif n == 1 or n == 3:
        # The corner alone on its side; the solid is that corner's piece, or all but it.
        lone = inside[0] if n == 1 else outside[0]
        row = 0
        for d in range(3):
            q[0, d] = p[lone, d]
        for k in range(4):
            if k != lone:
                row += 1
                t = f[lone] / (f[lone] - f[k])
                for d in range(3):
                    q[row, d] = p[lone, d] + t * (p[k, d] - p[lone, d])
        if n == 3:
            _add_simplex(p, 0, 1, 2, 3, sums, 1.0)
        _add_simplex(q, 0, 1, 2, 3, sums, 1.0 if n == 1 else -1.0)
    else:
        # A wedge between the edge of the two inner corners and the cut quadrilateral.
        for a in range(2):
            for d in range(3):
                q[3 * a, d] = p[inside[a], d]
            for b in range(2):
                i, o = inside[a], outside[b]
                t = f[i] / (f[i] - f[o])
                for d in range(3):
                    q[3 * a + 1 + b, d] = p[i, d] + t * (p[o, d] - p[i, d])
        _add_simplex(q, 0, 1, 2, 3, sums, 1.0)
        _add_simplex(q, 1, 2, 3, 4, sums, 1.0)
        _add_simplex(q, 2, 3, 4, 5, sums, 1.0)


@njit(cache=True, nogil=True)
def _add_simplex(p: Any, i: int, j: int, k: int, m: int, sums: Any, sign: float) -> None:
    """Add the volume and first moments of one tetrahedron of points."""
    ax, ay, az = p[j, 0] - p[i, 0], p[j, 1] - p[i, 1], p[j, 2] - p[i, 2]
    bx, by, bz = p[k, 0] - p[i, 0], p[k, 1] - p[i, 1], p[k, 2] - p[i, 2]
    cx, cy, cz = p[m, 0] - p[i, 0], p[m, 1] - p[i, 1], p[m, 2] - p[i, 2]
    volume = sign * abs(
        ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    )
    sums[0] += volume
    for d in range(3):
        sums[1 + d] += volume * 0.25 * (p[i, d] + p[j, d] + p[k, d] + p[m, d])


@njit(parallel=True, cache=True, nogil=True)
def solid_shares(samples: Any, tets: Any, blocks: int, share: Any, centre: Any) -> None:
    """Volume and centroid of the solid in each of ``blocks**3`` parts of every element.

    Parameters
    ----------
    samples : (n, s+1, s+1, s+1) array
        As for `fitted_weights`; `blocks` divides s.
    tets : (6, 4) int array
    blocks : int
    share : (n, blocks^3) array
        Written: volume over that of the element.
    centre : (n, blocks^3, 3) array
        Written: reference coordinates of the centroid; the middle of the block where nothing is.
    """
    s = samples.shape[1] - 1
    h = 1.0 / s
    step = s // blocks
    for e in prange(samples.shape[0]):
        f = np.zeros(4)
        p = np.zeros((4, 3))
        index = np.zeros((2, 4), np.int64)
        q = np.zeros((6, 3))
        sums = np.zeros((blocks, blocks, blocks, 4))
        for k in range(s):
            for j in range(s):
                for i in range(s):
                    own = sums[k // step, j // step, i // step]
                    negative = 0
                    for c in range(8):
                        if samples[e, k + (c >> 2), j + ((c >> 1) & 1), i + (c & 1)] < 0.0:
                            negative += 1
                    if negative == 0:
                        continue
                    if negative == 8:
                        volume = 6.0 * h**3
                        own[0] += volume
                        own[1] += volume * (i + 0.5) * h
                        own[2] += volume * (j + 0.5) * h
                        own[3] += volume * (k + 0.5) * h
                        continue
                    for t in range(6):
                        for v in range(4):
                            c = tets[t, v]
                            x, y, z = i + (c & 1), j + ((c >> 1) & 1), k + (c >> 2)
                            f[v] = samples[e, z, y, x]
                            p[v, 0], p[v, 1], p[v, 2] = x * h, y * h, z * h
                        _tet_solid(f, p, index, q, own)
        row = 0
        for k in range(blocks):
            for j in range(blocks):
                for i in range(blocks):
                    own = sums[k, j, i]
                    share[e, row] = own[0] / 6.0
                    centre[e, row, 0] = (i + 0.5) / blocks
                    centre[e, row, 1] = (j + 0.5) / blocks
                    centre[e, row, 2] = (k + 0.5) / blocks
                    if own[0] > 1e-14:
                        for d in range(3):
                            centre[e, row, d] = own[1 + d] / own[0]
                    row += 1
