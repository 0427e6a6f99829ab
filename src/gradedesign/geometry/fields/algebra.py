"""The algebra of implicit fields: set operations, blends, R-functions, gradients.

A field maps points ``(3, ...)`` in mm to values ``(...)``, negative inside. The operations take
fields and return fields. They keep the sign exactly; where they keep true distances, they say so.
"""

from __future__ import annotations

from functools import reduce

import numpy as np

from gradedesign.arrays import Field, FloatArray


def union(*fields: Field) -> Field:
    """Inside any: the minimum. A distance outside; inside a lower bound of one.

    Examples
    --------
    >>> left, right = (lambda p: p[0]), (lambda p: 2 - p[0])
    >>> float(union(left, right)(np.array([3.0, 0, 0])))
    -1.0
    """
    return _combined(np.minimum, fields)


def intersection(*fields: Field) -> Field:
    """Inside all: the maximum. A distance inside; outside a lower bound of one.

    Examples
    --------
    >>> left, right = (lambda p: p[0]), (lambda p: 2 - p[0])
    >>> float(intersection(left, right)(np.array([3.0, 0, 0])))
    3.0
    """
    return _combined(np.maximum, fields)


def complement(field: Field) -> Field:
    """Inside becomes outside.

    Examples
    --------
    >>> float(complement(lambda p: p[0])(np.array([3.0, 0, 0])))
    -3.0
    """
    return lambda points: -field(points)


def difference(field: Field, *removed: Field) -> Field:
    """Inside the first, outside all others.

    Examples
    --------
    >>> slab = difference(lambda p: p[0] - 4, lambda p: p[0] - 1)
    >>> [float(slab(np.array([x, 0, 0]))) for x in (0.0, 3.0)]
    [1.0, -1.0]
    """
    return intersection(field, *(complement(subtrahend) for subtrahend in removed))


def offset(field: Field, distance: float) -> Field:
    """Grow by ``distance`` mm, or shrink where negative; exact for true distances.

    Examples
    --------
    >>> float(offset(lambda p: p[0], 0.5)(np.array([3.0, 0, 0])))
    2.5
    """
    return lambda points: field(points) - distance


def shell(field: Field, thickness: float) -> Field:
    """Layer of ``thickness`` mm just inside the surface of a distance field.

    Raises
    ------
    ValueError
        If the thickness is not positive.

    Examples
    --------
    >>> wall = shell(lambda p: p[0], 1.0)
    >>> [float(wall(np.array([x, 0, 0]))) for x in (-2.0, -0.5, 1.0)]
    [1.0, -0.5, 1.0]
    """
    if not thickness > 0:
        raise ValueError(f"a shell of thickness {thickness:g} mm is empty; use a positive one")

    def evaluate(points: FloatArray) -> FloatArray:
        value = field(points)
        return np.maximum(value, -thickness - value)

    return evaluate


def blend_union(first: Field, second: Field, radius: float) -> Field:
    """Union with a concave fillet.

    The fillet of two true distances that meet at a right angle is an exact arc of ``radius``;
    wherever one of the fields is ``radius`` or more, the result is the plain minimum.

    Parameters
    ----------
    radius : float, mm

    Raises
    ------
    ValueError
        If the radius is negative.

    Examples
    --------
    >>> corner = blend_union(lambda p: p[0], lambda p: p[1], 1.0)
    >>> round(float(corner(np.array([0.5, 0.5, 0.0]))), 4)
    0.2929
    """
    if not radius >= 0:
        raise ValueError(f"a blend radius of {radius:g} mm is impossible; use 0 mm or more")

    def evaluate(points: FloatArray) -> FloatArray:
        a, b = first(points), second(points)
        reach = np.hypot(np.maximum(radius - a, 0.0), np.maximum(radius - b, 0.0))
        return np.maximum(radius, np.minimum(a, b)) - reach

    return evaluate


def blend_intersection(first: Field, second: Field, radius: float) -> Field:
    """Intersection with a convex rounding of ``radius`` mm; see `blend_union`.

    Examples
    --------
    >>> edge = blend_intersection(lambda p: p[0], lambda p: p[1], 1.0)
    >>> round(float(edge(np.array([-0.5, -0.5, 0.0]))), 4)
    -0.2929
    """
    return complement(blend_union(complement(first), complement(second), radius))


def r_union(first: Field, second: Field) -> Field:
    """Union by an R-function: smooth except where both fields vanish; no distance.

    Examples
    --------
    >>> both = r_union(lambda p: p[0], lambda p: p[1])
    >>> float(both(np.array([3.0, 4.0, 0.0])))
    2.0

    References
    ----------
    Rvachev's system R0; Pasko et al., The Visual Computer 11 (1995) 429, sign turned.
    """

    def evaluate(points: FloatArray) -> FloatArray:
        a, b = first(points), second(points)
        return a + b - np.hypot(a, b)

    return evaluate


def r_intersection(first: Field, second: Field) -> Field:
    """Intersection by an R-function; see `r_union`.

    Examples
    --------
    >>> both = r_intersection(lambda p: p[0], lambda p: p[1])
    >>> float(both(np.array([-3.0, -4.0, 0.0])))
    -2.0
    """
    return complement(r_union(complement(first), complement(second)))


def gradient(function: Field, points: FloatArray, step: float = 1e-5) -> FloatArray:
    """Gradient of a function of points ``(3, n)`` by central differences, ``(3, n)``.

    Examples
    --------
    >>> gradient(lambda p: p[0] * p[1], np.array([[2.0], [3.0], [0.0]])).round(6).tolist()
    [[3.0], [2.0], [0.0]]
    """
    shifts = step * np.eye(3)[:, :, None]
    return np.stack([function(points + s) - function(points - s) for s in shifts]) / (2 * step)


def _combined(operation: np.ufunc, fields: tuple[Field, ...]) -> Field:
    """Fold fields with a binary operation."""
    if not fields:
        raise ValueError("combining no fields has no meaning; give at least one")
    return lambda points: reduce(operation, (field(points) for field in fields))
