"""A load on a region: its resultant on the solid part, and the traction of a pin in a bore."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeAlias

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.geometry.part.regions import Region
from gradedesign.mechanics.fe.bearing import bearing_traction, loaded_bore
from gradedesign.mechanics.fe.facet_quadrature import facet_points, facet_weights

Triple: TypeAlias = tuple[float, float, float]


class RegionLoad(Protocol):
    """A loaded region; what is given acts together."""

    @property
    def region(self) -> str:
        """Name."""

    @property
    def force(self) -> Triple | None:
        """Total, N."""

    @property
    def moment(self) -> Triple | None:
        """About the centroid of the region, N mm."""

    @property
    def pressure(self) -> float | None:
        """Along the inward normal, MPa."""

    @property
    def point(self) -> Triple | None:
        """Where the force acts, mm; None for the centroid of the region."""

    @property
    def bearing(self) -> Triple | None:
        """Of a pin on the bore that the region is, N."""


def region_resultant(region: Region, spec: RegionLoad) -> tuple[FloatArray, FloatArray]:
    """Force (N) and moment about the region's centroid (N mm) of a load on the solid part."""
    force = np.zeros(3)
    moment = np.zeros(3)
    if spec.force is not None:
        force += spec.force
        if spec.point is not None:
            moment += np.cross(spec.point - region.centroid, spec.force)
    if spec.moment is not None:
        moment += spec.moment
    if spec.pressure is not None:
        a, b, c = np.moveaxis(region.corners, 1, 0)
        push = -0.5 * spec.pressure * np.cross(b - a, c - a)
        arms = (a + b + c) / 3.0 - region.centroid
        force += push.sum(axis=0)
        moment += np.cross(arms, push).sum(axis=0)
    if spec.bearing is not None:
        points = facet_points(region.corners.T)
        a, b, c = np.moveaxis(region.corners, 1, 0)
        weights = facet_weights(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))
        push = bearing_field(region, spec.bearing, points, weights)(points) * weights
        force += spec.bearing
        moment += np.cross(points - region.centroid[:, None, None], push, axis=0).sum(axis=(1, 2))
    return force, moment


def bearing_field(
    region: Region, force: Triple, points: FloatArray, area: FloatArray
) -> Callable[[FloatArray], FloatArray]:
    """Traction of a bearing load in N on a body that has points ``(3, ...)`` of a region.

    Raises `CaseError` if the region cannot carry the load, and `SolverError` if the body's points
    cannot.
    """
    load = np.array(force)
    if not load.any():
        return np.zeros_like
    return bearing_traction(loaded_bore(region, load), load, points, area)
