"""Compiled kernels: stress and von Mises stress at element points, forces of initial stress.

Elements are straight-sided, so gradients of barycentric coordinates are constant in each. Every
element is computed alone, so results do not depend on the number of threads.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gradedesign.mechanics.fe._assembly_kernels import FAST, _gradients, _unpack


# Inlined, as `_initial`: called, stresses take 1.4 times as long, and compiling takes longer too.
@njit(fastmath=FAST, cache=True, nogil=True, inline="always")
def _strain_at(local: Any, shape: Any, g: Any, slope: Any, eps: Any) -> None:
    """Fill `eps` (6,) with the engineering strain at one point.

    `local` is the displacement of the element's nodes (k, 3), `shape` dN/dlambda (k, 4), `g` the
    gradients of the barycentric coordinates (4, 3); `slope` (3, 4) is scratch.
    """
    for x in range(3):
        for v in range(4):
            slope[x, v] = 0.0
    for a in range(shape.shape[0]):
        for v in range(4):
            if shape[a, v] != 0.0:
                for x in range(3):
                    slope[x, v] += local[a, x] * shape[a, v]
    for x in range(6):
        eps[x] = 0.0
    for v in range(4):
        eps[0] += slope[0, v] * g[v, 0]
        eps[1] += slope[1, v] * g[v, 1]
        eps[2] += slope[2, v] * g[v, 2]
        eps[3] += slope[1, v] * g[v, 2] + slope[2, v] * g[v, 1]
        eps[4] += slope[0, v] * g[v, 2] + slope[2, v] * g[v, 0]
        eps[5] += slope[0, v] * g[v, 1] + slope[1, v] * g[v, 0]


@njit(cache=True, nogil=True, inline="always")
def _initial(free: Any, e: int, q: int) -> float:
    """Free thermal strain of an element at a point; `free` broadcasts to (M, points)."""
    return free[e if free.shape[0] > 1 else 0, q if free.shape[1] > 1 else 0]


@njit(fastmath=FAST, cache=True, nogil=True)
def stress_at_points(
    low: int,
    high: int,
    nodes: NDArray[np.float64],
    elements: NDArray[np.int32],
    coefficients: NDArray[np.float64],
    shapes: NDArray[np.float64],
    free: NDArray[np.float64],
    u: NDArray[np.float64],
    result: NDArray[np.float64],
) -> None:
    """Fill stress in Voigt order ``(6, M, points)`` of a range of elements, MPa.

    Or von Mises stress, where the result is ``(1, M, points)``. `coefficients` ``(M, 1 or points,
    2 or 21)`` are constant in each element or not.
    """
    k = elements.shape[0]
    points = shapes.shape[0]
    g = np.zeros((4, 3))
    c = np.zeros((6, 6))
    local = np.zeros((k, 3))
    slope = np.zeros((3, 4))
    eps = np.zeros(6)
    s = np.zeros(6)
    for e in range(low, high):
        _gradients(nodes, elements, e, g)
        _unpack(coefficients[e, 0], 1.0, c)
        for a in range(k):
            for x in range(3):
                local[a, x] = u[x, elements[a, e]]
        for q in range(points):
            if q > 0 and coefficients.shape[1] > 1:
                _unpack(coefficients[e, q], 1.0, c)
            _strain_at(local, shapes[q], g, slope, eps)
            for x in range(3):
                eps[x] -= _initial(free, e, q)
            for x in range(6):
                s[x] = 0.0
                for y in range(6):
                    s[x] += c[x, y] * eps[y]
            if result.shape[0] == 1:
                direct = (s[0] - s[1]) ** 2 + (s[1] - s[2]) ** 2 + (s[2] - s[0]) ** 2
                shear = s[3] ** 2 + s[4] ** 2 + s[5] ** 2
                result[0, e, q] = np.sqrt(0.5 * direct + 3.0 * shear)
            else:
                for x in range(6):
                    result[x, e, q] = s[x]


@njit(fastmath=FAST, cache=True, nogil=True)
def initial_strain_force(
    nodes: NDArray[np.float64],
    elements: NDArray[np.int32],
    coefficients: NDArray[np.float64],
    shapes: NDArray[np.float64],
    free: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Integral of ``B^T C e`` with a free isotropic strain e, ``(3, N)``, N.

    `shapes` is dN/dlambda at points of equal weight, `coefficients` as in `stress_at_points`.
    Serial, so that sums have one order.
    """
    force = np.zeros(nodes.shape)
    k, m = elements.shape
    points = shapes.shape[0]
    g = np.zeros((4, 3))
    c = np.zeros((6, 6))
    for e in range(m):
        volume = _gradients(nodes, elements, e, g)
        for q in range(points):
            if q == 0 or coefficients.shape[1] > 1:
                _unpack(coefficients[e, q], volume / points, c)
            xx = c[0, 0] + c[0, 1] + c[0, 2]
            yy = c[1, 0] + c[1, 1] + c[1, 2]
            zz = c[2, 0] + c[2, 1] + c[2, 2]
            yz = c[3, 0] + c[3, 1] + c[3, 2]
            xz = c[4, 0] + c[4, 1] + c[4, 2]
            xy = c[5, 0] + c[5, 1] + c[5, 2]
            strain = _initial(free, e, q)
            for a in range(k):
                dx, dy, dz = 0.0, 0.0, 0.0
                for v in range(4):
                    dx += shapes[q, a, v] * g[v, 0]
                    dy += shapes[q, a, v] * g[v, 1]
                    dz += shapes[q, a, v] * g[v, 2]
                i = elements[a, e]
                force[0, i] += strain * (xx * dx + xy * dy + xz * dz)
                force[1, i] += strain * (xy * dx + yy * dy + yz * dz)
                force[2, i] += strain * (xz * dx + yz * dy + zz * dz)
    return force
