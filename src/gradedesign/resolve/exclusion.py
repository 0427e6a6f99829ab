"""The exclusion radius, and how much of the lattice it takes out of the stress limit."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from gradedesign.case.schema import Case
from gradedesign.verify.exclusion import ExclusionZone


def exclusion_radius(case: Case) -> float:
    """Radius around clamped regions where stress is not judged, mm."""
    if case.limits.exclusion_radius is not None:
        return case.limits.exclusion_radius
    return (case.limits.exclusion_mesh_sizes or 0.0) * case.part.element_size


def exclusion_data(zone: ExclusionZone) -> dict[str, Any]:
    """Plain data for result.json."""
    data = asdict(zone)
    return {
        "radius_mm": data["radius"],
        "percentile": data["percentile"],
        "share_of_volume": data["share"],
        "stress_everywhere_MPa": data["everywhere"],
        "maximum_everywhere_MPa": data["maximum"],
    }
