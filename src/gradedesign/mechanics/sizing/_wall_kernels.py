"""Compiled kernel: moments of a stiffness that varies over the thickness of walls.

Every tetrahedron is computed alone, so results do not depend on the number of threads.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from gradedesign.arrays import VOIGT

#: Rows of a wall across each axis: along its first and second in-plane axis, shear between them,
#: and transverse shear along both.
_ROWS = np.array(
    [[j, k, VOIGT[j, k], VOIGT[j, i], VOIGT[k, i]] for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1))]
)


@njit(cache=True, nogil=True)
def _diagonal(
    t: int, exponent: Any, height: Any, ratio: Any, rise: Any, square: Any, grown: Any
) -> None:
    """Fill ``(6, q)`` with D squared at the points of a tetrahedron, and its logarithm's slope.

    Arguments as in `wall_moments`.
    """
    square[:] = 1.0
    grown[:] = 0.0
    for axis in range(3):
        power = exponent[axis, t]
        if power == 0:
            continue
        middle = 1.0
        for k in range(1, power + 1):
            middle *= 2 * k / (2 * k + 1)
        for q in range(height.shape[1]):
            z = abs(height[axis, q, t])
            far = (power + 1) * z**power - 1.0
            near = (1.0 - z * z) ** power / middle - 1.0
            for c in range(3):
                row = _ROWS[axis, c]
                value = ratio[axis, c, t] + ratio[axis, 3 + c, t] * far
                value += ratio[axis, 6 + c, t] * near
                slope = rise[axis, c, t] + rise[axis, 3 + c, t] * far + rise[axis, 6 + c, t] * near
                square[row, q] *= value
                grown[row, q] += slope / value
            for c in range(2):
                row = _ROWS[axis, 3 + c]
                square[row, q] *= ratio[axis, 9 + c, t]
                grown[row, q] += rise[axis, 9 + c, t] / ratio[axis, 9 + c, t]


@njit(cache=True, nogil=True)
def wall_moments(
    low: int, high: int, exponent: Any, height: Any, ratio: Any, rise: Any, turn: Any,
    value: Any, slope: Any, moments: Any,
) -> None:  # fmt: skip
    """Fill the moments of ``D C D``, or of its derivative by density, of some tetrahedra.

    - ``exponent (3, M)``: of the profile over the wall across each axis; 0: no wall
    - ``height (3, q, M)``: of the points of the rule in the walls
    - ``ratio``, ``rise``, each ``(3, 11, M)``: ratios of the walls and their derivatives: three
      means, three parts towards the faces, three towards the middle, two of transverse shear
    - ``turn (10, q)``: from values at the points to moments
    - ``value``, ``slope``, each ``(6, 6, M)``: C and its derivative; that of an empty ``slope``
      asks for the moments of ``D C D`` itself
    - ``moments (6, 6, 10, M)``: zero before
    """
    count = turn.shape[1]
    square, grown = np.zeros((6, count)), np.zeros((6, count))
    pair, change = np.zeros(count), np.zeros(count)
    derived = slope.shape[2] > 0
    for t in range(low, high):
        _diagonal(t, exponent, height, ratio, rise, square, grown)
        for i in range(6):
            for j in range(i, 6):
                C, rising = value[i, j, t], slope[i, j, t] if derived else 0.0
                if C == 0.0 and rising == 0.0:
                    continue
                for q in range(count):
                    pair[q] = np.sqrt(square[i, q] * square[j, q])
                    change[q] = C
                    if derived:
                        change[q] = rising + 0.5 * C * (grown[i, q] + grown[j, q])
                    change[q] *= pair[q]
                for p in range(turn.shape[0]):
                    total = 0.0
                    for q in range(count):
                        total += turn[p, q] * change[q]
                    moments[i, j, p, t] = total
                    moments[j, i, p, t] = total
