"""Stress of the fully solid part: percentile, largest value and band from a recovered field."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.explicit.support_zones import SupportZone, evaluated_at
from gradedesign.mechanics.fe.load_case import PartLoadCase
from gradedesign.mechanics.fe.recovered_stress import RecoveredStress, recovered_stress
from gradedesign.mechanics.fe.solution import Solution
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.fe.stiffness import dense_stiffness
from gradedesign.mechanics.fe.stress_percentile import (
    StressPercentile,
    judged_shares,
    stress_percentile,
)
from gradedesign.mechanics.limits.banded import Banded
from gradedesign.mechanics.material.material import Material

#: Half the band over the mean difference between the stress of the elements and the recovered one.
#: Pairs of resolutions with a ratio of 1.5, on six bodies with known stress and from 2 to 12
#: elements across, missed 0.68 of it at most; times 1.25, as `banded.SAFETY`.
_OF_DEVIATION = 0.85
#: Half the band over the value at least: the displacements behind it are right to half a per cent.
#: Chosen, not measured.
LEAST = 0.005
#: Change of stress over that of the volume that the mesh lacks or adds: in bending it goes with the
#: square of a thickness, to which a volume is proportional.
_OF_VOLUME = 2.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SolidStress:
    """Stress measure of the fully solid part, MPa."""

    value: float  #: Volume percentile that is judged.
    maximum: float  #: Largest value where stress is judged.
    band: Banded
    phase: str = "solid part"
    maximum_place: tuple[float, float, float] | None = None  #: Not looked for.


def solid_field(
    space: TetSpace, material: Material, load: PartLoadCase, solution: Solution
) -> RecoveredStress:
    """Stress of the fully solid part in one load case, recovered to its surface."""
    return recovered_stress(
        space,
        dense_stiffness(space, material),
        solution.displacement,
        thermal_strain=material.thermal_expansion * load.temperature_change,
    )


def solid_shares(space: TetSpace, zones: Sequence[SupportZone]) -> FloatArray:
    """Share of every eighth of a tetrahedron whose stress is judged, ``(8, M)``."""
    return judged_shares(space, lambda points: evaluated_at(points, zones))


def solid_stress(
    field: RecoveredStress, shares: FloatArray, percentile: float, missing: float, size: float
) -> SolidStress | None:
    """Stress measure of the fully solid part in one load case; None where nothing is judged.

    ``shares`` are those of `solid_shares`; ``missing`` and ``size`` as for `_stress_band`.
    """
    found = stress_percentile(field, shares, percentile)
    if found is None:
        return None
    return SolidStress(
        value=found.value, maximum=found.largest, band=_stress_band(found, missing, size)
    )


def _stress_band(found: StressPercentile, missing: float, size: float) -> Banded:
    """Where a stress is expected for ever smaller elements of the part itself.

    ``missing``: share of the part's volume by which that of the mesh differs; ``size``, float, mm:
    of the elements.
    """
    half = max(LEAST * found.value, _OF_DEVIATION * found.deviation)
    half += _OF_VOLUME * abs(missing) * found.value
    return Banded(
        value=found.value,
        low=max(found.value - half, 0.0),
        high=found.value + half,
        sizes_mm=(size,),
        order="recovered",
    )
