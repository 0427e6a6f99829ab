"""Weights of elements that a surface cuts, from field values on their sub-cells.

Each sub-cell is divided into the six tetrahedra around its main diagonal, in which the field is
taken as linear: the solid is then a polyhedron. Samples are corrected beforehand for what linear
interpolation adds to a curved field on average, which took volume off struts.
An integral over it follows from the divergence theorem in x: polynomials integrated in x over the
cut triangles, and over the face at the far end of x.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from gradedesign.mechanics.finite_cell._cut_tet_kernels import (
    corners_inside,
    cut_edge,
    load_tet,
    sort_corners,
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
#: Points whose polynomials and sums are taken side by side, in vector instructions: those of eight
#: triangles. Chosen, not measured.
POINTS = 96


@njit(fastmath={"contract"}, cache=True, nogil=True)
def _polynomials(t: Any, table: Any, out: Any) -> None:
    """Values ``(5, POINTS)`` of five polynomials at ``(POINTS,)``, coefficients lowest first."""
    top = table.shape[0] - 1
    for k in range(5):
        for v in range(POINTS):
            out[k, v] = table[top, k]
        for p in range(top - 1, -1, -1):
            c = table[p, k]
            for v in range(POINTS):
                out[k, v] = out[k, v] * t[v] + c


@njit(fastmath={"contract", "reassoc", "nsz"}, cache=True, nogil=True)
def _add_points(points: Any, values: Any, integrals: Any, work: Any, flat: Any, out: Any) -> None:
    """Add the weighted sum of Q(x) L(y) L(z) over points ``(4, POINTS)`` to out[z y, x].

    `work` ``(3, 5, POINTS)`` and `flat` ``(POINTS,)`` are scratch.
    """
    _polynomials(points[0], integrals, work[0])
    _polynomials(points[1], values, work[1])
    _polynomials(points[2], values, work[2])
    q = work[0]
    for k in range(5):
        for j in range(5):
            for v in range(POINTS):
                flat[v] = points[3, v] * work[1, j, v] * work[2, k, v]
            s0, s1, s2, s3, s4 = 0.0, 0.0, 0.0, 0.0, 0.0
            for v in range(POINTS):
                s0 += flat[v] * q[0, v]
                s1 += flat[v] * q[1, v]
                s2 += flat[v] * q[2, v]
                s3 += flat[v] * q[3, v]
                s4 += flat[v] * q[4, v]
            row = out[5 * k + j]
            row[0] += s0
            row[1] += s1
            row[2] += s2
            row[3] += s3
            row[4] += s4


@njit(cache=True, nogil=True)
def _clear(points: Any) -> None:
    """Take the weight off all points ``(4, POINTS)``."""
    for v in range(POINTS):
        points[3, v] = 0.0


@njit(cache=True, nogil=True)
def _add_triangle(
    corners: Any, factor: float, rule: Any, values: Any, integrals: Any, count: int, points: Any,
    work: Any, flat: Any, out: Any,
) -> int:  # fmt: skip
    """Add factor times the mean of Q(x) L(y) L(z) over a triangle ``(3, 3)`` to out[z y, x].

    Points wait in `points` until there are `POINTS` of them; returns how many wait, of ``count``
    before.
    """
    if count + rule.shape[0] > POINTS:
        _add_points(points, values, integrals, work, flat, out)
        _clear(points)
        count = 0
    for r in range(rule.shape[0]):
        a, b, c = rule[r, 0], rule[r, 1], rule[r, 2]
        for d in range(3):
            points[d, count] = a * corners[0, d] + b * corners[1, d] + c * corners[2, d]
        points[3, count] = factor * rule[r, 3]
        count += 1
    return count


@njit(cache=True, nogil=True)
def _cut_tet(f: Any, p: Any, index: Any, cut: Any, triangles: Any) -> int:
    """Cut one tetrahedron where the linear field is 0; triangles point out of the solid.

    Returns the number of triangles written to ``(2, 3, 3)``; `index` ``(4, 4)`` and `cut`
    ``(4, 3)`` are scratch.
    """
    inside, outside, near, far = index[0], index[1], index[2], index[3]
    n = sort_corners(f, inside, outside)
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
        cut_edge(f, p, near[k], far[k], cut[k])
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
    f: Any, rule: Any, values: Any, integrals: Any, count: int, points: Any, work: Any, flat: Any,
    corners: Any, poly: Any, out: Any,
) -> int:  # fmt: skip
    """Add the integral over the solid part of the face x = 1; f is ``(s+1, s+1)``, [z, y].

    Counts waiting points as `_add_triangle` does; `poly` ``(4, 2)`` is scratch.
    """
    s = f.shape[0] - 1
    h = 1.0 / s
    for k in range(s):
        for j in range(s):
            for half in range(2):
                # Both halves hold the diagonal from (0, 0) to (1, 1), as the tetrahedra do.
                j1, k1 = (j + 1, k) if half == 0 else (j, k + 1)
                ys = (j, j1, j + 1)
                zs = (k, k1, k + 1)
                sides = 0
                for c in range(3):
                    d = (c + 1) % 3
                    fa, fb = f[zs[c], ys[c]], f[zs[d], ys[d]]
                    if fa < 0.0:
                        poly[sides, 0], poly[sides, 1] = ys[c] * h, zs[c] * h
                        sides += 1
                    if (fa < 0.0) != (fb < 0.0):
                        t = fa / (fa - fb)
                        poly[sides, 0] = (ys[c] + t * (ys[d] - ys[c])) * h
                        poly[sides, 1] = (zs[c] + t * (zs[d] - zs[c])) * h
                        sides += 1
                for t in range(sides - 2):
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
                    count = _add_triangle(
                        corners, area, rule, values, integrals, count, points, work, flat, out
                    )
    return count


@njit(cache=True, nogil=True)
def fitted_weights(
    low: int, high: int, samples: Any, rule: Any, values: Any, integrals: Any, weights: Any
) -> None:
    """Integrals of the Lagrange polynomials of the Gauss points over the solid of each element.

    Parameters
    ----------
    low, high : int
        Range of elements.
    samples : (n, s+1, s+1, s+1) array
        Field at the corners of the sub-cells, [element, z, y, x].
    rule : (r, 4) array
    values, integrals : (5, 5) and (6, 5) array
        Coefficients of the five polynomials and of their integrals, a row for each power.
    weights : (n, 125) array
        Written: weights over the volume of the element, x fastest.
    """
    s = samples.shape[1] - 1
    h = 1.0 / s
    out = np.zeros((25, 5))
    points = np.zeros((4, POINTS))
    work = np.zeros((3, 5, POINTS))
    flat = np.zeros(POINTS)
    corners = np.zeros((3, 3))
    poly = np.zeros((4, 2))
    f = np.zeros(4)
    p = np.zeros((4, 3))
    triangles = np.zeros((2, 3, 3))
    index = np.zeros((4, 4), np.int64)
    cut = np.zeros((4, 3))
    for e in range(low, high):
        for k in range(25):
            for i in range(5):
                out[k, i] = 0.0
        _clear(points)
        count = np.int64(0)
        own = samples[e]
        for k in range(s):
            for j in range(s):
                for i in range(s):
                    if corners_inside(own, k, j, i) in (0, 8):
                        continue
                    for t in range(6):
                        load_tet(own, t, k, j, i, h, f, p)
                        for w in range(_cut_tet(f, p, index, cut, triangles)):
                            u = triangles[w]
                            across = (u[1, 1] - u[0, 1]) * (u[2, 2] - u[0, 2]) - (
                                u[1, 2] - u[0, 2]
                            ) * (u[2, 1] - u[0, 1])
                            if across != 0.0:
                                count = _add_triangle(
                                    u, 0.5 * across, rule, values, integrals, count, points, work,
                                    flat, out,
                                )  # fmt: skip
        _add_far_face(
            own[:, :, s], rule, values, integrals, count, points, work, flat, corners, poly, out
        )
        _add_points(points, values, integrals, work, flat, out)
        for k in range(25):
            for i in range(5):
                weights[e, 5 * k + i] = out[k, i]
