"""How much of the lattice the exclusion radius takes out of the stress limit."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from gradedesign.arrays import BoolArray
from gradedesign.sizing.homogenised_model import HomogenisedModel
from gradedesign.verify.exclusion import ExclusionZone

#: A radius that leaves out more of the lattice's volume than this gives a warning.
MOST_LEFT_OUT = 0.25


def share_left_out(model: HomogenisedModel, considered: BoolArray) -> float:
    """Share of the lattice's region within the radius, by the part's tetrahedra."""
    room = model.lattice_volumes
    total = float(room.sum())
    return float(room[~considered].sum() / total) if total > 0 else 0.0


def exclusion_warnings(
    model: HomogenisedModel, considered: BoolArray, radius: float
) -> tuple[str, ...]:
    """Warn where the stress limit leaves out much of the lattice."""
    return share_warnings(share_left_out(model, considered), radius)


def share_warnings(share: float, radius: float) -> tuple[str, ...]:
    """Warn where a share of the lattice's region is more than `MOST_LEFT_OUT`."""
    if share <= MOST_LEFT_OUT:
        return ()
    return (
        f"the exclusion radius of {radius:.4g} mm around held regions leaves {share:.0%} of the "
        f"latticed region out of the stress limit; the report shows the stress with it, and a "
        f"smaller [limits] exclusion_radius leaves out less",
    )


def exclusion_data(zone: ExclusionZone) -> dict[str, Any]:
    """Plain data for result.json."""
    data = asdict(zone)
    return {
        "radius_mm": data["radius"],
        "percentile": data["percentile"],
        "share_of_volume": data["share"],
        "stress_everywhere_MPa": data["everywhere"],
    }
