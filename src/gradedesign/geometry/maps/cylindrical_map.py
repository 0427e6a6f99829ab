"""Cells about an axis: layers, sectors and slices."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.errors import CaseError
from gradedesign.geometry.maps.cell_map import CellMap, along, frame_along


def cylindrical_map(
    *,
    around: int,
    radial_size: float,
    axial_size: float,
    inner_radius: float,
    origin: Sequence[float] = (0.0, 0.0, 0.0),
    axis: Sequence[float] = (0.0, 0.0, 1.0),
) -> CellMap:
    """Map of cells about an axis: u = (radius, angle, height).

    Returns CellMap: its second coordinate jumps by ``around``, a whole number, at half a turn from
    the frame's first axis: invisible to periodic cells. Raises CaseError if a size, the radius or
    the number of cells is impossible.

    - ``around``: whole number of cells in a turn, so that the last joins the first
    - ``radial_size``, ``axial_size``, mm: edges of a cell along the radius and the axis. The third
      edge is ``2 pi r / around``.
    - ``inner_radius``, mm: a layer of cells begins here, and nearer the axis the map is refused:
      cells would become wedges and then nothing
    - ``origin (3,)``, mm: on the axis; a slice of cells begins here
    - ``axis (3,)``
    """
    count = whole_cells(around, "around the axis")
    lengths = {"radial size": radial_size, "axial size": axial_size, "inner radius": inner_radius}
    require_lengths("cylindrical", lengths)
    frame, local = about_axis(origin, axis)
    turn = count / (2 * np.pi)

    def coordinates(points: FloatArray) -> FloatArray:
        a, b, height, radius = local(points)
        layer = (radius - inner_radius) / radial_size
        return np.stack([layer, turn * np.arctan2(b, a), height / axial_size])

    def jacobian(points: FloatArray) -> FloatArray:
        a, b, _, radius = local(points)
        # On the axis itself the direction is arbitrary and the derivative infinite.
        r = np.maximum(radius, 1e-300)
        cosine, sine = np.where(radius > 0, a / r, 1.0), b / r
        zero = np.zeros_like(r)
        rows = [
            np.stack([cosine, sine, zero]) / radial_size,
            np.stack([-sine, cosine, zero]) * (turn / r),
            np.stack([zero, zero, zero + 1.0]) / axial_size,
        ]
        return np.stack([np.tensordot(frame, row, axes=1) for row in rows])

    def singular(points: FloatArray) -> BoolArray:
        return np.asarray(local(points)[3] < inner_radius * (1 - 1e-9))

    middle = 2 * np.pi * (inner_radius + 0.5 * radial_size) / count
    return CellMap(
        name="cylindrical",
        coordinates=coordinates,
        jacobian=jacobian,
        size=float((radial_size * middle * axial_size) ** (1 / 3)),
        singular=singular,
        singular_name=f"its axis, nearer than the inner radius of {inner_radius:g} mm",
    )


def about_axis(
    origin: Sequence[float], axis: Sequence[float]
) -> tuple[FloatArray, Callable[[FloatArray], tuple[FloatArray, ...]]]:
    """Frame along an axis, and a function from points ``(3, ...)`` to coordinates in it, mm.

    The coordinates are two across the axis, that along it, and the distance from it.
    """
    frame = frame_along(axis)
    start = np.asarray(origin, dtype=np.float64)

    def local(points: FloatArray) -> tuple[FloatArray, ...]:
        x = np.asarray(points, dtype=np.float64)
        a, b, height = np.tensordot(frame.T, x - along(start, x), axes=1)
        return a, b, height, np.hypot(a, b)

    return frame, local


def require_lengths(kind: str, lengths: Mapping[str, float]) -> None:
    """Refuse lengths of a kind of map, mm, that are not positive."""
    for name, value in lengths.items():
        if not (np.isfinite(value) and value > 0):
            raise CaseError(f"the {kind} map's {name} is {value:g} mm; use a positive length")


def whole_cells(count: float, where: str) -> int:
    """Check a number of cells that must close on themselves.

    Raises CaseError if it is not a whole number of at least 1.
    """
    if not (np.isfinite(count) and count == round(count) and count >= 1):
        raise CaseError(f"{count:g} cells {where} do not join up; use a whole number of at least 1")
    return round(count)
