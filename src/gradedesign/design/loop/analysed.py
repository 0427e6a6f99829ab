"""The explicit analysis of a design, at the resolution that its thinnest wall asks for."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.system.progress import Event, Listener, ignore
from gradedesign.design.loop.designed import density_grid
from gradedesign.design.loop.iteration_steps import (
    build_design,
    explicit_spacing,
)
from gradedesign.design.loop.printed_stage import planned_design
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.design.resolve.wall_grading import wall_grading
from gradedesign.geometry.lattice.cell_layout import CellLayout
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.mechanics.explicit.analysis import SURFACE_PER_ELEMENT, Resolution
from gradedesign.mechanics.explicit.explicit import ExplicitResult, analyse_printed_solid
from gradedesign.mechanics.explicit.finite_cells import FINITE_CELLS
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid
from gradedesign.mechanics.explicit.small_solid import small_solid_spacing
from gradedesign.mechanics.limits.limit import mode_goals
from gradedesign.mechanics.limits.local_stress import allowed_stress


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Analysed:
    """The explicit analysis of one design."""

    design: LatticeDesign
    solid: PrintedSolid
    result: ExplicitResult
    layout: CellLayout
    #: mm. Surface size with which a mesher resolves the walls: that of the elements, but where
    #: these are finer than walls ask for, since the solid is small.
    remeshed_size: float


def analyse_cells(
    model: DesignModel, rho: FloatArray, *, at_most: float = inf, on_event: Listener = ignore
) -> Analysed:
    """Build the lattice of element densities in the cells of the model and analyse it.

    The resolution follows the thinnest wall and is refined until it holds what the field holds.
    ``at_most``, mm, is the spacing of the iteration before: corrections include the error of its
    grid, so they are not valid on a coarser one. A coarser grid is taken, with a message, where the
    memory does not hold this one.
    """
    plan, analysis = model.plan, model.plan.tools.analysis
    grid = density_grid(model, rho)
    design = build_design(plan.domain, model.cells, grid)
    follows = explicit_spacing(model, grid)
    planned = planned_design(model, rho)
    fine = small_solid_spacing(analysis, planned, follows, stated=plan.case.run.states_resolution)
    graded = analysis.name == FINITE_CELLS.name
    solid = printed_solid(model, design, wall_grading(model, grid, follows) if graded else None)
    result = analyse_printed_solid(
        analysis,
        solid,
        Resolution(spacing=min(fine, at_most), coarsest=follows * analysis.coarsest),
        lambda message: on_event(Event(stage="explicit", message=message)),
    )
    return Analysed(
        design=design,
        solid=solid,
        result=result,
        layout=model.cells.layout,
        remeshed_size=SURFACE_PER_ELEMENT * max(follows, result.mesh_size),
    )


def printed_solid(
    model: DesignModel, design: LatticeDesign, grading: Field | None = None
) -> PrintedSolid:
    """A design with the loads, supports and limits of its case."""
    plan, case = model.plan, model.plan.case
    regions = {name: plan.part.regions[name] for name in model.facets}
    return PrintedSolid(
        load_cases=case.load_case,
        memory=case.run.memory,
        design=design,
        material=plan.material,
        regions=regions,
        support_zones=plan.support_zones,
        stress_limit=allowed_stress(case.limits, plan.material),
        percentile=case.limits.percentile,
        solver=plan.tools.solver,
        mesher=plan.tools.surface_mesher,
        grading=grading,
        modes=mode_goals(model.limits),
    )
