"""A skin: the solid layer below the part's surface, or below some of its faces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.values.formula import Formula, evaluate_formula, parse_formula
from gradedesign.errors import CaseError, LatticeError
from gradedesign.geometry.fields.algebra import gradient
from gradedesign.geometry.lattice.component import SKIN, Distances, SolidComponent, SolidLayer, less
from gradedesign.geometry.lattice.component_kind import ComponentKind, ComponentPlace, Made
from gradedesign.geometry.lattice.skin_schema import PLACE, SkinSpec
from gradedesign.geometry.part.place import distance_to_faces, face_places

#: Steps by which the slope of a varying thickness is taken, mm. Chosen, not measured.
_STEP = 1e-4
#: Rounding of a formula that states its bounds itself, as clamp does.
_ROUNDING = 1e-9
#: Share of its faces below which a skin may fill the part without a word. Chosen, not measured.
_LITTLE = 0.005


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Skin(SolidComponent):
    """A solid layer below the part's surface.

    Raises `LatticeError` if a thickness is not positive.
    """

    thickness: float  #: mm. The largest, where it varies.
    thinnest: float | None = None  #: mm. Of a varying thickness.
    #: Thickness at points ``(3, ...)``, ``(...)``, mm, between the two.
    varying: Field | None = None
    #: Unsigned distance to the faces that carry it, points ``(3, ...)`` mm to ``(...)`` mm; the
    #: whole surface carries it without.
    faces: Field | None = None
    regions: tuple[str, ...] = ()  #: Names of these faces.

    phase: ClassVar[int] = SKIN
    closes: ClassVar[bool] = True
    ties_faces: ClassVar[bool] = True

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

    @property
    def thickest(self) -> float:
        """Its largest thickness, mm."""
        return self.thickness

    @property
    def part_depth(self) -> float:
        """Its largest thickness where the whole surface carries it."""
        return self.thickness if self.faces is None else 0.0

    @property
    def all_round(self) -> bool:
        """Whether the whole surface carries it."""
        return self.faces is None

    def covers(self, region: str) -> bool:
        """Whether a region carries it."""
        return not self.regions or region in self.regions

    def thickness_at(self, points: FloatArray) -> FloatArray:
        """Thickness at points ``(3, ...)`` mm, ``(...)``, mm."""
        if self.varying is None:
            return np.full(np.shape(points)[1:], self.thickness)
        return np.clip(self.varying(points), self.least, self.thickness)

    def distance(self, points: FloatArray, to_part: FloatArray | None) -> FloatArray:
        """Signed distance to its inner face, mm, negative in the skin and beyond the part.

        Of a varying thickness t to first order in its slope, with the depth and the thickness of
        the point itself: ``(depth - t) / sqrt(1 + |grad t|^2)``.
        """
        depth = -np.asarray(to_part) if self.faces is None else self.faces(points)
        if self.varying is None:
            return np.asarray(depth - self.thickness)
        flat = np.asarray(points, dtype=np.float64).reshape(3, -1)
        slope = gradient(self.thickness_at, flat, _STEP)
        steep = np.sqrt(1.0 + (slope**2).sum(axis=0)).reshape(np.shape(points)[1:])
        return np.asarray((depth - self.thickness_at(points)) / steep)

    def layer(self, near: Distances) -> SolidLayer:
        """From the part's banded distance, or that of its faces."""
        if self.faces is None:
            part = near.part
            return lambda points, to_part: self.distance(
                points, part(points) if to_part is None else to_part
            )
        if np.isinf(near.reach):
            return self.distance
        # Bounds of the distance to the faces become bounds of that to the inner face.
        spread = self.thickness - self.least
        inner = near.banded(less(self.faces, self.thickness), near.reach + spread, near.reach)
        return replace(self, faces=less(inner, -self.thickness)).distance

    def grown(self, overhang: float) -> Self:
        """Its inner face stays in place; on some faces it is measured from those as they were."""
        if self.faces is not None:
            return self
        varying = self.varying
        return replace(
            self,
            thickness=self.thickness + overhang,
            thinnest=self.least + overhang,
            varying=None if varying is None else lambda points: varying(points) + overhang,
        )

    def why_full(self, inside: FloatArray, to_part: FloatArray) -> str:  # noqa: ARG002
        """Of one all round: no place of the part lies deeper than it is thick."""
        depth = float(-to_part.min())
        if self.faces is not None or self.least < depth:
            return ""
        return (
            f"{self.where}: found {self.least:g} mm, but no place of the part lies deeper than "
            f"{depth:.4g} mm, so all of it would be skin; expected less"
        )


