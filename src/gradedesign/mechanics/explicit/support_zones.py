"""Zones around supports in which stress is not judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, Field, FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SupportZone:
    """Neighbourhood of a support that makes stress singular."""

    region: str  #: That is held.
    #: ``(k, 3 corners, 3 coordinates)``, mm. Triangles of its singular faces or lines.
    corners: FloatArray
    distance: Field  #: Distance to them, points ``(3, ...)`` mm to ``(...)`` mm.
    radius: float  #: mm. Up to which stress is not judged.
    #: mm. Up to which the singularity reaches, `radius` at most: beyond it stress above yield is
    #: always told.
    disturbed: float
    whole: bool = True  #: Around faces, and not around lines of their border alone.

    @property
    def place(self) -> str:
        """The faces or lines in words."""
        return self.region if self.whole else f"the border of {self.region}"


def evaluated_at(points: FloatArray, zones: Sequence[SupportZone]) -> BoolArray:
    """Points outside every zone, where stress is judged, ``(...)``."""
    kept = np.ones(points.shape[1:], dtype=bool)
    for zone in zones:
        kept &= zone.distance(points) > zone.radius
    return kept


def undisturbed_at(points: FloatArray, zones: Sequence[SupportZone]) -> BoolArray:
    """Points that no singularity of a support reaches, ``(...)``."""
    kept = np.ones(points.shape[1:], dtype=bool)
    for zone in zones:
        kept &= zone.distance(points) > zone.disturbed
    return kept
