"""Compiled kernel: strain energy of every element between two displacements.

Every element is computed alone, so results do not depend on the number of threads.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gradedesign.mechanics.fe._assembly_kernels import FAST, PAIR, _gradients, _unpack


@njit(cache=True, nogil=True)
def _strains(
    displacement: Any, elements: Any, e: int, shapes: Any, g: Any, along: Any, eps: Any
) -> None:
    """Fill `eps` (4, 6) with the engineering strain at the vertices.

    `along` (4, 3) is scratch: derivatives of the displacement by barycentric coordinates.
    """
    for s in range(4):
        for u in range(4):
            for x in range(3):
                along[u, x] = 0.0
        for a in range(elements.shape[0]):
            i = elements[a, e]
            for u in range(4):
                slope = shapes[s, a, u]
                # Of a quadratic element's forty ten differ from zero at a vertex.
                if slope != 0.0:
                    for x in range(3):
                        along[u, x] += slope * displacement[x, i]
        for x in range(3):
            total = 0.0
            for u in range(4):
                total += along[u, x] * g[u, x]
            eps[s, x] = total
        for x in range(3):
            y, z = (x + 1) % 3, (x + 2) % 3
            total = 0.0
            for u in range(4):
                total += along[u, y] * g[u, z] + along[u, z] * g[u, y]
            eps[s, 3 + x] = total


@njit(fastmath=FAST, cache=True, nogil=True)
def element_energies(
    low: int,
    high: int,
    nodes: NDArray[np.float64],
    elements: NDArray[np.int32],
    coefficients: NDArray[np.float64],
    shapes: NDArray[np.float64],
    uniform: NDArray[np.float64],
    u: NDArray[np.float64],
    v: NDArray[np.float64],
    energy: NDArray[np.float64],
) -> None:
    """Fill the integrals of strain of `u` times stress of `v` over a range of elements, N mm.

    Parameters
    ----------
    coefficients : (m, 1 or 10, 2 or 21) array
        Of one stiffness, or of its moments.
    shapes : (4, k, 4) array
        dN/dlambda at the vertices.
    uniform : (10,) array
        Moments of 1.
    energy : (m, 10) array
        Takes what each pair of barycentric coordinates adds.
    """
    g = np.zeros((4, 3))
    c = np.zeros((6, 6))
    along = np.zeros((4, 3))
    eps_u = np.zeros((4, 6))
    eps_v = np.zeros((4, 6))
    stress = np.zeros((4, 6))
    even = coefficients.shape[1] == 1
    for e in range(low, high):
        volume = _gradients(nodes, elements, e, g)
        _strains(u, elements, e, shapes, g, along, eps_u)
        _strains(v, elements, e, shapes, g, along, eps_v)
        if even:
            _unpack(coefficients[e, 0], volume, c)
            for s in range(4):
                for x in range(6):
                    total = 0.0
                    for y in range(6):
                        total += c[x, y] * eps_v[s, y]
                    stress[s, x] = total
        for s in range(4):
            for t in range(s, 4):
                pair = PAIR[s, t]
                total = 0.0
                if even:
                    for x in range(6):
                        total += eps_u[s, x] * stress[t, x]
                        if t > s:
                            total += eps_u[t, x] * stress[s, x]
                    energy[e, pair] = uniform[pair] * total
                    continue
                _unpack(coefficients[e, pair], volume, c)
                for x in range(6):
                    for y in range(6):
                        total += eps_u[s, x] * c[x, y] * eps_v[t, y]
                        if t > s:
                            total += eps_u[t, x] * c[x, y] * eps_v[s, y]
                energy[e, pair] = total
