"""Triangles as a file gives them: loose corners with its faces, checked for nonsense only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import BoolArray, FloatArray, lock
from gradedesign.errors import CaseError, PartError
from gradedesign.geometry.part.file_faces import (
    FileBody,
    FileFaces,
    file_body_words,
    require_labels,
)

#: Length of one file unit, mm.
UNIT_MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4, "um": 1e-3, "micron": 1e-3}

#: No printable part reaches this far from the origin, mm.
LARGEST_COORDINATE = 1e7
#: No printable part is smaller than this across, mm.
_SMALLEST_DIAGONAL = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RawTriangles:
    """Unconnected triangles of a part file, in its unit, with its faces and its oddities.

    Attributes
    ----------
    corners : (m, 3 corners, 3 coordinates) array, ``unit``
    unit : str or None
        ``mm``, ``cm``, ``m`` or ``inch``; None where the format carries none and the case says it.
    faces : FileFaces or None
        Face of every triangle, where the format tells faces, bodies or colours apart.
    chord_tolerance : float or None, mm
        Within which the triangles follow the curved faces of a format that has them.
    file_bodies : tuple of FileBody
        Bodies of the file that were subtracted or left out.
    """

    corners: FloatArray
    unit: str | None = None
    faces: FileFaces | None = None
    warnings: tuple[str, ...] = ()
    chord_tolerance: float | None = None
    file_bodies: tuple[FileBody, ...] = ()

    def __post_init__(self) -> None:
        lock(self, corners=(None, 3, 3))


def raw_triangles(
    corners: ArrayLike,
    *,
    source: str,
    unit: str | None = None,
    faces: FileFaces | None = None,
    warnings: Sequence[str] = (),
    chord_tolerance: float | None = None,
    file_bodies: Sequence[FileBody] = (),
) -> RawTriangles:
    """Triangles that a reader returns, refused where none of them can be a part.

    Parameters
    ----------
    corners : (m, 3, 3) array_like, file units
    source : str
        Name of the file, for messages.
    unit : str, optional
        Of the file, where the format carries one.
    faces : FileFaces, optional
        Of the file, where the format has them.
    warnings : sequence of str
        Passed on.
    chord_tolerance : float, mm, optional
        Passed on.
    file_bodies : sequence of FileBody
        Passed on, and named in the warnings.

    Raises
    ------
    PartError
        If there are no triangles, or some are not finite.

    Examples
    --------
    >>> raw_triangles([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], source="one.xyz").corners.shape
    (1, 3, 3)
    """
    values = np.asarray(corners, dtype=np.float64)
    if len(values) == 0:
        raise PartError(f"{source}: no triangles in the file; export the part again as a solid")
    require_finite(values, source=source)
    return RawTriangles(
        corners=values,
        unit=unit,
        faces=faces,
        warnings=(*(f"{source}: {words}" for words in file_body_words(file_bodies)), *warnings),
        chord_tolerance=chord_tolerance,
        file_bodies=tuple(file_bodies),
    )


def in_mm(raw: RawTriangles, unit: str, source: str) -> RawTriangles:
    """Triangles scaled from a unit to mm, checked whoever wrote their reader.

    Raises CaseError if the unit is unknown. Raises PartError if there are no triangles, their range
    is absurd, or their faces do not belong to them.

    ``raw``: its own unit is not looked at. ``unit``: a key of `UNIT_MM`. ``source``: name of the
    file, for messages.
    """
    if unit not in UNIT_MM:
        raise CaseError(f"unit {unit!r} of {source} is unknown; use one of {', '.join(UNIT_MM)}")
    if len(raw.corners) == 0:
        raise PartError(f"{source}: no triangles in the file; export the part again as a solid")
    require_labels(raw.faces, len(raw.corners), source)
    scaled = raw.corners * UNIT_MM[unit]
    _require_sane_range(scaled, unit, source)
    faces = None if raw.faces is None else raw.faces.scaled(UNIT_MM[unit])
    return replace(raw, corners=scaled, unit="mm", faces=faces)


def require_finite(corners: FloatArray, *, source: str) -> None:
    """Refuse NaN and infinity, naming the facets (counted from 0)."""
    bad = np.asarray(~np.isfinite(corners.reshape(-1, 9)).all(axis=1))
    if bad.any():
        raise PartError(
            f"{source}: {np.count_nonzero(bad)} of {len(corners)} facets hold NaN or infinite "
            f"coordinates: {_facet_list(bad)}; export the part again"
        )


def _require_sane_range(corners: FloatArray, unit: str, source: str) -> None:
    """Refuse coordinates that no part can have; ``corners`` in mm."""
    far = np.asarray((np.abs(corners.reshape(-1, 9)) > LARGEST_COORDINATE).any(axis=1))
    if far.any():
        raise PartError(
            f"{source}: {np.count_nonzero(far)} of {len(corners)} facets reach absurdly far, up to "
            f"{np.abs(corners).max():.4g} mm from the origin (limit {LARGEST_COORDINATE:.0e} mm): "
            f"{_facet_list(far)}; the file is damaged, or its unit is not {unit!r}"
        )
    flat = corners.reshape(-1, 3)
    diagonal = float(np.linalg.norm(flat.max(axis=0) - flat.min(axis=0)))
    if diagonal < _SMALLEST_DIAGONAL:
        raise PartError(
            f"{source}: the part is absurdly small, {diagonal:.3g} mm across "
            f"(limit {_SMALLEST_DIAGONAL:g} mm); check whether its unit is {unit!r}"
        )


def _facet_list(mask: BoolArray, most: int = 8) -> str:
    """Name the facets of a mask, the first few of them."""
    numbers = np.flatnonzero(mask)
    names = ", ".join(str(k) for k in numbers[:most])
    return f"facets {names}" + (f" and {len(numbers) - most} more" if len(numbers) > most else "")
