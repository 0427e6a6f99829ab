"""Layers of cells that follow a surface of the part."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.geometry.maps.cell_map import (
    CellMap,
    along,
    frame_along,
    numeric_gradient,
    positive_sizes,
)
from gradedesign.geometry.maps.cylindrical_map import whole_cells

#: Step of the differences of a distance, relative to the size of a cell. Far above rounding, far
#: below the curvature of a cell. Chosen, not measured.
_STEP = 1e-4


def conformal_map(
    depth: Field,
    size: float | Sequence[float],
    *,
    normal: Sequence[float],
    origin: Sequence[float] = (0.0, 0.0, 0.0),
) -> CellMap:
    """Map whose third coordinate counts layers from a surface.

    Returns CellMap: differentiable where ``depth`` is: not where two places of the surface are
    equally near. Raises CaseError for an impossible size or direction.

    - ``depth``: points ``(3, ...)`` mm to the distance from the surface ``(...)``, mm, growing into
      the part: the negative of :func:`gradedesign.geometry.part.signed_distance.surface_distance`,
      or :func:`~gradedesign.geometry.part.signed_distance.region_distance` of one face
    - ``size``: float or (3,) sequence, mm; edges of a cell; the third is the thickness of a layer
    - ``normal (3,)``: mean direction into the part. The other two coordinates are those of the
      plane across it, so cells shear by the angle between it and the surface's own normal, and fold
      at 90 degrees.
    - ``origin (3,)``, mm: a corner of a cell in the plane
    """
    edges = positive_sizes(size)
    frame = frame_along(normal)
    start = np.asarray(origin, dtype=np.float64)
    step = _STEP * edges[2]

    def coordinates(points: FloatArray) -> FloatArray:
        x = np.asarray(points, dtype=np.float64)
        a, b, _ = np.tensordot(frame.T, x - along(start, x), axes=1)
        layer = np.asarray(depth(x), dtype=np.float64)
        return np.stack([a / edges[0], b / edges[1], layer / edges[2]])

    def jacobian(points: FloatArray) -> FloatArray:
        x = np.asarray(points, dtype=np.float64)
        slope = numeric_gradient(depth, x, step)
        rest = [np.broadcast_to(along(frame[:, i], x), x.shape) / edges[i] for i in (0, 1)]
        return np.stack([*rest, slope / edges[2]])

    return CellMap(
        name="conformal",
        coordinates=coordinates,
        jacobian=jacobian,
        size=float(np.prod(edges) ** (1 / 3)),
    )


def layered_map(
    near: Field,
    far: Field,
    layers: int,
    size: float | Sequence[float],
    *,
    normal: Sequence[float],
    origin: Sequence[float] = (0.0, 0.0, 0.0),
) -> CellMap:
    """Map with a whole number of layers between two surfaces, both of which they follow.

    Raises CaseError for an impossible size, direction or number of layers.

    Parameters
    ----------
    near, far : callable
        Points ``(3, ...)`` mm to the distance from either surface ``(...)``, mm, positive between
        them. The third coordinate is ``layers near / (near + far)``.
    size : float or (2,) sequence, mm
        Edges of a cell across ``normal``.
    normal, origin
        As for :func:`conformal_map`.
    """
    count = whole_cells(layers, "between the two surfaces")
    first, second = np.broadcast_to(np.asarray(size, dtype=np.float64), (2,))
    edges = positive_sizes((float(first), float(second), 1.0))
    frame = frame_along(normal)
    start = np.asarray(origin, dtype=np.float64)
    step = _STEP * min(edges[0], edges[1])

    def layer(points: FloatArray) -> FloatArray:
        above = np.asarray(near(points), dtype=np.float64)
        return np.asarray(count * above / (above + far(points)))

    def coordinates(points: FloatArray) -> FloatArray:
        x = np.asarray(points, dtype=np.float64)
        a, b, _ = np.tensordot(frame.T, x - along(start, x), axes=1)
        return np.stack([a / edges[0], b / edges[1], layer(x)])

    def jacobian(points: FloatArray) -> FloatArray:
        x = np.asarray(points, dtype=np.float64)
        rest = [np.broadcast_to(along(frame[:, i], x), x.shape) / edges[i] for i in (0, 1)]
        return np.stack([*rest, numeric_gradient(layer, x, step)])

    return CellMap(
        name="layered",
        coordinates=coordinates,
        jacobian=jacobian,
        size=float(np.sqrt(edges[0] * edges[1])),
    )
