"""Layers of cells that follow a surface of the part."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.errors import CaseError
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
    reference: Sequence[float] | None = None,
    origin: Sequence[float] = (0.0, 0.0, 0.0),
    blend: tuple[float, float] | None = None,
) -> CellMap:
    """Map whose third coordinate counts layers from a surface.

    Parameters
    ----------
    depth : callable
        Points ``(3, ...)`` mm to the distance from the surface ``(...)``, mm, growing into the
        part: the negative of :func:`gradedesign.geometry.part.signed_distance.surface_distance`, or
        :func:`~gradedesign.geometry.part.signed_distance.region_distance` of one face.
    size : float or (3,) sequence, mm
        Edges of a cell; the third is the thickness of a layer.
    normal : (3,) sequence
        Mean direction into the part. The other two coordinates are those of the plane across it,
        so cells shear by the angle between it and the surface's own normal, and fold at 90
        degrees.
    reference : (3,) sequence, optional
        Direction of the first cell axis, see
        :func:`gradedesign.geometry.maps.cell_map.frame_along`.
    origin : (3,) sequence, mm
        A corner of a cell in the plane; with ``blend`` it must lie on the surface.
    blend : (float, float), optional, mm
        Depths between which layers that follow the surface pass smoothly into plane ones.

    Returns
    -------
    CellMap
        Differentiable where ``depth`` is: not where two places of the surface are equally near.

    Raises
    ------
    CaseError
        For an impossible size, direction or blend.
    """
    edges = positive_sizes(size)
    if blend is not None and not 0 <= blend[0] < blend[1] < np.inf:
        raise CaseError(
            f"conformal layers pass into plane ones between depths of {blend[0]:g} and "
            f"{blend[1]:g} mm; expected 0 <= first < second"
        )
    frame = frame_along(normal, reference)
    start = np.asarray(origin, dtype=np.float64)
    step = _STEP * edges[2]

    def coordinates(points: FloatArray) -> FloatArray:
        x = np.asarray(points, dtype=np.float64)
        a, b, plane = np.tensordot(frame.T, x - along(start, x), axes=1)
        layer = np.asarray(depth(x), dtype=np.float64)
        if blend is not None:
            layer = layer + _smooth_step(layer, blend)[0] * (plane - layer)
        return np.stack([a / edges[0], b / edges[1], layer / edges[2]])

    def jacobian(points: FloatArray) -> FloatArray:
        x = np.asarray(points, dtype=np.float64)
        slope = numeric_gradient(depth, x, step)
        if blend is not None:
            layer = np.asarray(depth(x), dtype=np.float64)
            plane = np.tensordot(frame[:, 2], x - along(start, x), axes=1)
            share, rate = _smooth_step(layer, blend)
            slope = slope * (1 - share + rate * (plane - layer)) + share * along(frame[:, 2], x)
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
    reference: Sequence[float] | None = None,
    origin: Sequence[float] = (0.0, 0.0, 0.0),
) -> CellMap:
    """Map with a whole number of layers between two surfaces, both of which they follow.

    Parameters
    ----------
    near, far : callable
        Points ``(3, ...)`` mm to the distance from either surface ``(...)``, mm, positive between
        them. The third coordinate is ``layers near / (near + far)``.
    size : float or (2,) sequence, mm
        Edges of a cell across ``normal``.
    normal, reference, origin
        As for :func:`conformal_map`.

    Raises
    ------
    CaseError
        For an impossible size, direction or number of layers.
    """
    count = whole_cells(layers, "between the two surfaces")
    first, second = np.broadcast_to(np.asarray(size, dtype=np.float64), (2,))
    edges = positive_sizes((float(first), float(second), 1.0))
    frame = frame_along(normal, reference)
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


def _smooth_step(value: FloatArray, ends: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """From 0 at the first end to 1 at the second with continuous slope; value and derivative."""
    span = ends[1] - ends[0]
    s = np.clip((value - ends[0]) / span, 0.0, 1.0)
    return s * s * (3 - 2 * s), 6 * s * (1 - s) / span
