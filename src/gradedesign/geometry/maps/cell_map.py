"""Cell maps: from points in mm to cell coordinates, with the derivative."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from gradedesign.arrays import BoolArray, Field, FloatArray
from gradedesign.errors import CaseError, LatticeError


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellMap:
    """A map from points in mm to cell coordinates u of period 1.

    It is called like a function. What follows from its derivative (size of the cells, angles
    between their axes, folds) is reported by
    :func:`gradedesign.geometry.maps.map_report.map_report`.

    Attributes
    ----------
    name : str
        For messages and reports, such as ``"cylindrical"``.
    coordinates : callable
        Points ``(3, ...)`` mm to u ``(3, ...)``.
    jacobian : callable
        Points ``(3, ...)`` mm to du_i/dx_j ``(3, 3, ...)``, 1/mm.
    size : float, mm
        Edge of a typical cell; exact where all cells are equal cubes.
    singular : callable, optional
        Points ``(3, ...)`` mm to booleans ``(...)``: where the map must not be used, because its
        cells shrink to nothing. ``coordinates`` stay finite there.
    singular_name : str
        Name of the place, such as ``"the axis"``.
    inverse : callable, optional
        Cell coordinates u ``(3, ...)`` to points ``(3, ...)`` mm, of straight cells.
    """

    name: str
    coordinates: Field
    jacobian: Field
    size: float
    singular: Callable[[FloatArray], BoolArray] | None = None
    singular_name: str = ""
    inverse: Field | None = None

    def __call__(self, points: FloatArray) -> FloatArray:
        """Cell coordinates u ``(3, ...)`` at points ``(3, ...)`` mm."""
        return self.coordinates(points)


def uniform_map(
    size: float | Sequence[float],
    origin: Sequence[float] = (0.0, 0.0, 0.0),
    rotation: FloatArray | None = None,
) -> CellMap:
    """Map of equal cells.

    Raises CaseError if a size is not positive or the matrix is not a rotation.

    ``size``: float or (3,) sequence, mm; edge of the cell, or one edge for each cell axis.
    ``origin (3,)``, mm: where a corner of a cell lies. ``rotation (3, 3)``: columns are the cell
    axes in global coordinates.

    Examples
    --------
    >>> to_cell = uniform_map(50.0, origin=(10.0, 0.0, 0.0))
    >>> to_cell(np.array([60.0, 25.0, 0.0])).tolist()
    [1.0, 0.5, 0.0]
    """
    edges = positive_sizes(size)
    start = np.asarray(origin, dtype=np.float64)
    axes = np.eye(3) if rotation is None else _rotation_matrix(rotation)
    matrix = (axes / edges).T

    def to_cell(points: FloatArray) -> FloatArray:
        x = np.asarray(points, dtype=np.float64)
        shifted = x - along(start, x)
        if rotation is None:
            return np.asarray(shifted / along(edges, x))
        return np.tensordot(matrix, shifted, axes=1)

    def to_points(u: FloatArray) -> FloatArray:
        x = np.asarray(u, dtype=np.float64)
        return np.asarray(np.tensordot(axes, x * along(edges, x), axes=1) + along(start, x))

    def jacobian(points: FloatArray) -> FloatArray:
        return constant_jacobian(matrix, points)

    return CellMap(
        name="uniform",
        coordinates=to_cell,
        jacobian=jacobian,
        inverse=to_points,
        size=float(edges[0] if np.ptp(edges) == 0 else np.prod(edges) ** (1 / 3)),
    )


def turned_axes(degrees: Sequence[float]) -> FloatArray:
    """Cell axes turned by Euler angles about their own x, then y, then z, as columns ``(3, 3)``."""
    return np.asarray(Rotation.from_euler("XYZ", degrees, degrees=True).as_matrix())


def require_regular(cell_map: CellMap, points: FloatArray) -> None:
    """Refuse a map where its cells shrink to nothing inside the part.

    Raises LatticeError, naming the place.

    ``points``, (3, ...) array, mm: points inside the part.
    """
    if cell_map.singular is None:
        return
    bad = np.asarray(cell_map.singular(points))
    if bad.any():
        x, y, z = np.asarray(points)[:, bad][:, 0]
        raise LatticeError(
            f"the {cell_map.name} cell map cannot be used near {cell_map.singular_name}, where "
            f"its cells shrink to nothing, but {np.count_nonzero(bad)} of {bad.size} points of "
            f"the part lie there, one at ({x:.4g}, {y:.4g}, {z:.4g}) mm; move the map, keep that "
            f"place solid or empty, or take another map"
        )


def positive_sizes(size: float | Sequence[float]) -> FloatArray:
    """Three cell edges in mm from one or three.

    Raises CaseError if an edge is not positive and finite.
    """
    edges = np.array(np.broadcast_to(np.asarray(size, dtype=np.float64), (3,)))
    if not (np.isfinite(edges).all() and (edges > 0).all()):
        raise CaseError(f"cell size {edges.tolist()} mm is impossible; use positive lengths")
    return edges


def _rotation_matrix(rotation: ArrayLike) -> FloatArray:
    """Check that a ``(3, 3)`` matrix is a rotation.

    Raises CaseError if its columns are not right-handed orthogonal unit vectors.
    """
    axes = np.array(rotation, dtype=np.float64)
    if axes.shape != (3, 3) or not (
        np.allclose(axes.T @ axes, np.eye(3), atol=1e-9) and np.linalg.det(axes) > 0
    ):
        raise CaseError(
            f"the cell rotation {axes.tolist()} is not a rotation matrix; its columns must be "
            f"three right-handed orthogonal unit vectors"
        )
    return axes


def frame_along(axis: Sequence[float]) -> FloatArray:
    """Right-handed frame whose third axis is given.

    The first lies along the coordinate axis that is most nearly perpendicular to it.

    Returns (3, 3) array: columns are the axes. Raises CaseError if the direction has no length.

    ``axis``, (3,) sequence: direction of the third axis, any length.
    """
    third = np.asarray(axis, dtype=np.float64)
    length = float(np.linalg.norm(third))
    if third.shape != (3,) or not (np.isfinite(third).all() and length > 0):
        raise CaseError(f"the axis {third.tolist()} is no direction; give three numbers, not all 0")
    third = third / length
    first = np.eye(3)[int(np.argmin(np.abs(third)))]
    first = first - (first @ third) * third
    first = first / np.linalg.norm(first)
    return np.stack([first, np.cross(third, first), third], axis=1)


def along(vector: FloatArray, points: FloatArray) -> FloatArray:
    """A ``(3,)`` vector shaped to broadcast against points ``(3, ...)``."""
    return vector.reshape(3, *[1] * (points.ndim - 1))


def constant_jacobian(matrix: FloatArray, points: FloatArray) -> FloatArray:
    """The same ``(3, 3)`` matrix at every point, ``(3, 3, ...)``."""
    rest = np.shape(points)[1:]
    return np.array(np.broadcast_to(matrix.reshape(3, 3, *[1] * len(rest)), (3, 3, *rest)))


def numeric_gradient(function: Field, points: FloatArray, step: float) -> FloatArray:
    """Gradient of a scalar function by central differences, ``(3, ...)``."""
    x = np.asarray(points, dtype=np.float64)
    parts = []
    for shift in step * np.eye(3):
        move = along(shift, x)
        parts.append((np.asarray(function(x + move)) - function(x - move)) / (2 * step))
    return np.stack(parts)
