"""Check of a case as by ``gradedesign check``: all that needs no law and no mesh."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.design.case.schema import Case
from gradedesign.design.check.predicted_run import PredictedRun, budget_warnings, predicted_run
from gradedesign.design.resolve.exclusion import exclusion_words, judged_share
from gradedesign.design.resolve.plan import Plan, resolve_case
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.resolve_law import resolve_law
from gradedesign.design.resolve.size_effects import periodic_warnings, why_periodic
from gradedesign.design.resolve.symmetry import symmetry_data, symmetry_warnings
from gradedesign.geometry.lattice.part_room import inner_points
from gradedesign.geometry.maps.cell_map import turned_axes
from gradedesign.geometry.part.round_shapes import RoundShapes, round_shapes
from gradedesign.geometry.part.thickness import local_thickness
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.explicit.support_zones import SupportZone
from gradedesign.mechanics.limits.local_stress import allowed_stress, share_warnings

#: Points at which the part's thickness is measured.
_THICKNESS_PLACES = 1500
#: Shares of the part's volume at which its thickness is reported. The ends, the quartiles and the
#: middle of the distribution.
THICKNESS_SHARES = (5, 25, 50, 75, 95)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Thickness:
    """Thickness of the part in cells."""

    shares: tuple[int, ...]  #: %.
    thickness: tuple[float, ...]  #: mm. Below which that share of the volume lies.
    cells: tuple[float, ...]  #: The same over the shortest edge of a cell.


@dataclass(frozen=True, slots=True, kw_only=True)
class Unjudged:
    """Share of the volume whose stress no limit judges."""

    around: str  #: Supports with the radius around each; empty where none makes stress singular.
    part: float  #: Shares of their volumes within these radii.
    lattice: float  #: Shares of their volumes within these radii.
    limited: bool  #: Whether the case limits stress outside them.

    @property
    def words(self) -> str:
        """One sentence."""
        told = (
            "stress: judged"
            if self.limited
            else "stress: no limit judges it; a run warns where it exceeds the yield strength"
        )
        if not self.around:
            return f"{told}, everywhere"
        return (
            f"{told}, but not within {self.around}: {self.part:.1%} of the part's volume, "
            f"{self.lattice:.1%} of the lattice's"
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CaseCheck:
    """Checked case: its plan, and the predicted cost of its run."""

    plan: Plan
    holes: tuple[RoundShapes, ...]
    thickness: Thickness
    run: PredictedRun
    periodic: str  #: Why size effects are left out; empty where the run computes those it finds.
    unjudged: Unjudged
    symmetry: Mapping[str, Any]  #: See `symmetry_data`.
    warnings: tuple[str, ...]


def check_case(case: Case, registry: Registry) -> CaseCheck:
    """Look at a case without computing a law, walls or a mesh.

    Raises `GradeDesignError` as `resolve_case`.
    """
    plan = resolve_case(case, registry)
    case = plan.case
    remarks = [*plan.warnings, *plan.narrowed]
    for zone in plan.stated_zones:
        if zone.law.known is not None:
            remarks += resolve_law(
                zone.lattice,
                case.limits,
                registry,
                zone.cell,
                zone.where,
                poissons_ratio=plan.material.poissons_ratio,
            )[1]
    inside = inner_points(plan.domain)
    axes, least = turned_axes(case.lattice.rotation), plan.layout.least
    thickness = part_thickness(plan.part.surface, axes, inside, least)
    unjudged = Unjudged(
        around=exclusion_words(plan.support_zones),
        part=1.0 - judged_share(plan.support_zones, inside),
        lattice=1.0 - judged_share(plan.support_zones, plan.layout.points),
        limited=allowed_stress(case.limits, plan.material) is not None,
    )
    run = predicted_run(plan, inside.shape[1])
    periodic = why_periodic(
        case,
        plan.law.kind,
        plan.cell,
        run.bounds[0],
        plan.part,
        plan.domain,
        plan.layout,
    )
    remarks += [
        *periodic_warnings(case.lattice, plan.part, plan.layout, periodic),
        *_left_out(plan.support_zones, unjudged),
        *symmetry_warnings(plan.symmetry, plan.domain.solids, plan.cell, plan.layout),
        *budget_warnings(case.run, run),
    ]
    return CaseCheck(
        plan=plan,
        holes=round_shapes(plan.part.surface, plan.part.faces),
        thickness=thickness,
        run=run,
        periodic=periodic,
        unjudged=unjudged,
        symmetry=symmetry_data(plan.symmetry, plan.part.volume * plan.material.density * 1e6),
        warnings=tuple(dict.fromkeys(remarks)),
    )


def part_thickness(
    surface: SurfaceMesh, axes: FloatArray, inside: FloatArray, cell: float
) -> Thickness:
    """Thickness of a part along the ``axes`` of its cells, at points ``(3, n)`` inside it.

    ``cell``, mm, is the shortest edge of a cell.
    """
    every = max(inside.shape[1] // _THICKNESS_PLACES, 1)
    lengths = local_thickness(surface, inside[:, ::every], axes)
    values = np.percentile(lengths, THICKNESS_SHARES) if lengths.size else np.zeros(0)
    return Thickness(
        shares=THICKNESS_SHARES,
        thickness=tuple(float(v) for v in values),
        cells=tuple(float(v) / cell for v in values),
    )


def _left_out(zones: Sequence[SupportZone], unjudged: Unjudged) -> tuple[str, ...]:
    """Say where the exclusion radius leaves much of the lattice out of the stress limit."""
    if not unjudged.limited:
        return ()
    radius = max((zone.radius for zone in zones), default=0.0)
    return share_warnings(unjudged.lattice, radius)
