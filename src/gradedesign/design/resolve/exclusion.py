"""Zones around supports in which stress is not judged: their radius, and what they leave out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.values.locate import Where
from gradedesign.errors import CaseError
from gradedesign.geometry.lattice.cell_layout import CellLayout
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.signed_distance import region_distance
from gradedesign.mechanics.explicit.exclusion import ExclusionZone
from gradedesign.mechanics.explicit.support_zones import SupportZone, evaluated_at
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.fe.singular_supports import SingularSupport, singular_supports
from gradedesign.mechanics.limits.limits_schema import LimitsSpec
from gradedesign.mechanics.limits.row import LEAST_JUDGED

#: Default radius over the edge of a cell. Measured on 5 x 2 x 2 cells held at one end, pulled and
#: bent (gyroid sheets of density 0.3, Kelvin struts of 0.1): what the support adds to the stress
#: reaches 0.1 to 0.15 cells, about as far as a wall or strut is thick (docs/decisions/limits.md).
CELLS = 0.25
#: Default radius over the width of a support, the root of its area, at most: what a small support
#: disturbs fades within half its width (Saint-Venant). Chosen, not measured.
_WIDTHS = 0.5
#: Share of the part and of its lattice that the default leaves out at most. Lattice is densest at
#: supports: with nine times the density of the rest a tenth of the place holds half the solid, and
#: `LEAST_JUDGED` of it stays outside.
_MOST_BY_DEFAULT = 0.1


def zones_of_supports(
    load_cases: Sequence[LoadCaseSpec],
    limits: LimitsSpec,
    element_size: float,
    part: Part,
    inside: FloatArray,
    layout: CellLayout,
) -> tuple[SupportZone, ...]:
    """Zones around supports, of the radius that ``[limits]`` states or of the default one.

    ``element_size``, mm: of the part's tetrahedra. ``inside (3, n)``, mm: points that fill the part
    evenly.
    """
    supports = singular_supports(load_cases, part.regions, part.surface)
    distances = [region_distance(support.corners) for support in supports]
    wanted = [_undisturbed_from(support, layout.least) for support in supports]
    share = 1.0
    for points in (inside, layout.points):
        if not supports or not points.shape[1]:
            continue
        reach = [
            distance(points) / radius for distance, radius in zip(distances, wanted, strict=True)
        ]
        reached = np.quantile(np.min(reach, axis=0), _MOST_BY_DEFAULT, method="lower")
        share = min(share, float(reached))
    zones = []
    for support, distance, radius in zip(supports, distances, wanted, strict=True):
        disturbed = share * radius
        judged_from = disturbed
        if limits.exclusion_radius is not None:
            judged_from = limits.exclusion_radius
        elif limits.exclusion_mesh_sizes is not None:
            judged_from = limits.exclusion_mesh_sizes * element_size
        zones.append(
            SupportZone(
                region=support.region,
                corners=support.corners,
                distance=distance,
                radius=judged_from,
                disturbed=min(disturbed, judged_from),
                whole=support.whole,
            )
        )
    return tuple(zones)


def _undisturbed_from(support: SingularSupport, cell: float) -> float:
    """Default radius around a support, mm, before the part bounds it."""
    if not support.whole:
        return CELLS * cell
    return min(CELLS * cell, _WIDTHS * float(np.sqrt(support.area)))


def require_judged(
    zones: Sequence[SupportZone], inside: FloatArray, lattice: FloatArray, where: Where
) -> None:
    """Refuse zones that leave too little of the part or of its lattice to a limit of stress.

    Raises CaseError, naming the share that is left and the largest radius that leaves enough.

    ``inside (3, n)``, ``lattice (3, n)``, mm: points that fill the part, and its lattice, evenly.
    """
    if not zones:
        return
    places = {"the part": inside, "its lattice": lattice}
    for name, points in places.items():
        share = judged_share(zones, points)
        if share >= LEAST_JUDGED:
            continue
        nearest = np.min([zone.distance(points) for zone in zones], axis=0)
        most = float(np.quantile(nearest, 1.0 - LEAST_JUDGED, method="lower"))
        raise CaseError(
            f"{where('limits.exclusion_radius')}: found {zones[0].radius:.4g} mm, which "
            f"leaves {share:.0%} of {name} to the limit of stress, so that it would say nothing of "
            f"the rest; expected {LEAST_JUDGED:.0%} at least: {0.99 * most:.3g} mm at most, or no "
            f"exclusion_radius, then {max(zone.disturbed for zone in zones):.3g} mm"
        )


def judged_share(zones: Sequence[SupportZone], points: FloatArray) -> float:
    """Share of points ``(3, n)`` mm outside the zones; 1 without points."""
    return float(evaluated_at(points, zones).mean()) if points.shape[1] else 1.0


def exclusion_words(zones: Sequence[SupportZone]) -> str:
    """Supports with the radius within which stress is not judged; empty without any."""
    return ", ".join(f"{zone.radius:.3g} mm of {zone.place}" for zone in zones if zone.radius > 0)


def exclusion_data(zone: ExclusionZone, ratio: Mapping[str, float]) -> dict[str, Any]:
    """Plain data for result.json.

    ``ratio``: value of the limit's row over that of the analysis, 1 where none is named: stress
    with the zones included is stated on the basis of the rows.
    """

    def scaled(by_case: Mapping[str, Mapping[str, float]]) -> dict[str, dict[str, float]]:
        return {
            case: {phase: value * ratio.get(phase, 1.0) for phase, value in phases.items()}
            for case, phases in by_case.items()
        }

    return {
        "radius_mm": max((radius for _, radius in zone.supports), default=0.0),
        "around": dict(zone.supports),
        "percentile": zone.percentile,
        "share_of_volume": dict(zone.share),
        "stress_ratio": dict(ratio),
        "stress_everywhere_MPa": scaled(zone.everywhere),
        "maximum_everywhere_MPa": scaled(zone.maximum),
    }
