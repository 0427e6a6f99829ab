"""Compiled search for the wave that uses most of the resistance of a lattice under a stress."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

#: Tops that the search climbs, and the cosine within which directions lead to the same one. Chosen,
#: not measured.
TOPS, APART = 2, 0.9


@njit(cache=True, nogil=True)
def wave_use(n, s, c, sway):
    """Work of a stress over the stiffness in the wave along ``n`` that resists it least.

    The largest ``mu`` with ``det(G - mu Q) = 0``: ``Q`` the acoustic tensor of the stiffness,
    ``G`` minus ``n S n`` and the work on swaying struts.
    """
    x, y, z = n[0], n[1], n[2]
    # Strain of a displacement along each axis: which Voigt rows, and the component of n in each.
    rows = ((0, 5, 4), (5, 1, 3), (4, 3, 2))
    q = np.zeros((3, 3))
    for i in range(3):
        for k in range(i, 3):
            total = 0.0
            for j in range(3):
                part = 0.0
                for m in range(3):
                    part += c[rows[i][j], rows[k][m]] * n[m]
                total += part * n[j]
            q[i, k] = total
    sx = s[0] * x + s[5] * y + s[4] * z
    sy = s[5] * x + s[1] * y + s[3] * z
    sz = s[4] * x + s[3] * y + s[2] * z
    along = sx * x + sy * y + sz * z
    f = 0.25 * sway
    a = -along * (1.0 + f)
    g00 = a - f * (2 * x * sx + s[0])
    g11 = a - f * (2 * y * sy + s[1])
    g22 = a - f * (2 * z * sz + s[2])
    g01 = -f * (x * sy + y * sx + s[5])
    g02 = -f * (x * sz + z * sx + s[4])
    g12 = -f * (y * sz + z * sy + s[3])
    # Inverse of the Cholesky factor of Q.
    l00 = 1.0 / np.sqrt(q[0, 0])
    b10 = q[0, 1] * l00
    b20 = q[0, 2] * l00
    l11 = 1.0 / np.sqrt(q[1, 1] - b10 * b10)
    b21 = (q[1, 2] - b20 * b10) * l11
    l22 = 1.0 / np.sqrt(q[2, 2] - b20 * b20 - b21 * b21)
    l10 = -b10 * l00 * l11
    l21 = -b21 * l11 * l22
    l20 = -(b20 * l00 + b21 * l10) * l22
    # Rows of inv(L) G inv(L)^T.
    a00 = l00 * l00 * g00
    r10, r11 = l10 * g00 + l11 * g01, l10 * g01 + l11 * g11
    r20 = l20 * g00 + l21 * g01 + l22 * g02
    r21 = l20 * g01 + l21 * g11 + l22 * g12
    r22 = l20 * g02 + l21 * g12 + l22 * g22
    a01 = r10 * l00
    a02 = r20 * l00
    a11 = r10 * l10 + r11 * l11
    a12 = r20 * l10 + r21 * l11
    a22 = r20 * l20 + r21 * l21 + r22 * l22
    # Largest eigenvalue of a symmetric matrix by its invariants.
    mean = (a00 + a11 + a22) / 3.0
    d0, d1, d2 = a00 - mean, a11 - mean, a22 - mean
    off = a01 * a01 + a02 * a02 + a12 * a12
    size = np.sqrt((d0 * d0 + d1 * d1 + d2 * d2 + 2.0 * off) / 6.0)
    if size == 0.0:
        return mean
    det = d0 * (d1 * d2 - a12 * a12) - a01 * (a01 * d2 - a12 * a02) + a02 * (a01 * a12 - d1 * a02)
    angle = min(max(0.5 * det / size**3, -1.0), 1.0)
    return mean + 2.0 * size * np.cos(np.arccos(angle) / 3.0)


@njit(cache=True, nogil=True)
def _normalise(v):
    """Divide a vector ``(3,)`` by its length."""
    length = np.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
    for d in range(3):
        v[d] /= length


@njit(cache=True, nogil=True)
def _climbed(n, value, s, c, sway, first, last):
    """The use at the top next to a direction, by steps across it from ``first`` to ``last``."""
    step = first
    side, up, trial, best = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    while step > last:
        # Two directions across n.
        k = 0
        for d in range(1, 3):
            if abs(n[d]) < abs(n[k]):
                k = d
        for d in range(3):
            side[d] = -n[k] * n[d]
        side[k] += 1.0
        _normalise(side)
        up[0] = n[1] * side[2] - n[2] * side[1]
        up[1] = n[2] * side[0] - n[0] * side[2]
        up[2] = n[0] * side[1] - n[1] * side[0]
        better = value
        for i in range(-1, 2):
            for j in range(-1, 2):
                if i == 0 and j == 0:
                    continue
                for d in range(3):
                    trial[d] = n[d] + step * (i * side[d] + j * up[d])
                _normalise(trial)
                use = wave_use(trial, s, c, sway)
                if use > better:
                    better = use
                    for d in range(3):
                        best[d] = trial[d]
        if better > value:
            value = better
            for d in range(3):
                n[d] = best[d]
        else:
            step *= 0.5
    return value


@njit(cache=True, nogil=True)
def most_used(low, high, stress, stiffness, starts, sway, first, last, found, along):
    """Fill use and direction of the wave that uses most, under every stress of a range.

    Parameters
    ----------
    low, high : int
    stress : (6, n) float64 array
    stiffness : (6, 6, n) float64 array
        Positive definite.
    starts : (d, 3) float64 array
        Directions from which the search climbs.
    sway : float
    first, last : float
        Steps of the search, in radians.
    found : (n,) float64 array
        Written; negative where every wave is stretched.
    along : (3, n) float64 array
        Written: the direction.
    """
    s, c, n = np.zeros(6), np.zeros((6, 6)), np.zeros(3)
    uses = np.zeros(starts.shape[0])
    for e in range(low, high):
        for i in range(6):
            s[i] = stress[i, e]
            for j in range(6):
                c[i, j] = stiffness[i, j, e]
        for d in range(starts.shape[0]):
            uses[d] = wave_use(starts[d], s, c, sway)
        top = -np.inf
        for _ in range(TOPS):
            d = int(np.argmax(uses))
            if uses[d] == -np.inf:
                break
            for i in range(3):
                n[i] = starts[d, i]
            climbed = _climbed(n, uses[d], s, c, sway, first, last)
            if climbed > top:
                top = climbed
                for i in range(3):
                    along[i, e] = n[i]
            # Another top lies apart from both ends of this way.
            for k in range(starts.shape[0]):
                if max(_cosine(starts[k], n), _cosine(starts[k], starts[d])) > APART:
                    uses[k] = -np.inf
        found[e] = top


@njit(cache=True, nogil=True)
def _cosine(a, b):
    """Magnitude of the product of two unit vectors."""
    return abs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])
