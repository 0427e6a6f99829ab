"""Solid members: places of the part that sizing makes solid."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.geometry.contour.islands import without_crumbs
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.lattice.component import MEMBER, SolidComponent, less
from gradedesign.geometry.lattice.density_grid import DensityGrid, evaluate
from gradedesign.geometry.part.signed_distance import surface_distance

#: Value of the filtered field at the surface of members.
_HALF = 0.5
#: Share of the volume of a ball of the least thickness below which a solid, or a void in one, is a
#: crumb: nothing that is filtered and as thick as stated is as small. Chosen, not measured.
_CRUMB = 0.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Members(SolidComponent):
    """Solid members among the cells."""

    #: Signed distance to their surface, negative inside, which goes on beyond the part's faces.
    to_surface: Field
    thickness: float  #: mm. Of the thinnest one that may be.
    count: int  #: Separate members.

    phase: ClassVar[int] = MEMBER
    listed: ClassVar[str] = "solid_members"

    @property
    def least(self) -> float:
        """Of the thinnest member that may be, mm."""
        return self.thickness

    @property
    def facts(self) -> Mapping[str, Any]:
        """Their number and least thickness."""
        return {"count": self.count, "least_thickness_mm": self.thickness}

    def distance(self, points: FloatArray, to_part: FloatArray | None) -> FloatArray:  # noqa: ARG002
        """Distance to their surface."""
        return self.to_surface(points)


def solid_members(field: DensityGrid, thickness: float, offset: float = 0.0) -> Members | None:
    """Members where a filtered field exceeds a half, without crumbs; None where it does nowhere.

    ``field``: smooth over about the thickness. ``thickness``, mm: of the thinnest member.
    ``offset``, mm: by which their surface is moved outward.
    """
    # The solid is cut at the box, beyond the part: half a step inside the outer nodes.
    lower = field.origin + 0.5 * field.spacing
    upper = lower + (np.array(field.values.shape) - 2) * field.spacing
    if not (field.values > _HALF).any():
        return None

    def beyond(points: FloatArray) -> FloatArray:
        return (_HALF - evaluate(field, points)) * thickness

    surface = extract_surface(beyond, lower, upper, field.spacing)
    surface, count = without_crumbs(surface, _CRUMB * np.pi / 6.0 * thickness**3)
    if not count:
        return None
    return Members(
        name="solid members",
        where="lattice.phases",
        to_surface=less(surface_distance(surface), offset),
        thickness=thickness,
        count=count,
        box=(surface.vertices.min(axis=0) - offset, surface.vertices.max(axis=0) + offset),
    )
