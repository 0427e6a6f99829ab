"""A skin: the solid layer below the part's surface, or below some of its faces."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.errors import LatticeError
from gradedesign.geometry.fields.algebra import gradient

#: Steps by which the slope of a varying thickness is taken, mm. Chosen, not measured.
_STEP = 1e-4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Skin:
    """A solid layer below the part's surface.

    Attributes
    ----------
    thickness : float, mm
        The largest, where it varies.
    thinnest : float, optional, mm
        Of a varying thickness.
    varying : callable, optional
        Thickness at points ``(3, ...)``, ``(...)``, mm, between the two.
    faces : callable, optional
        Unsigned distance to the faces that carry it, points ``(3, ...)`` mm to ``(...)`` mm; the
        whole surface carries it without.

    Raises
    ------
    LatticeError
        If a thickness is not positive.
    """

    thickness: float
    thinnest: float | None = None
    varying: Field | None = None
    faces: Field | None = None

    def __post_init__(self) -> None:
        if not 0 < self.least <= self.thickness:
            raise LatticeError(
                f"a skin of {self.least:g} to {self.thickness:g} mm is impossible; skins and "
                f"margins of passive regions must be positive; leave out what is not wanted"
            )

    @property
    def least(self) -> float:
        """Least thickness, mm."""
        return self.thickness if self.thinnest is None else self.thinnest


def skin_thickness(skin: Skin, points: FloatArray) -> FloatArray:
    """Thickness at points ``(3, ...)`` mm, ``(...)``, mm."""
    if skin.varying is None:
        return np.full(np.shape(points)[1:], skin.thickness)
    return np.clip(skin.varying(points), skin.least, skin.thickness)


def skin_value(skin: Skin, points: FloatArray, distance: FloatArray | None) -> FloatArray:
    """Signed distance to the inner face of a skin, mm, negative in the skin and beyond the part.

    Of a varying thickness t to first order in its slope: ``(depth - t) / sqrt(1 + |grad t|^2)``,
    with the depth and the thickness of the point itself.

    Parameters
    ----------
    skin : Skin
    points : (3, ...) array, mm
    distance : (...) array, mm
        Signed distance of the part there, of which a skin on some faces has no need.
    """
    depth = -np.asarray(distance) if skin.faces is None else skin.faces(points)
    if skin.varying is None:
        return np.asarray(depth - skin.thickness)
    flat = np.asarray(points, dtype=np.float64).reshape(3, -1)
    slope = gradient(lambda p: skin_thickness(skin, p), flat, _STEP)
    steep = np.sqrt(1.0 + (slope**2).sum(axis=0)).reshape(np.shape(points)[1:])
    return np.asarray((depth - skin_thickness(skin, points)) / steep)


def thicker(skin: Skin, overhang: float) -> Skin:
    """The skin of a part whose faces have moved outward by ``overhang`` mm, inner face in place.

    A skin on some faces is measured from those as they were.
    """
    if skin.faces is not None:
        return skin
    varying = skin.varying
    return replace(
        skin,
        thickness=skin.thickness + overhang,
        thinnest=skin.least + overhang,
        varying=None if varying is None else lambda points: varying(points) + overhang,
    )
