"""Passive regions: places of the part that stay solid."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.errors import CaseError, LatticeError
from gradedesign.geometry.lattice.component import (
    Distances,
    InnerPlane,
    SolidComponent,
    SolidLayer,
    less,
)
from gradedesign.geometry.lattice.component_kind import ComponentKind, ComponentPlace, Made
from gradedesign.geometry.part.place import place_box, place_distance
from gradedesign.geometry.part.place_schema import KeepSpec
from gradedesign.geometry.part.regions import Region
from gradedesign.geometry.part.regions_schema import BoxSpec
from gradedesign.geometry.part.signed_distance import region_distance

#: Samples along each edge of a volume's box that measure its thickness in the part; odd, so that
#: one lies in the middle. More of them before a volume is refused.
_SAMPLES = (15, 61)
#: Volumes reach this share of the part's diagonal further, so that they hold faces flush with
#: theirs.
_FLUSH = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PassiveRegion(SolidComponent):
    """A place of the part that stays solid.

    Raises `LatticeError` if the margin is not positive.
    """

    #: Unsigned distance to a region's surface, or that to a volume, negative inside: points
    #: ``(3, ...)`` mm to ``(...)`` mm.
    to_place: Field
    margin: float  #: mm. The part is solid within this distance.
    thickness: float | None = None  #: mm. Of what is solid in the part; the margin without it.
    #: mm. Of a volume, how far the part's faces were moved outward: what lies beyond them before it
    #: belongs to it, so that it ends at the part's faces where it is flush with them.
    from_surface: float | None = None

    def __post_init__(self) -> None:
        if not self.margin > 0:
            raise LatticeError(
                f"margins of passive regions must be positive, got {self.margin:g} mm; leave out "
                f"what is not wanted"
            )

    @property
    def least(self) -> float:
        """How thick it is in the part, mm."""
        return self.margin if self.thickness is None else self.thickness

    def distance(self, points: FloatArray, to_part: FloatArray | None) -> FloatArray:  # noqa: ARG002
        """Distance to its place less the margin."""
        return np.asarray(self.to_place(points) - self.margin)

    def layer(self, near: Distances) -> SolidLayer:
        """Its distance; that of a volume widens beyond the part's faces."""
        start = self.from_surface
        # Beyond the part a volume counts less: exact that much farther.
        beyond = near.reach if start is None else 3 * near.reach + 2 * start
        solid, part = near.banded(less(self.to_place, self.margin), near.reach, beyond), near.part
        if start is None:
            return lambda points, _: solid(points)

        def volume(points: FloatArray, distance: FloatArray | None) -> FloatArray:
            to_part = part(points) if distance is None else distance
            # Where they are flush the distance to the volume is that beyond the face: less than
            # twice.
            return np.asarray(solid(points) - 2.0 * np.maximum(to_part + start, 0.0))

        return volume

    def within(self) -> Self:
        """Of a volume that ends where it is stated to."""
        return replace(self, from_surface=None)

    def grown(self, overhang: float) -> Self:
        """Of a volume, which then widens from where the part's faces were."""
        if self.from_surface is None:
            return self
        return replace(self, from_surface=self.from_surface + overhang)

    def why_full(self, inside: FloatArray, to_part: FloatArray) -> str:
        """At a region: the margin that would leave some of the part."""
        if self.region is None:
            return super(PassiveRegion, self).why_full(inside, to_part)
        reach = float(np.asarray(self.to_place(inside)).max())
        if reach > self.margin:
            return ""
        return (
            f"{self.where}: found {self.margin:g} mm, but no place of the part is farther than "
            f"{reach:.4g} mm from region '{self.region}', so all of it would stay solid; expected "
            f"less, such as {0.2 * reach:.2g} mm"
        )


def _make(place: ComponentPlace) -> Made:
    """Passive regions in the order of the case.

    Raises CaseError if no place of the part lies in a volume.
    """
    return [_passive(place, number) for number in range(len(place.keep))], ()


def _words(spec: KeepSpec, number: int) -> str:
    """A passive region for people to read."""
    if spec.region is not None:
        return f"region '{spec.region}'"
    return f"'{spec.name}'" if spec.name is not None else f"{spec.volume_key} {number + 1}"


def _passive(place: ComponentPlace, number: int) -> PassiveRegion:
    spec, part, where = place.keep[number], place.part, place.where
    margin = spec.margin or 0.0
    name, least = _words(spec, number), part.surface.vertices.min(axis=0)
    most = part.surface.vertices.max(axis=0)
    if spec.region is not None:
        region = part.regions[spec.region]
        places = region.corners.reshape(-1, 3)
        return PassiveRegion(
            name=name,
            where=where(f"keep[{number}].margin"),
            region=spec.region,
            box=_clipped(places.min(axis=0), places.max(axis=0), margin, least, most),
            planes=_below(region, margin),
            to_place=region_distance(region.corners),
            margin=margin,
        )
    stated = where(f"keep[{number}].{spec.volume_key}")
    volume, grown = place_distance(part, spec), margin + _FLUSH * part.diagonal
    lower, upper = _clipped(*place_box(part, spec), grown, least, most)
    for count in _SAMPLES if (lower < upper).all() else ():
        shares = (np.indices((count, count, count)).reshape(3, -1) + 0.5) / count
        points = lower[:, None] + shares * (upper - lower)[:, None]
        depth = -np.maximum(volume(points) - grown, place.distance(points))
        if depth.max() > 0:
            # As thick as the largest ball that fits is wide: that of a box, a cylinder, a slab.
            return PassiveRegion(
                name=name,
                where=stated,
                box=(lower, upper),
                planes=() if spec.box is None else _faces(spec.box, margin, least, most),
                to_place=volume,
                margin=grown,
                thickness=2.0 * float(depth.max()),
                from_surface=0.0,
            )
    raise CaseError(
        f"{stated}: no place of the part was found in it; the part lies between "
        f"({', '.join(f'{v:.4g}' for v in least)}) and "
        f"({', '.join(f'{v:.4g}' for v in most)}) mm; is its unit right?"
    )


def _clipped(
    lower: FloatArray, upper: FloatArray, margin: float, least: FloatArray, most: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """A box grown by a margin, within that of the part."""
    return np.maximum(lower - margin, least), np.minimum(upper + margin, most)


def _below(region: Region, margin: float) -> tuple[InnerPlane, ...]:
    """The inner face of what is solid below a plane region across an axis."""
    corners = region.corners.reshape(-1, 3)
    axis = int(np.argmin(np.ptp(corners, axis=0)))
    if np.ptp(corners[:, axis]) > 1e-9 * np.ptp(corners, axis=0).max():
        return ()
    inward = -np.sign(np.cross(*(region.corners[0, 1:] - region.corners[0, 0]))[axis])
    place = float(corners[0, axis] + inward * margin)
    return (InnerPlane(axis=axis, place=place, area=region.area),)


def _faces(
    box: BoxSpec, margin: float, least: FloatArray, most: FloatArray
) -> tuple[InnerPlane, ...]:
    """Faces of a box that lie inside the part's."""
    low, high = _clipped(np.array(box.lower), np.array(box.upper), margin, least, most)
    edges = high - low
    return tuple(
        InnerPlane(axis=axis, place=float(ends[axis]), area=float(np.delete(edges, axis).prod()))
        for axis in range(3)
        for ends, outer in ((low, least), (high, most))
        if ends[axis] != outer[axis]
    )


#: Places that stay solid, the tables ``[[keep]]``.
KIND = ComponentKind(name="keep", stage="solid", make=_make)
