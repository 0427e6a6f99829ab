"""The largest of many values, with a derivative that holds those next to it too."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray

#: Weights below this are none: 1000 of them change a sum by 1e-6.
_NEGLIGIBLE = 1e-9


def largest_and_slope(values: FloatArray, exponent: float) -> tuple[float, FloatArray]:
    """The largest value, and the derivatives of a norm that equals it.

    The largest value changes places from one design to the next: lowered where it is now, it comes
    back elsewhere, for ever. The norm of all values, in proportion so that it equals the largest,
    lowers those that come next as well (Le, Norato, Bruns, Ha, Tortorelli, Struct. Multidisc.
    Optim. 41, 2010, 605-620, equation 17).

    ``values``: not negative. ``exponent``: of the norm: a value that is lower by 1 % weighs less by
    so many per cent.

    Examples
    --------
    >>> largest_and_slope(np.array([2.0, 2.0, 1.0]), 4.0)
    (2.0, array([0.48484848, 0.48484848, 0.06060606]))
    """
    value = float(values.max(initial=0.0))
    if value == 0.0:
        return 0.0, np.zeros(values.shape)
    weights = (values / value) ** (exponent - 1.0)
    weights[weights < _NEGLIGIBLE] = 0.0
    return value, weights * (value / float((weights * values).sum()))
