"""Compiled loops over the grid of phase fields: trilinear elements with one target each."""

from __future__ import annotations

import numpy as np
from numba import njit

from gradedesign.arrays import FloatArray
from gradedesign.common.system.threads import in_ranges

#: Turns of the rotation fit; it settles to 1e-9 in 3 to 8 where cells are not folded.
_TURNS = 40


def divergence(target: FloatArray, spacing: FloatArray) -> FloatArray:
    """Loads of the least-squares fit, ``(3, nx, ny, nz)``.

    ``target`` ``(ex, ey, ez, 3, 3)``: wanted d(phase_i)/dx_j of every element. Row i holds the
    integrals of ``target_i . grad(N)`` over the node's eight elements.
    """
    result = np.zeros((3, *(n + 1 for n in target.shape[:3])))
    in_ranges(_divergence, range(result.shape[1]), target, spacing, result)
    return result


def centre_gradients(phases: FloatArray, spacing: FloatArray) -> FloatArray:
    """Gradients ``d(phase_i)/dx_j`` at the centres of elements, ``(ex, ey, ez, 3, 3)``."""
    result = np.zeros((*(n - 1 for n in phases.shape[1:]), 3, 3))
    in_ranges(_centre_gradients, range(len(result)), phases, spacing, result)
    return result


def nearest_rotations(matrix: FloatArray, start: FloatArray) -> FloatArray:
    """Rotations nearest to matrices ``(n, 3, 3)``, from rotations to start with, ``(n, 3, 3)``.

    Müller, Bender, Chentanez and Macklin, "A robust method to extract the rotational part of
    deformations", Motion in Games 2016, algorithm 1. Unlike a polar decomposition it gives a
    rotation for folded matrices too.
    """
    result = start.copy()
    in_ranges(_turn_to, range(len(result)), matrix, result)
    return result


@njit(cache=True, nogil=True)
def _divergence(
    low: int, high: int, target: FloatArray, spacing: FloatArray, result: FloatArray
) -> None:
    """`divergence` of a range of planes."""
    ex, ey, ez = target.shape[:3]
    face = np.array(
        [
            0.25 * spacing[1] * spacing[2],
            0.25 * spacing[0] * spacing[2],
            0.25 * spacing[0] * spacing[1],
        ]
    )
    for i in range(low, high):
        for j in range(ey + 1):
            for k in range(ez + 1):
                for a in range(max(i - 1, 0), min(i, ex - 1) + 1):
                    sx = face[0] if a < i else -face[0]
                    for b in range(max(j - 1, 0), min(j, ey - 1) + 1):
                        sy = face[1] if b < j else -face[1]
                        for c in range(max(k - 1, 0), min(k, ez - 1) + 1):
                            sz = face[2] if c < k else -face[2]
                            for p in range(3):
                                result[p, i, j, k] += (
                                    sx * target[a, b, c, p, 0]
                                    + sy * target[a, b, c, p, 1]
                                    + sz * target[a, b, c, p, 2]
                                )


@njit(cache=True, nogil=True)
def _centre_gradients(
    low: int, high: int, phases: FloatArray, spacing: FloatArray, result: FloatArray
) -> None:
    """`centre_gradients` of a range of planes."""
    ny, nz = phases.shape[2:]
    for i in range(low, high):
        for j in range(ny - 1):
            for k in range(nz - 1):
                for p in range(3):
                    for a in range(2):
                        for b in range(2):
                            for c in range(2):
                                value = 0.25 * phases[p, i + a, j + b, k + c]
                                result[i, j, k, p, 0] += (2 * a - 1) * value / spacing[0]
                                result[i, j, k, p, 1] += (2 * b - 1) * value / spacing[1]
                                result[i, j, k, p, 2] += (2 * c - 1) * value / spacing[2]


@njit(cache=True, nogil=True)
def _turn_to(low: int, high: int, matrix: FloatArray, result: FloatArray) -> None:
    """`nearest_rotations` of a range of matrices, from and to the result."""
    for n in range(low, high):
        r = result[n]
        for _ in range(_TURNS):
            ox, oy, oz, dot = 0.0, 0.0, 0.0, 0.0
            for c in range(3):
                ax, ay, az = matrix[n, 0, c], matrix[n, 1, c], matrix[n, 2, c]
                ox += r[1, c] * az - r[2, c] * ay
                oy += r[2, c] * ax - r[0, c] * az
                oz += r[0, c] * ay - r[1, c] * ax
                dot += r[0, c] * ax + r[1, c] * ay + r[2, c] * az
            scale = 1.0 / (abs(dot) + 1e-9)
            ox, oy, oz = ox * scale, oy * scale, oz * scale
            angle = np.sqrt(ox * ox + oy * oy + oz * oz)
            if angle < 1e-9:
                break
            ux, uy, uz = ox / angle, oy / angle, oz / angle
            cosine, sine = np.cos(angle), np.sin(angle)
            for c in range(3):
                x, y, z = r[0, c], r[1, c], r[2, c]
                d = (1.0 - cosine) * (ux * x + uy * y + uz * z)
                r[0, c] = cosine * x + sine * (uy * z - uz * y) + d * ux
                r[1, c] = cosine * y + sine * (uz * x - ux * z) + d * uy
                r[2, c] = cosine * z + sine * (ux * y - uy * x) + d * uz
