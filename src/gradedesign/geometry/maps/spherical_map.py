"""Cells about a centre: shells cut by meridians and parallels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.errors import CaseError
from gradedesign.geometry.maps.cell_map import CellMap
from gradedesign.geometry.maps.cylindrical_map import about_axis, require_lengths, whole_cells


def spherical_map(
    *,
    around: int,
    pole_to_pole: int,
    radial_size: float,
    inner_radius: float,
    polar_cap: float,
    origin: Sequence[float] = (0.0, 0.0, 0.0),
    axis: Sequence[float] = (0.0, 0.0, 1.0),
) -> CellMap:
    """Map of cells about a centre: u = (radius, angle from the pole, angle about the poles' axis).

    Raises CaseError if a size, an angle or a number of cells is impossible.

    - ``around``: whole number of cells along the equator
    - ``pole_to_pole``: whole number of cells along half a meridian; ``around / 2`` makes square
      cells at the equator
    - ``radial_size``, mm: edge of a cell along the radius
    - ``inner_radius``, mm: a shell of cells begins here, and nearer the centre the map is refused
    - ``polar_cap``, degrees: angle from either pole within which the map is refused: the cells'
      width goes to zero with the sine of it
    - ``origin (3,)``, mm: the centre
    - ``axis (3,)``: from the centre to the pole of angle 0
    """
    turn = whole_cells(around, "around the equator") / (2 * np.pi)
    rise = whole_cells(pole_to_pole, "from pole to pole") / np.pi
    require_lengths("spherical", {"radial size": radial_size, "inner radius": inner_radius})
    if not 0 < polar_cap < 90:
        raise CaseError(
            f"the spherical map's polar cap is {polar_cap:g} degrees; use an angle between 0 and 90"
        )
    frame, local = about_axis(origin, axis)

    def coordinates(points: FloatArray) -> FloatArray:
        a, b, c, across = local(points)
        shell = (np.hypot(across, c) - inner_radius) / radial_size
        return np.stack([shell, rise * np.arctan2(across, c), turn * np.arctan2(b, a)])

    def jacobian(points: FloatArray) -> FloatArray:
        a, b, c, across = local(points)
        # At the centre and the poles directions are arbitrary and derivatives infinite.
        w = np.maximum(across, 1e-300)
        r = np.maximum(np.hypot(across, c), 1e-300)
        cosine, sine = np.where(across > 0, a / w, 1.0), b / w
        up, out = c / r, across / r
        zero = np.zeros_like(r)
        rows = [
            np.stack([out * cosine, out * sine, up]) / radial_size,
            np.stack([up * cosine, up * sine, -out]) * (rise / r),
            np.stack([-sine, cosine, zero]) * (turn / w),
        ]
        return np.stack([np.tensordot(frame, row, axes=1) for row in rows])

    cap = np.radians(polar_cap)

    def singular(points: FloatArray) -> BoolArray:
        _, _, c, across = local(points)
        near = np.hypot(across, c) < inner_radius * (1 - 1e-9)
        return np.asarray(near | (np.arctan2(across, np.abs(c)) < cap * (1 - 1e-9)))

    middle = inner_radius + 0.5 * radial_size
    return CellMap(
        name="spherical",
        coordinates=coordinates,
        jacobian=jacobian,
        size=float((radial_size * (middle / rise) * (middle / turn)) ** (1 / 3)),
        singular=singular,
        singular_name=(
            f"its centre (inner radius {inner_radius:g} mm) and poles (cap {polar_cap:g} degrees)"
        ),
    )
