"""Displacement and stress at points of quadratic bricks, element after element."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def _quadratic(t: float, values: Any, slopes: Any) -> None:
    """Functions of the nodes at 0, 1/2 and 1, and their derivatives."""
    values[0], values[1], values[2] = (1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)
    slopes[0], slopes[1], slopes[2] = 4 * t - 3, 4 - 8 * t, 4 * t - 1


@njit(cache=True, nogil=True)
def _stress(
    u: Any, x: float, y: float, z: float, edges: Any, moduli: Any, free: float, work: Any, out: Any
) -> None:
    """Stress xx, yy, zz, yz, zx, xy at a reference point from nodal displacements ``(27, 3)``."""
    _quadratic(x, work[0], work[3])
    _quadratic(y, work[1], work[4])
    _quadratic(z, work[2], work[5])
    g = np.zeros((3, 3))
    for k in range(3):
        for j in range(3):
            yz, syz, ysz = work[1, j] * work[2, k], work[4, j] * work[2, k], work[1, j] * work[5, k]
            for i in range(3):
                a = 9 * k + 3 * j + i
                dx, dy, dz = work[3, i] * yz, work[0, i] * syz, work[0, i] * ysz
                for c in range(3):
                    g[c, 0] += dx * u[a, c]
                    g[c, 1] += dy * u[a, c]
                    g[c, 2] += dz * u[a, c]
    for c in range(3):
        for d in range(3):
            g[c, d] /= edges[d]
    # Free expansion is no stress.
    for c in range(3):
        out[c] = 0.0
        for d in range(3):
            out[c] += moduli[0, c, d] * (g[d, d] - free)
    out[3] = moduli[1, 1, 2] * (g[1, 2] + g[2, 1])
    out[4] = moduli[1, 2, 0] * (g[2, 0] + g[0, 2])
    out[5] = moduli[1, 0, 1] * (g[0, 1] + g[1, 0])


@njit(cache=True, nogil=True)
def stress_in_elements(
    low: int, high: int, nodes: Any, u: Any, edges: Any, size: Any, moduli: Any, free: float,
    filled: Any, gauss: Any, starts: Any, element: Any, reference: Any, out: Any,
) -> None:  # fmt: skip
    """Stress at points; well-filled elements interpolate that of their Gauss points.

    Parameters
    ----------
    low, high : int
        Range of runs of points.
    nodes : (n, 27) int32 array
    u : (N, 3) array, mm
    edges : (3,) array, mm
    size : (n,) int array
        Edge of each element over these.
    moduli : (2, 3, 3) array, MPa
        Couplings of normal strains, and shear moduli.
    free : float
        Strain of free expansion.
    filled : (n,) bool array
        Elements whose stress is the trilinear function through eight Gauss points.
    gauss : (2,) array
        Reference coordinates of these along an edge.
    starts : (g + 1,) int array
        First of each run of points of one element.
    element : (m,) int array
    reference : (3, m) array
    out : (6, m) array
        Written: xx, yy, zz, yz, zx, xy.
    """
    own = np.zeros((27, 3))
    work = np.zeros((6, 3))
    value = np.zeros(6)
    corners = np.zeros((8, 6))
    for r in range(low, high):
        e = element[starts[r]]
        # The gradient is that over the edges of the grid: a larger element strains less.
        for a in range(27):
            for c in range(3):
                own[a, c] = u[nodes[e, a], c] / size[e]
        if filled[e]:
            for k in range(8):
                _stress(
                    own, gauss[k & 1], gauss[(k >> 1) & 1], gauss[k >> 2], edges, moduli, free,
                    work, corners[k],
                )  # fmt: skip
        for q in range(starts[r], starts[r + 1]):
            if filled[e]:
                for c in range(6):
                    value[c] = 0.0
                span = gauss[1] - gauss[0]
                x = (reference[0, q] - gauss[0]) / span
                y = (reference[1, q] - gauss[0]) / span
                z = (reference[2, q] - gauss[0]) / span
                for k in range(8):
                    w = (x if k & 1 else 1.0 - x) * (y if k & 2 else 1.0 - y)
                    w *= z if k & 4 else 1.0 - z
                    for c in range(6):
                        value[c] += w * corners[k, c]
            else:
                _stress(
                    own, reference[0, q], reference[1, q], reference[2, q], edges, moduli, free,
                    work, value,
                )  # fmt: skip
            for c in range(6):
                out[c, q] = value[c]


@njit(cache=True, nogil=True)
def displacement_in_elements(
    low: int, high: int, nodes: Any, u: Any, element: Any, reference: Any, out: Any
) -> None:
    """Displacement at points ``(3, m)`` of elements, written to out ``(3, m)``, of a range."""
    work = np.zeros((6, 3))
    for q in range(low, high):
        for d in range(3):
            _quadratic(reference[d, q], work[d], work[3 + d])
            out[d, q] = 0.0
        for k in range(3):
            for j in range(3):
                for i in range(3):
                    w = work[2, k] * work[1, j] * work[0, i]
                    node = nodes[element[q], 9 * k + 3 * j + i]
                    for c in range(3):
                        out[c, q] += w * u[node, c]
