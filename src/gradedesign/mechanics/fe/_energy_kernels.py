"""Compiled kernels: strain energy of every element between two displacements.

Every element is computed alone, so results do not depend on the number of threads.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gradedesign.mechanics.fe._assembly_kernels import FAST, PAIR, _gradients, _unpack


@njit(cache=True, nogil=True)
def _strain(displacement: Any, elements: Any, e: int, shape: Any, g: Any, h: Any, eps: Any) -> None:
    """Fill `eps` (6,) with the engineering strain at one point; `shape` is dN/dlambda (k, 4).

    `h` (3, 3) is scratch.
    """
    for x in range(3):
        for y in range(3):
            h[x, y] = 0.0
    for a in range(elements.shape[0]):
        i = elements[a, e]
        for y in range(3):
            slope = 0.0
            for u in range(4):
                slope += shape[a, u] * g[u, y]
            for x in range(3):
                h[x, y] += displacement[x, i] * slope
    for x in range(3):
        eps[x] = h[x, x]
    eps[3] = h[1, 2] + h[2, 1]
    eps[4] = h[0, 2] + h[2, 0]
    eps[5] = h[0, 1] + h[1, 0]


@njit(fastmath=FAST, cache=True, nogil=True)
def element_energies(
    low: int,
    high: int,
    nodes: NDArray[np.float64],
    elements: NDArray[np.int32],
    coefficients: NDArray[np.float64],
    shapes: NDArray[np.float64],
    u: NDArray[np.float64],
    v: NDArray[np.float64],
    energy: NDArray[np.float64],
) -> None:
    """Fill the integrals of strain of `u` times stress of `v` over a range of elements, N mm.

    `shapes` is dN/dlambda ``(points, k, 4)`` at points of equal weight.
    """
    g = np.zeros((4, 3))
    c = np.zeros((6, 6))
    h = np.zeros((3, 3))
    eps_u = np.zeros(6)
    eps_v = np.zeros(6)
    for e in range(low, high):
        volume = _gradients(nodes, elements, e, g)
        _unpack(coefficients[e], volume / shapes.shape[0], c)
        total = 0.0
        for q in range(shapes.shape[0]):
            _strain(u, elements, e, shapes[q], g, h, eps_u)
            _strain(v, elements, e, shapes[q], g, h, eps_v)
            for x in range(6):
                for y in range(6):
                    total += eps_u[x] * c[x, y] * eps_v[y]
        energy[e] = total


@njit(fastmath=FAST, cache=True, nogil=True)
def element_energies_of_moments(
    low: int,
    high: int,
    nodes: NDArray[np.float64],
    elements: NDArray[np.int32],
    moments: NDArray[np.float64],
    shapes: NDArray[np.float64],
    u: NDArray[np.float64],
    v: NDArray[np.float64],
    energy: NDArray[np.float64],
) -> None:
    """As `element_energies`, for `moments` and `shapes` of `stiffness_blocks_of_moments`, N mm.

    ``energy (m, 10)`` takes what each pair of barycentric coordinates adds.
    """
    g = np.zeros((4, 3))
    c = np.zeros((6, 6))
    h = np.zeros((3, 3))
    eps_u = np.zeros((4, 6))
    eps_v = np.zeros((4, 6))
    for e in range(low, high):
        volume = _gradients(nodes, elements, e, g)
        for s in range(4):
            _strain(u, elements, e, shapes[s], g, h, eps_u[s])
            _strain(v, elements, e, shapes[s], g, h, eps_v[s])
        for s in range(4):
            for t in range(s, 4):
                pair = PAIR[s, t]
                _unpack(moments[e, pair], volume, c)
                total = 0.0
                for x in range(6):
                    for y in range(6):
                        total += eps_u[s, x] * c[x, y] * eps_v[t, y]
                        if t > s:
                            total += eps_u[t, x] * c[x, y] * eps_v[s, y]
                energy[e, pair] = total
