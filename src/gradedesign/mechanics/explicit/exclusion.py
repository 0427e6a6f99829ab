"""Volume and stress that the zones around supports leave unjudged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.mechanics.explicit.measures import PHASES, shared_volumes
from gradedesign.mechanics.explicit.support_zones import SupportZone
from gradedesign.mechanics.fe.stress import weighted_percentile


@dataclass(frozen=True, slots=True, kw_only=True)
class ExclusionZone:
    """Volume outside the evaluation mask, and the stress with and without it."""

    #: Places that are left out, such as ``"root"`` or ``"the border of cut"``, with the radius
    #: around each, mm.
    supports: tuple[tuple[str, float], ...]
    percentile: float  #: Of the volume, per cent.
    #: By phase. Share of the phase's volume within the radius; phases that the solid has.
    share: dict[str, float] = field(default_factory=dict)
    #: By load case, by phase, MPa. Stress that in the whole phase as much volume exceeds as exceeds
    #: the judged one outside, so that it is never below that; the percentile itself of a phase that
    #: lies within.
    everywhere: dict[str, dict[str, float]] = field(default_factory=dict)
    #: By load case, by phase, MPa. Largest value in the whole phase.
    maximum: dict[str, dict[str, float]] = field(default_factory=dict)


def exclusion_zone(
    volumes: FloatArray,
    von_mises: Mapping[str, FloatArray],
    phase: IntArray,
    evaluated: BoolArray,
    *,
    zones: Sequence[SupportZone],
    percentile: float,
) -> ExclusionZone:
    """Measure the volume and stress that an exclusion radius leaves out.

    - ``volumes (M,)``, mm^3
    - ``von_mises``: by load case, each ``(M, q)``, MPa; each value stands for a q-th of the point's
      volume
    - ``phase (M,)``: index into `measures.PHASES`
    - ``evaluated (M,)``: outside the zones
    - ``percentile``: of the volume, per cent
    """
    present = {name: phase == number for number, name in enumerate(PHASES)}
    present = {name: chosen for name, chosen in present.items() if chosen.any()}
    shares = {
        name: float(1.0 - volumes[chosen & evaluated].sum() / volumes[chosen].sum())
        for name, chosen in present.items()
    }
    # The whole phase is larger than the judged part of it: the same volume is a smaller share.
    percentiles = {
        name: 100.0 - (100.0 - percentile) * (1.0 - share if share < 1.0 else 1.0)
        for name, share in shares.items()
    }
    return ExclusionZone(
        supports=tuple((zone.place, zone.radius) for zone in zones if zone.radius > 0),
        percentile=percentile,
        share=shares,
        everywhere={
            case: {
                name: weighted_percentile(
                    stress[chosen].ravel(),
                    shared_volumes(volumes[chosen], stress),
                    percentiles[name],
                )
                for name, chosen in present.items()
            }
            for case, stress in von_mises.items()
        },
        maximum={
            case: {name: float(stress[chosen].max()) for name, chosen in present.items()}
            for case, stress in von_mises.items()
        },
    )
