"""A rib: a solid plate along a plane through the part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from gradedesign.arrays import FloatArray, lock
from gradedesign.common.values.value_types import Size
from gradedesign.errors import CaseError
from gradedesign.geometry.cell.shape import spread_points
from gradedesign.geometry.lattice.component import InnerPlane, Slab, SolidComponent
from gradedesign.geometry.lattice.component_kind import (
    ComponentEntry,
    ComponentKind,
    ComponentPlace,
    Made,
)
from gradedesign.geometry.part.place_words import plane_of
from gradedesign.geometry.part.regions_schema import AnyPlane

#: Points of a rib at which its place in the part is looked for: its volume is then right to about
#: 1 %.
_POINTS = 20_000
#: Share of its thickness in the part from which a rib counts as whole: faces of the part that it
#: meets at an angle take as much as they give. Chosen, not measured.
_WHOLE = 0.95
#: A thickness that the printer just makes may come out a rounding error less.
_ROUNDING = 1e-9


class RibEntry(ComponentEntry):
    """A solid plate along a plane through the part."""

    plane: AnyPlane = Field(examples=["x = 12 mm"])
    """Its middle plane."""
    thickness: Size = Field(examples=["2 mm"])
    """Thickness of the plate, half of it on either side of the plane, mm."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rib(SolidComponent):
    """A solid plate along a plane."""

    point: FloatArray  #: ``(3,)``, mm. Of its middle plane.
    normal: FloatArray  #: ``(3,)``. Unit normal.
    thickness: float  #: mm.
    held: float  #: mm. Of its thickness in the part, on average.
    volume: float  #: mm^3. Of the part that it holds.

    listed: ClassVar[str] = "ribs"

    def __post_init__(self) -> None:
        lock(self, point=(3,), normal=(3,))

    @property
    def least(self) -> float:
        """Its thickness in the part, mm."""
        return self.held

    @property
    def slab(self) -> Slab:
        """Its two faces."""
        middle = float(self.normal @ self.point)
        return Slab(self.normal, middle - 0.5 * self.thickness, middle + 0.5 * self.thickness)

    @property
    def facts(self) -> Mapping[str, Any]:
        """Its plane, its thickness and the volume that it holds."""
        return {
            "name": self.name.strip("'"),
            "point_mm": self.point.tolist(),
            "normal": self.normal.tolist(),
            "thickness_mm": self.thickness,
            "volume_mm3": self.volume,
        }

    def distance(self, points: FloatArray, to_part: FloatArray | None) -> FloatArray:  # noqa: ARG002
        """Distance to the plate."""
        off = np.tensordot(self.normal, points, axes=1) - self.normal @ self.point
        return np.asarray(np.abs(off) - 0.5 * self.thickness)


def _make(place: ComponentPlace) -> Made:
    """Ribs in the order of the case.

    Raises CaseError if a plane passes the part by, or a rib is thinner than the printer makes.
    """
    stated: Sequence[RibEntry] = getattr(place.lattice, KIND.name)
    ribs = [_rib(place, entry, f"lattice.rib[{k}]", k + 1) for k, entry in enumerate(stated)]
    return ribs, [
        f"{rib.where}: on average {rib.held:.3g} mm of its thickness of {rib.thickness:g} mm lie "
        f"in the part; move its plane farther into the part for a whole rib"
        for rib in ribs
        if rib.held < rib.thickness
    ]


def _rib(place: ComponentPlace, entry: RibEntry, key: str, number: int) -> Rib:
    thickness, vertices = entry.thickness, place.part.surface.vertices
    if thickness < place.min_wall * (1 - _ROUNDING):
        raise CaseError(
            f"{place.where(f'{key}.thickness')}: found {thickness:g} mm, less than the "
            f"{place.min_wall:g} mm of [print] min_wall that the printer makes; expected a rib of "
            f"{place.min_wall:g} mm at least"
        )
    lower, upper = vertices.min(axis=0), vertices.max(axis=0)
    point, normal, words = plane_of(entry.plane, lower, upper)
    across = np.linalg.svd(normal[None])[2][1:]
    along = across @ (vertices - point).T
    low, edges = along.min(axis=1)[:, None], np.ptp(along, axis=1)[:, None]
    spread = spread_points(_POINTS)
    middle = point[:, None] + across.T @ (low + edges * spread[:2])
    section = float((place.distance(middle) < 0).mean())
    if not section:
        raise CaseError(
            f"{place.where(f'{key}.plane')}: the {words} does not pass through the part, which "
            f"lies between ({', '.join(f'{v:.4g}' for v in lower)}) and "
            f"({', '.join(f'{v:.4g}' for v in upper)}) mm; expected one that cuts it; is its unit "
            f"right?"
        )
    through = middle + (spread[2] - 0.5) * thickness * normal[:, None]
    inside = float((place.distance(through) < 0).mean())
    held = thickness if inside >= _WHOLE * section else thickness * inside / section
    if held < place.min_wall * (1 - _ROUNDING):
        raise CaseError(
            f"{place.where(f'{key}.plane')}: on average {held:.3g} mm of a rib of {thickness:g} mm "
            f"on the {words} lie in the part, less than the {place.min_wall:g} mm of [print] "
            f"min_wall; expected a plane farther inside"
        )
    area = float(edges.prod())
    axis = int(np.argmax(np.abs(normal)))
    planes: tuple[InnerPlane, ...] = ()
    if abs(normal[axis]) > 1 - _ROUNDING:
        ends = point[axis] - 0.5 * thickness, point[axis] + 0.5 * thickness
        planes = tuple(
            InnerPlane(axis=axis, place=float(end), area=area * section)
            for end in ends
            if lower[axis] < end < upper[axis]
        )
        lower[axis], upper[axis] = max(ends[0], lower[axis]), min(ends[1], upper[axis])
    return Rib(
        name=f"'{entry.name}'" if entry.name is not None else f"rib {number}",
        where=place.where(key),
        box=(lower, upper),
        planes=planes,
        point=point,
        normal=normal,
        thickness=thickness,
        held=held,
        volume=area * thickness * inside,
    )


#: Plates along planes, the tables ``[[lattice.rib]]``.
KIND = ComponentKind(name="rib", stage="solid", make=_make, entry=RibEntry)
