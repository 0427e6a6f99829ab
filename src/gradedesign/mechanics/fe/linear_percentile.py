"""Percentile by volume of a field that is linear in every tetrahedron."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray

#: Width, over the largest value, of the interval that is halved down to. Chosen, not measured.
_RESOLVED = 1e-9


def linear_percentile(values: FloatArray, volumes: FloatArray, percentile: float) -> float:
    """Value that the field does not exceed in a percentage of the volume.

    Raises `ValueError` if shapes differ, a value is not finite, a volume is negative or all are 0.

    ``values (4, k)``: at the corners of the tetrahedra. ``volumes (k,)``: not negative; the volume
    of a tetrahedron, or the part of it that counts. ``percentile``: more than 0, at most 100.

    Examples
    --------
    A tetrahedron with the value 1 at one corner and 0 at the others is above 1/2 in 1/8 of it.

    >>> round(linear_percentile(np.array([[0.0], [0.0], [0.0], [1.0]]), np.ones(1), 87.5), 6)
    0.5
    """
    if not 0.0 < percentile <= 100.0:
        raise ValueError(f"percentile is {percentile:g}, expected more than 0 and at most 100")
    if values.shape != (4, *volumes.shape):
        raise ValueError(f"{values.shape} values for {volumes.shape} volumes, expected (4, k)")
    if not (np.isfinite(values).all() and (volumes >= 0.0).all() and volumes.sum() > 0.0):
        raise ValueError(
            "a value is not finite, a volume is negative, or there is no volume at all; expected "
            "numbers with non-negative volumes"
        )
    corners = np.sort(values[:, volumes > 0.0], axis=0)
    weights = volumes[volumes > 0.0]
    low, high = float(corners[0].min()), float(corners[3].max())
    wanted = percentile / 100.0 * float(weights.sum())
    below = 0.0  # volume of the tetrahedra that lie below the interval
    resolved = _RESOLVED * max(abs(low), abs(high))
    while percentile < 100.0 and high - low > resolved:
        middle = 0.5 * (low + high)
        if below + float(weights @ share_below(corners, middle)) >= wanted:
            high = middle
        else:
            low = middle
        under = corners[3] <= low
        below += float(weights[under].sum())
        open_still = ~under & (corners[0] < high)
        corners, weights = corners[:, open_still], weights[open_still]
    return high


def share_below(corners: FloatArray, level: float) -> FloatArray:
    """Share of each tetrahedron where a linear field lies below a level, ``(k,)``.

    The distribution of a linear function on a simplex is a B-spline with the values at its corners
    as knots (Curry and Schoenberg, J. Analyse Math. 17, 1966); here integrated.

    ``corners (4, k)``: values at the corners, rising.
    """
    a, b, c, d = corners
    share = np.where(d <= level, 1.0, 0.0)
    first = (a < level) & (level <= b)
    middle = (b < level) & (level < c)
    last = (c <= level) & (level < d) & ~first
    x = level - a[first]
    share[first] = x / (b - a)[first] * (x / (c - a)[first]) * (x / (d - a)[first])
    x = d[last] - level
    share[last] = 1.0 - x / (d - a)[last] * (x / (d - b)[last]) * (x / (d - c)[last])
    ab, ac, ad, bc, bd = (
        (end - start)[middle] for start, end in ((a, b), (a, c), (a, d), (b, c), (b, d))
    )
    x = level - b[middle]
    rising = (ab * bc * x + (bc - ab) * x**2 / 2.0 - x**3 / 3.0) / (ac * bc)
    falling = (bd * x**2 / 2.0 - x**3 / 3.0) / (bd * bc)
    share[middle] = ab / ac * (ab / ad) + 3.0 / ad * (rising + falling)
    return share
