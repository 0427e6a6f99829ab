"""Check of a case as by ``gradedesign check``: all that needs no law and no mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.case.schema import Case
from gradedesign.cell.cell_map import turned_axes
from gradedesign.check.predicted_run import PredictedRun, budget_warnings, predicted_run
from gradedesign.layout.part_room import inner_points
from gradedesign.limits.local_stress import allowed_stress, share_warnings
from gradedesign.part.cylinders import CylinderGroup, cylinder_groups
from gradedesign.part.signed_distance import region_distance
from gradedesign.part.thickness import local_thickness
from gradedesign.plugin.registry import Registry
from gradedesign.resolve.exclusion import exclusion_radius
from gradedesign.resolve.resolve_law import resolve_law
from gradedesign.resolve.resolved_case import ResolvedCase, resolve_case, stated_zones
from gradedesign.resolve.size_effects import periodic_warnings, why_periodic
from gradedesign.verify.phases import evaluated_at

#: Points at which the part's thickness is measured.
_THICKNESS_PLACES = 1500
#: Shares of the part's volume at which its thickness is reported.
THICKNESS_SHARES = (5, 25, 50, 75, 95)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Thickness:
    """Thickness of the part in cells.

    Attributes
    ----------
    shares : tuple of int, %
    thickness : tuple of float, mm
        Below which that share of the volume lies.
    cells : tuple of float
        The same over the shortest edge of a cell.
    """

    shares: tuple[int, ...]
    thickness: tuple[float, ...]
    cells: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CaseCheck:
    """Checked case: its resolved records, and the predicted cost of its run.

    Attributes
    ----------
    resolved : ResolvedCase
    holes : tuple of CylinderGroup
    thickness : Thickness
    run : PredictedRun
    periodic : str
        Why size effects are left out; empty where the run computes those it finds.
    warnings : tuple of str
    """

    resolved: ResolvedCase
    holes: tuple[CylinderGroup, ...]
    thickness: Thickness
    run: PredictedRun
    periodic: str
    warnings: tuple[str, ...]


def check_case(case: Case, registry: Registry) -> CaseCheck:
    """Look at a case without computing a law, walls or a mesh.

    Raises
    ------
    GradeDesignError
        As `resolve_case`.
    """
    resolved = resolve_case(case, registry)
    case = resolved.case
    remarks = [*resolved.warnings, *resolved.narrowed]
    for zone in stated_zones(resolved):
        if zone.law.voxels == 0:
            # Taken from the registry: nothing is computed.
            remarks += resolve_law(
                zone.case,
                registry,
                zone.cell,
                poissons_ratio=resolved.material.poissons_ratio,
            )[1]
    inside = inner_points(resolved.domain)
    thickness = part_thickness(resolved, inside)
    run = predicted_run(resolved, inside.shape[1])
    law_kind = "computed" if resolved.law.voxels else registry.scaling_laws[resolved.law.name].kind
    periodic = why_periodic(
        case, law_kind, resolved.cell, run.bounds[0], resolved.part, resolved.layout
    )
    remarks += [
        *periodic_warnings(case, resolved.part, resolved.layout, periodic),
        *_left_out(resolved),
        *budget_warnings(resolved, run),
    ]
    return CaseCheck(
        resolved=resolved,
        holes=cylinder_groups(resolved.part.faces),
        thickness=thickness,
        run=run,
        periodic=periodic,
        warnings=tuple(dict.fromkeys(remarks)),
    )


def part_thickness(resolved: ResolvedCase, inside: np.ndarray) -> Thickness:
    """Thickness of the part along the axes of its cells, at points ``(3, n)`` inside it."""
    every = max(inside.shape[1] // _THICKNESS_PLACES, 1)
    axes = turned_axes(resolved.case.lattice.rotation)
    lengths = local_thickness(resolved.part.surface, inside[:, ::every], axes)
    values = np.percentile(lengths, THICKNESS_SHARES) if lengths.size else np.zeros(0)
    return Thickness(
        shares=THICKNESS_SHARES,
        thickness=tuple(float(v) for v in values),
        cells=tuple(float(v) / resolved.layout.least for v in values),
    )


def _left_out(resolved: ResolvedCase) -> tuple[str, ...]:
    """Say where the exclusion radius leaves much of the lattice out of the stress limit."""
    case, points = resolved.case, resolved.layout.points
    if allowed_stress(case, resolved.material) is None or not points.size:
        return ()
    radius = exclusion_radius(case)
    names = sorted({fix.region for spec in case.load_case for fix in spec.fix})
    clamped = tuple(region_distance(resolved.part.regions[name].corners) for name in names)
    return share_warnings(1.0 - float(evaluated_at(points, clamped, radius).mean()), radius)
