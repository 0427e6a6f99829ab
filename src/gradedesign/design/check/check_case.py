"""Check of a case as by ``gradedesign check``: all that needs no law and no mesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradedesign.design.case.schema import Case
from gradedesign.design.check.predicted_run import PredictedRun, budget_warnings, predicted_run
from gradedesign.design.resolve.exclusion import exclusion_words, judged_share
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.resolve_law import resolve_law
from gradedesign.design.resolve.resolved_case import ResolvedCase, resolve_case, stated_zones
from gradedesign.design.resolve.size_effects import periodic_warnings, why_periodic
from gradedesign.design.resolve.symmetry import symmetry_data, symmetry_planes, symmetry_warnings
from gradedesign.geometry.lattice.part_room import inner_points
from gradedesign.geometry.maps.cell_map import turned_axes
from gradedesign.geometry.part.round_shapes import RoundShapes, round_shapes
from gradedesign.geometry.part.thickness import local_thickness
from gradedesign.mechanics.limits.local_stress import allowed_stress, share_warnings

#: Points at which the part's thickness is measured.
_THICKNESS_PLACES = 1500
#: Shares of the part's volume at which its thickness is reported. The ends, the quartiles and the
#: middle of the distribution.
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Unjudged:
    """Share of the volume whose stress no limit judges.

    Attributes
    ----------
    around : str
        Supports with the radius around each; empty where none makes stress singular.
    part, lattice : float
        Shares of their volumes within these radii.
    limited : bool
        Whether the case limits stress outside them.
    """

    around: str
    part: float
    lattice: float
    limited: bool

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
    """Checked case: its resolved records, and the predicted cost of its run.

    Attributes
    ----------
    resolved : ResolvedCase
    holes : tuple of RoundShapes
    thickness : Thickness
    run : PredictedRun
    periodic : str
        Why size effects are left out; empty where the run computes those it finds.
    unjudged : Unjudged
    symmetry : mapping
        See `symmetry_data`.
    warnings : tuple of str
    """

    resolved: ResolvedCase
    holes: tuple[RoundShapes, ...]
    thickness: Thickness
    run: PredictedRun
    periodic: str
    unjudged: Unjudged
    symmetry: Mapping[str, Any]
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
        if zone.law.known is not None:
            remarks += resolve_law(
                zone.lattice,
                case.limits,
                registry,
                zone.cell,
                zone.where,
                poissons_ratio=resolved.material.poissons_ratio,
            )[1]
    inside = inner_points(resolved.domain)
    thickness = part_thickness(resolved, inside)
    planes = symmetry_planes(case.load_case, resolved.part, case.where)
    unjudged = Unjudged(
        around=exclusion_words(resolved.support_zones),
        part=1.0 - judged_share(resolved.support_zones, inside),
        lattice=1.0 - judged_share(resolved.support_zones, resolved.layout.points),
        limited=allowed_stress(case.limits, resolved.material) is not None,
    )
    run = predicted_run(resolved, inside.shape[1])
    periodic = why_periodic(
        case,
        resolved.law.kind,
        resolved.cell,
        run.bounds[0],
        resolved.part,
        resolved.domain,
        resolved.layout,
    )
    remarks += [
        *periodic_warnings(case, resolved.part, resolved.layout, periodic),
        *_left_out(resolved, unjudged),
        *symmetry_warnings(planes, case.lattice.skin, resolved.cell, resolved.layout),
        *budget_warnings(resolved, run),
    ]
    return CaseCheck(
        resolved=resolved,
        holes=round_shapes(resolved.part.surface, resolved.part.faces),
        thickness=thickness,
        run=run,
        periodic=periodic,
        unjudged=unjudged,
        symmetry=symmetry_data(planes, resolved.part.volume * resolved.material.density * 1e6),
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


def _left_out(resolved: ResolvedCase, unjudged: Unjudged) -> tuple[str, ...]:
    """Say where the exclusion radius leaves much of the lattice out of the stress limit."""
    if not unjudged.limited:
        return ()
    radius = max((zone.radius for zone in resolved.support_zones), default=0.0)
    return share_warnings(unjudged.lattice, radius)
