"""The explicit analysis of a plan case, with the densities that its budgets can analyse."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from gradedesign.design.printing.gaps import narrowest_gap
from gradedesign.design.resolve.analysable import (
    Analysable,
    analysable_bounds,
    analysable_together,
)
from gradedesign.design.resolve.plan import Plan
from gradedesign.design.resolve.planned_solid import planned_part
from gradedesign.errors import ResourceError
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.limits.limit import stated_goals, stated_modes


def analysable_lattice(
    plan: Plan,
    bounds: Sequence[tuple[float, float]],
    *,
    latticed: float,
    solid: float,
) -> Analysable:
    """The analysis that a case takes, with the density bounds that it can analyse.

    Raises ResourceError if the memory of the case holds no density of its window.

    ``bounds``: density windows of user, cell, law and printer of every zone, one without zones.
    ``latticed``, ``solid``, mm^3: volume that becomes lattice, and volume that stays solid.
    """
    case = plan.case
    part = planned_part(
        plan.part.surface,
        plan.domain,
        latticed=latticed,
        solid=solid,
        load_cases=len(case.load_case),
        goals=stated_goals(plan.limits),
        modes=stated_modes(plan.limits),
    )
    able = analysable_together(
        [
            analysable_bounds(
                case.lattice,
                case.run,
                zone.cell,
                window,
                plan.layout.least,
                plan.tools.analysis,
                part=part,
                domain=plan.domain,
            )
            for zone, window in zip(plan.stated_zones, bounds, strict=True)
        ]
    )
    if able.refusal:
        raise ResourceError(f"{case.where('run.memory')}: {able.refusal}")
    if case.run.stop_after != "verdict":
        return able
    return replace(able, warnings=(*joined_faces(able, plan.part.surface), *able.warnings))


def joined_faces(able: Analysable, surface: SurfaceMesh) -> tuple[str, ...]:
    """A warning where elements join faces of the part that are close to each other across void."""
    gap = narrowest_gap(surface, able.analysis.closes * able.spacing)
    if gap is None:
        return ()
    where = ", ".join(f"{value:.4g}" for value in gap.middle)
    return (
        f"faces of the part are {gap.width:.3g} mm apart at ({where}) mm: elements of "
        f"{able.spacing:.3g} mm join them, so that the explicit analysis is too stiff there; a "
        f"smaller [run] explicit_mesh_size or a wider gap keeps them apart",
    )
