"""Compiled evaluation of three cubic B-spline fields on one grid."""

from __future__ import annotations

import numpy as np
from numba import njit

from gradedesign.arrays import FloatArray
from gradedesign.common.system.threads import in_ranges

#: Nodes by which the coefficients reach beyond the grid on every side: a cubic spline's at its
#: border.
PAD = 1
#: Points that are worth a thread: 0.1 ms of work. Chosen, not measured.
_POINTS = 512


@njit(cache=True, nogil=True)
def _weights(t: float, value: FloatArray, slope: FloatArray) -> None:
    """Values and slopes of the four cubic B-splines that are not zero at ``t`` in [0, 1]."""
    s = 1.0 - t
    value[0] = s * s * s / 6.0
    value[1] = (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0
    value[2] = (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0
    value[3] = t * t * t / 6.0
    slope[0] = -0.5 * s * s
    slope[1] = -2.0 * t + 1.5 * t * t
    slope[2] = 2.0 * s - 1.5 * s * s
    slope[3] = 0.5 * t * t


@njit(cache=True, nogil=True)
def _locate(
    point: FloatArray,
    origin: FloatArray,
    spacing: FloatArray,
    last: FloatArray,
    cell: FloatArray,
    value: FloatArray,
    slope: FloatArray,
    beyond: FloatArray,
) -> bool:
    """Weights of a point moved to the nearest one of the grid; whether it was moved, and how far.

    ``last``: index of the last node of each axis.
    """
    moved = False
    for d in range(3):
        s = (point[d] - origin[d]) / spacing[d]
        inside = min(max(s, 0.0), last[d])
        beyond[d] = (s - inside) * spacing[d]
        moved = moved or s != inside
        low = min(np.floor(inside), last[d] - 1.0)
        cell[d] = low
        _weights(inside - low, value[d], slope[d])
    return moved


def spline_values(
    coefficients: FloatArray, origin: FloatArray, spacing: FloatArray, points: FloatArray
) -> FloatArray:
    """Three fields at points ``(3, n)``, linear beyond the grid, ``(3, n)``.

    ``coefficients`` ``(nx, ny, nz, 3)``, with `PAD` nodes beyond the grid.
    """
    result = np.zeros(points.shape)
    in_ranges(
        _fill_values,
        range(0, points.shape[1], _POINTS),
        coefficients,
        origin,
        spacing,
        points,
        result,
    )
    return result


def spline_gradients(
    coefficients: FloatArray, origin: FloatArray, spacing: FloatArray, points: FloatArray
) -> FloatArray:
    """Derivatives d(field_i)/dx_j of `spline_values` at points ``(3, n)``, ``(3, 3, n)``."""
    result = np.zeros((3, 3, points.shape[1]))
    in_ranges(
        _fill_gradients,
        range(0, points.shape[1], _POINTS),
        coefficients,
        origin,
        spacing,
        points,
        result,
    )
    return result


@njit(cache=True, nogil=True)
def _fill_values(
    low: int,
    high: int,
    coefficients: FloatArray,
    origin: FloatArray,
    spacing: FloatArray,
    points: FloatArray,
    result: FloatArray,
) -> None:
    """`spline_values` at a range of points."""
    last = np.array([float(n - 2 * PAD - 1) for n in coefficients.shape[:3]])
    cell, beyond = np.zeros(3), np.zeros(3)
    value, slope = np.zeros((3, 4)), np.zeros((3, 4))
    for n in range(low, high):
        moved = _locate(points[:, n], origin, spacing, last, cell, value, slope, beyond)
        x, y, z = int(cell[0]) + PAD - 1, int(cell[1]) + PAD - 1, int(cell[2]) + PAD - 1
        first, second, third = 0.0, 0.0, 0.0
        for a in range(4):
            for b in range(4):
                w = value[0, a] * value[1, b]
                gx = slope[0, a] * value[1, b] * beyond[0] / spacing[0]
                gy = value[0, a] * slope[1, b] * beyond[1] / spacing[1]
                for c in range(4):
                    share = w * value[2, c]
                    if moved:
                        share += (gx + gy) * value[2, c]
                        share += w * slope[2, c] * beyond[2] / spacing[2]
                    first += share * coefficients[x + a, y + b, z + c, 0]
                    second += share * coefficients[x + a, y + b, z + c, 1]
                    third += share * coefficients[x + a, y + b, z + c, 2]
        result[0, n], result[1, n], result[2, n] = first, second, third


@njit(cache=True, nogil=True)
def _fill_gradients(
    low: int,
    high: int,
    coefficients: FloatArray,
    origin: FloatArray,
    spacing: FloatArray,
    points: FloatArray,
    result: FloatArray,
) -> None:
    """`spline_gradients` at a range of points."""
    last = np.array([float(n - 2 * PAD - 1) for n in coefficients.shape[:3]])
    cell, beyond = np.zeros(3), np.zeros(3)
    value, slope = np.zeros((3, 4)), np.zeros((3, 4))
    index, gradient = np.zeros(3, dtype=np.int64), np.zeros((3, 3))
    for n in range(low, high):
        moved = _locate(points[:, n], origin, spacing, last, cell, value, slope, beyond)
        x, y, z = int(cell[0]) + PAD - 1, int(cell[1]) + PAD - 1, int(cell[2]) + PAD - 1
        for p in range(3):
            for d in range(3):
                gradient[p, d] = 0.0
        for a in range(4):
            for b in range(4):
                for c in range(4):
                    index[0], index[1], index[2] = a, b, c
                    for d in range(3):
                        e, f = (d + 1) % 3, (d + 2) % 3
                        ve, vf = value[e, index[e]], value[f, index[f]]
                        share = ve * vf
                        if moved and beyond[d] == 0.0:
                            # Along the border the slope continued beyond it changes too.
                            share += slope[e, index[e]] * vf * beyond[e] / spacing[e]
                            share += ve * slope[f, index[f]] * beyond[f] / spacing[f]
                        share *= slope[d, index[d]] / spacing[d]
                        for p in range(3):
                            gradient[p, d] += share * coefficients[x + a, y + b, z + c, p]
        for p in range(3):
            for d in range(3):
                result[p, d, n] = gradient[p, d]
