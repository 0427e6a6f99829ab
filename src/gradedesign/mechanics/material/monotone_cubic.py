"""Monotone cubics through the values of many curves, with derivatives by place and by value.

They are those of `scipy.interpolate.PchipInterpolator`, which knows the derivative by place alone.

References
----------
F. N. Fritsch, J. Butland, SIAM J. Sci. Stat. Comput. 5, 1984 (slopes at the knots).
"""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray, IntArray


def cubic_derivatives(
    knots: FloatArray, values: FloatArray, x: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Every curve at its own place, and how it changes.

    ``knots (k,)``: increasing, two or more. ``values (k, n)``: of n curves. ``x (n,)``: between the
    first knot and the last. Returns ``value (n,)``; ``by_place (n,)``; ``by_value (k, n)``:
    derivatives by the values at the knots.
    """
    h = np.diff(knots)
    every = np.arange(x.size)
    piece = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, h.size - 1)
    width = h[piece]
    t = (x - knots[piece]) / width
    secant = np.diff(values, axis=0) / h[:, None]
    (left, left_by), (right, right_by) = (_slopes(h, secant, piece + end) for end in (0, 1))
    # Hermite's polynomials of both values and both slopes, and their derivatives.
    h00, h10 = (1 + 2 * t) * (1 - t) ** 2, t * (1 - t) ** 2
    h01, h11 = t**2 * (3 - 2 * t), t**2 * (t - 1)
    low, high = values[piece, every], values[piece + 1, every]
    value = h00 * low + h01 * high + width * (h10 * left + h11 * right)
    by_place = (
        6 * t * (1 - t) * (high - low) / width
        + (1 - t) * (1 - 3 * t) * left
        + t * (3 * t - 2) * right
    )
    by_value = np.zeros_like(values)
    by_value[piece, every] += h00
    by_value[piece + 1, every] += h01
    by_secant = width * (h10 * left_by + h11 * right_by) / h[:, None]
    by_value[:-1] -= by_secant
    by_value[1:] += by_secant
    return value, by_place, by_value


def _slopes(h: FloatArray, secant: FloatArray, knot: IntArray) -> tuple[FloatArray, FloatArray]:
    """Slope of every curve at a knot of its own ``(n,)``, and derivatives by secants (k-1, n)."""
    count, n = secant.shape
    every = np.arange(n)
    slope, by = np.zeros(n), np.zeros((count, n))
    if count == 1:
        by[0] = 1.0
        return secant[0], by
    for end, (a, b) in ((0, (0, 1)), (count, (count - 1, count - 2))):
        here = every[knot == end]
        slope[here], by[a, here], by[b, here] = _end_slope(
            h[a], h[b], secant[a, here], secant[b, here]
        )
    inner = every[(knot > 0) & (knot < count)]
    right = knot[inner]
    m0, m1 = secant[right - 1, inner], secant[right, inner]
    same = m0 * m1 > 0
    inner, right, m0, m1 = inner[same], right[same], m0[same], m1[same]
    h0, h1 = h[right - 1], h[right]
    w0, w1 = (2 * h1 + h0) / (3 * (h0 + h1)), (h1 + 2 * h0) / (3 * (h0 + h1))
    mean = 1.0 / (w0 / m0 + w1 / m1)
    slope[inner] = mean
    by[right - 1, inner] = w0 * (mean / m0) ** 2
    by[right, inner] = w1 * (mean / m1) ** 2
    return slope, by


def _end_slope(
    h0: float, h1: float, m0: FloatArray, m1: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Slope at an end from its two nearest secants, kept monotone, and its derivatives by both."""
    a, b = (2 * h0 + h1) / (h0 + h1), -h0 / (h0 + h1)
    slope, by0, by1 = a * m0 + b * m1, np.full_like(m0, a), np.full_like(m0, b)
    against = slope * m0 <= 0
    steep = ~against & (m0 * m1 <= 0) & (np.abs(slope) > 3 * np.abs(m0))
    slope = np.where(against, 0.0, np.where(steep, 3 * m0, slope))
    return (
        slope,
        np.where(against, 0.0, np.where(steep, 3.0, by0)),
        np.where(against | steep, 0.0, by1),
    )