def _make(place: ComponentPlace) -> Made:
    """Closed skins of a case.

    Raises CaseError if the formula of a skin leaves the thicknesses that the case states.
    """
    where = place.where("lattice.skin")
    stated = [spec for spec in place.lattice.skin if not spec.net]
    skins = [_made(place, spec, where) for spec in stated]
    notes = [n for spec, s in zip(stated, skins, strict=True) for n in _notes(place, spec, s)]
    if place.lattice.drain is None and any(skin.all_round for skin in skins):
        notes.append(
            f"{where}: a skin on the whole surface closes the cells in: powder or resin cannot "
            f"leave them, and no mass counts it; [lattice] drain opens them, and faces of the skin "
            f"leave the others open"
        )
    return skins, notes


def _made(place: ComponentPlace, spec: SkinSpec, where: str) -> Skin:
    least, most = spec.thickness
    skin = Skin(
        name="the skin",
        where=where,
        thickness=most,
        thinnest=least,
        faces=distance_to_faces(place.part, spec.faces),
        regions=spec.faces,
    )
    stress = place.stress
    if spec.follows is not None:
        if stress is None:
            return replace(skin, thickness=0.5 * (least + most))
        return replace(skin, varying=lambda points: least + (most - least) * stress(points))
    if spec.formula is None:
        return skin
    varying = _thickness(parse_formula(spec.formula, variables=PLACE))
    _require_stated(place, spec, varying, where)
    return replace(skin, varying=varying)


def _thickness(formula: Formula) -> Field:
    def thickness(points: FloatArray) -> FloatArray:
        return evaluate_formula(formula, dict(zip(PLACE, points, strict=True)))

    return thickness


def _require_stated(place: ComponentPlace, spec: SkinSpec, thickness: Field, where: str) -> None:
    """Refuse a formula that leaves the stated thicknesses, on the faces or the depth below."""
    least, most = spec.thickness
    points, inward = face_places(place.part, spec.faces)
    for depth in (0.0, most):
        places = points + depth * inward
        values = thickness(places)
        wrong = ~((values >= least - _ROUNDING * most) & (values <= most * (1 + _ROUNDING)))
        if wrong.any():
            at = int(np.argmax(np.where(wrong, np.abs(values - (least + most) / 2), -1.0)))
            x, y, z = places[:, at]
            raise CaseError(
                f"{where}: the formula {spec.formula!r} gives {values[at]:.4g} mm at ({x:.4g}, "
                f"{y:.4g}, {z:.4g}) mm; expected {least:g} to {most:g} mm, the stated thickness, "
                f"on all its faces and below them; widen it, or write clamp(..., {least:g}, "
                f"{most:g})"
            )


def _notes(place: ComponentPlace, spec: SkinSpec, skin: Skin) -> Iterator[str]:
    """Remarks on a thickness that is not known yet, and on skins that meet across the part."""
    if spec.follows and skin.varying is None:
        yield (
            f"{skin.where}: counts as {skin.thickness:g} mm, the mean of its thickness, until the "
            f"stress of the solid part is known that it follows"
        )
    points, inward = face_places(place.part, spec.faces)
    depth = skin.thickness_at(points) * (1.0 if spec.faces else 2.0)
    share = float((place.distance(points + depth * inward) > 0).mean())
    if share > _LITTLE:
        faces = f"regions {', '.join(spec.faces)}" if spec.faces else "the surface"
        yield (
            f"{skin.where}: the part is no thicker than "
            f"{'the skin' if spec.faces else 'two skins'} of {spec.thickness[1]:g} mm below "
            f"{share:.1%} of {faces}: it is solid throughout there"
        )


#: Solid layers below faces, ``skin = "2 mm"``.
KIND = ComponentKind(name="skin", stage="solid", make=_make)
