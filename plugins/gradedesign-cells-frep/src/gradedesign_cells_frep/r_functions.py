"""Set operations on values that are negative inside: R-functions and their blends.

Pasko et al. 2009, eqs. 2, 3 and 7, with the sign turned. The R-functions keep the sign of min and
max and are smooth wherever not all arguments vanish.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from gradedesign.fields import FloatArray


def r_and(first: FloatArray, second: FloatArray) -> FloatArray:
    """Intersection, ``f1 + f2 + sqrt(f1^2 + f2^2)``."""
    return np.asarray(first + second + np.hypot(first, second))


def r_or(first: FloatArray, second: FloatArray) -> FloatArray:
    """Union, ``f1 + f2 - sqrt(f1^2 + f2^2)``."""
    return np.asarray(first + second - np.hypot(first, second))


def r_or_of_three(first: FloatArray, second: FloatArray, third: FloatArray) -> FloatArray:
    """Union of three that treats them alike.

    The R-function is not associative: away from the surface the result depends on the order, which
    would tilt a cubic cell. The mean over the three orders has the same sign and no order.
    """
    return np.asarray(
        (
            r_or(r_or(first, second), third)
            + r_or(r_or(second, third), first)
            + r_or(r_or(third, first), second)
        )
        / 3
    )


def displacement(size: float, width: float, *values: FloatArray) -> FloatArray:
    """Displacement that blends, ``-a0 / (1 + (f1 / a1)^2 + (f2 / a1)^2)`` summed over pairs.

    Parameters
    ----------
    size : float
        The paper's a0: positive adds material (fillet), negative removes it (chamfer).
    width : float
        The paper's a1 = a2: how far from both surfaces the blend reaches, in values.
    values : (...) arrays
        Two or more.

    Returns
    -------
    (...) array
        Added to values of the set operation.
    """
    total = np.zeros_like(values[0])
    for first, second in combinations(values, 2):
        total = total - size / (1 + (first / width) ** 2 + (second / width) ** 2)
    return total
