"""Evaluating a family's shape function, with the checks that a plugin's output must pass."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import CaseError, PluginError, blaming
from gradedesign.geometry.cell.family import CellFamily


def complete_parameters(
    family: CellFamily, parameters: Mapping[str, float] | None
) -> dict[str, float]:
    """Defaults of a family, overridden by ``parameters``, sorted by name.

    Raises CaseError if a name is not a parameter of the family.
    """
    stated = dict(parameters or {})
    unknown = sorted(set(stated) - set(family.parameters))
    if unknown:
        names = ", ".join(sorted(family.parameters)) or "none"
        raise CaseError(
            f"cell '{family.name}' has no parameter {', '.join(unknown)}; its parameters: {names}"
        )
    merged = {**family.parameters, **stated}
    return {name: float(merged[name]) for name in sorted(merged)}


def evaluate_shape(
    family: CellFamily, parameters: Mapping[str, float], u: FloatArray
) -> FloatArray:
    """Values of the shape function, checked.

    Returns ``(...)``. Raises `GradeDesignError`: raised by the function on purpose, such as a
    `CaseError` for a parameter out of range. Raises `PluginError` if the function raises anything
    else, returns another shape, or values that are not finite.

    ``parameters``: complete, see `complete_parameters`. ``u (3, ...)``, cell units.
    """
    where = f"cell '{family.name}'" + (f" with {dict(parameters)}" if parameters else "")
    with blaming(where):
        value = np.asarray(family.shape(u, **parameters), dtype=np.float64)
    if value.shape != u.shape[1:]:
        raise PluginError(
            f"{where} returned an array of shape {value.shape} for points {u.shape}; "
            f"expected {u.shape[1:]}"
        )
    finite = np.isfinite(value)
    if not finite.all():
        first = u.reshape(3, -1)[:, int(np.argmin(finite.ravel()))]
        raise PluginError(
            f"{where} returned {int(np.count_nonzero(~finite))} of {value.size} values that are "
            f"not finite, the first at u = ({first[0]:.4g}, {first[1]:.4g}, {first[2]:.4g})"
        )
    return value


def blamed_shape(family: CellFamily) -> Callable[..., FloatArray]:
    """Shape function whose errors name the cell family.

    Unlike `evaluate_shape` it keeps the float type of the points and checks no value.
    """

    def shape(u: FloatArray, **parameters: float) -> FloatArray:
        with blaming(f"cell '{family.name}'"):
            return family.shape(u, **parameters)

    return shape


def spread_points(count: int, first: int = 0) -> FloatArray:
    """Points of the unit cell that fill it evenly and share no plane with each other, ``(3, n)``.

    ``first``: of those ``count`` points that are returned, where they are taken in pieces.

    A grid has whole planes of nodes, and a shape with flat faces parallel to them takes few
    different values there; of these points no two share a coordinate.

    References
    ----------
    The additive recurrence of a point by powers of 1/x, x^4 = x + 1 (Kronecker sequence); in one
    dimension the golden ratio.
    """
    step = 1.2207440846057596 ** -np.arange(1.0, 4.0)
    return np.asarray(np.mod(0.5 + step[:, None] * np.arange(first, count), 1.0))


def grid_nodes(count: int, shift: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> FloatArray:
    """Nodes ``(i + shift) / count`` of the unit cell, ``(3, count, count, count)``."""
    axes = [(np.arange(count) + s) / count for s in shift]
    return np.stack(np.meshgrid(*axes, indexing="ij"))


#: Points that are compared with their copies. Chosen, not measured.
_POINTS = 300

#: Largest difference between copies, by the range of the values: rounding.
_ROUNDING = 1e-6


def require_period(family: CellFamily, parameters: Mapping[str, float]) -> None:
    """Refuse a shape function that differs between points one period apart.

    Compares values half a period ahead of and behind some hundred points, along each axis.

    Raises PluginError, naming the family, the axis, the largest difference and where it was found.

    ``parameters``: complete.
    """
    points = family.period * spread_points(_POINTS)
    for axis in range(3):
        half = np.zeros((3, 1))
        half[axis] = 0.5 * family.period
        ahead = evaluate_shape(family, parameters, points + half)
        behind = evaluate_shape(family, parameters, points - half)
        spread = float(max(ahead.max(), behind.max()) - min(ahead.min(), behind.min()))
        apart = np.abs(ahead - behind)
        worst = int(apart.argmax())
        if apart[worst] > _ROUNDING * spread:
            x, y, z = (points + half)[:, worst]
            scale = "" if family.period == 1 else f" / {family.period}"
            raise PluginError(
                f"cell '{family.name}': values change by {apart[worst]:.3g} over {family.period} "
                f"cell(s) along {'xyz'[axis]}, up to u = ({x:.4g}, {y:.4g}, {z:.4g}), expected at "
                f"most {_ROUNDING * spread:.3g}; the period must be {family.period}, so use "
                f"2 pi u{scale} inside sin and cos, or declare another period"
            )
