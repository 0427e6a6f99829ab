"""How much of the lattice the exclusion radius takes out of the stress limit."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from gradedesign.verify.exclusion import ExclusionZone


def exclusion_data(zone: ExclusionZone) -> dict[str, Any]:
    """Plain data for result.json."""
    data = asdict(zone)
    return {
        "radius_mm": data["radius"],
        "percentile": data["percentile"],
        "share_of_volume": data["share"],
        "stress_everywhere_MPa": data["everywhere"],
    }
