"""Size and time of a run, predicted from the case alone: no mesh, no law, no analysis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from gradedesign.design.acceptance.whole_resolution import first_spacing, judged_seconds
from gradedesign.design.case.run_schema import RunSpec
from gradedesign.design.loop.predicted_cost import CostPrediction, RunWork, predict_cost
from gradedesign.design.loop.run_cost import require_solver_takes
from gradedesign.design.loop.run_work import remeshed_tets
from gradedesign.design.resolve.analysable import EXPECTED_SHARE, Analysable
from gradedesign.design.resolve.analysable_lattice import analysable_lattice
from gradedesign.design.resolve.plan import Plan
from gradedesign.design.resolve.planned_solid import planned_part, planned_solid
from gradedesign.design.resolve.predicted_part_mesh import predicted_part_dofs
from gradedesign.design.resolve.zones import ResolvedZone
from gradedesign.geometry.cell.cell_surface import cell_surface
from gradedesign.geometry.cell.wall_size import wall_mm
from gradedesign.geometry.lattice.component import KEPT, SolidComponent
from gradedesign.mechanics.explicit.analysis import AnalysisEstimate, PlannedSolid
from gradedesign.mechanics.explicit.small_solid import small_solid_spacing
from gradedesign.mechanics.limits.limit import stated_goals, stated_modes

#: Of a run that gets no explicit lattice.
_NO_ANALYSIS = AnalysisEstimate(unknowns=0, memory_bytes=0, mesh_s=0.0, solve_s=0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class PredictedGrid:
    """The explicit grid and what sets it."""

    spacing: float  #: mm. Edge of its elements.
    set_by: str  #: The thinnest thing that it must resolve, in words.
    wall: float  #: mm. Thinnest wall or strut.


@dataclass(frozen=True, slots=True, kw_only=True)
class PredictedRun:
    """Predicted size and cost of a run."""

    density: float  #: Mean of the lattice that the prediction is made for.
    lattice_share: float  #: Of the part's volume that is lattice.
    grid: PredictedGrid
    #: Densities that sizing may choose: those whose walls the memory can analyse.
    bounds: tuple[float, float]
    #: Why the lower one is not that of the density window, and doubts about the linear solver.
    raised: tuple[str, ...]
    cost: CostPrediction
    explicit: bool  #: Whether the run gets as far as an explicit lattice.
    law_s: float  #: s. Of computing the law, at most; 0 where it is known.

    @property
    def run_s(self) -> float:
        """The whole run with its law, s."""
        return self.law_s + self.cost.run_s

    @property
    def iteration_s(self) -> float:
        """One iteration, s."""
        return self.cost.iteration_s


def predicted_run(plan: Plan, inside: int) -> PredictedRun:
    """Predict unknowns, memory and time of a run.

    ``inside``: how many of the points that fill the part's box lie in it; `Plan.layout` has those
    of the lattice.
    """
    case = plan.case
    share = plan.layout.points.shape[1] / max(inside, 1)
    able = analysable_lattice(
        plan,
        [zone.bounds for zone in plan.stated_zones],
        latticed=plan.part.volume * share,
        solid=plan.part.volume * (1.0 - share),
    )
    low, high = able.bounds
    density = low + (high - low) * EXPECTED_SHARE
    grid = _predicted_grid(plan, density, able)
    explicit = case.run.stop_after == "verdict"
    planned = planned_solid(
        planned_part(
            plan.part.surface,
            plan.domain,
            latticed=plan.part.volume * share,
            solid=plan.part.volume * (1.0 - share),
            load_cases=len(case.load_case),
            goals=stated_goals(plan.limits),
            modes=stated_modes(plan.limits),
        ),
        density,
        cell_surface(plan.cell, density, plan.layout.typical),
    )
    walls = grid.spacing
    stated = case.run.states_resolution
    fine = small_solid_spacing(able.analysis, planned, walls, stated=stated)
    if fine < grid.spacing:
        grid = replace(grid, spacing=fine, set_by=f"{grid.set_by}, and finer: the solid is small")
    size = able.analysis.estimate(planned, grid.spacing) if explicit else _NO_ANALYSIS
    work = _work(plan, able, planned, density, (walls, grid.spacing), size)
    doubts = require_solver_takes(
        plan.tools.solver,
        work,
        case.run.submodel_count,
        case.where,
        bricks=case.part.bricks is not None,
    )
    return PredictedRun(
        density=density,
        lattice_share=share,
        grid=grid,
        bounds=able.bounds,
        raised=(*able.warnings, *doubts),
        cost=predict_cost(work),
        explicit=explicit,
        law_s=60.0 * _laws_minutes(plan.stated_zones),
    )


def _work(
    plan: Plan,
    able: Analysable,
    planned: PlannedSolid,
    density: float,
    spacings: tuple[float, float],
    size: AnalysisEstimate,
) -> RunWork:
    """Work of a run whose explicit grid has that size; spacings of walls and of the grid, mm."""
    walls, spacing = spacings
    case, explicit = plan.case, size is not _NO_ANALYSIS
    first = min(first_spacing(able.analysis, spacing, stated.cell) for stated in plan.stated_zones)
    return RunWork(
        part_dofs=predicted_part_dofs(case.part, plan.part),
        load_cases=len(case.load_case),
        adjoint_solves=len(plan.limits),
        explicit_dofs=size.unknowns,
        explicit_memory=size.memory_bytes,
        explicit_mesh_s=size.mesh_s,
        explicit_solve_s=size.solve_s,
        whole_s=(
            judged_seconds(planned, first, size.unknowns, case.run.memory, case.run.time)
            if explicit
            else 0.0
        ),
        mesher_tets=(
            remeshed_tets(case.run, planned, walls, density, plan.layout.typical) if explicit else 0
        ),
        iterations=case.run.max_iterations if explicit else 1,
        members=case.lattice.members,
        cells=case.lattice.cells,
    )


def _laws_minutes(zones: Sequence[ResolvedZone]) -> float:
    """Minutes, at most, of computing the laws of all cells that have none yet."""
    laws = {id(zone.cell): zone.law for zone in zones}
    return sum(law.minutes[1] for law in laws.values())


def _predicted_grid(plan: Plan, density: float, able: Analysable) -> PredictedGrid:
    """Explicit grid for a mean density; graded designs reach the least density somewhere."""
    case = plan.case
    size = case.lattice.size[-1] if case.lattice.graded_size else plan.layout.least
    finest = []
    for stated, zone in zip(plan.stated_zones, able.zones or (able,), strict=True):
        low = density if case.lattice.grading == "uniform" else zone.bounds[0]
        thickness = case.lattice.wall or float(wall_mm(stated.cell, low, size))
        finest.append((thickness / zone.elements_per_wall, thickness, low))
    element, wall, thin = min(finest)
    layer = able.analysis.elements_per_layer
    walls = f"the thinnest wall or strut, {wall:.3g} mm at density {thin:.3g}"
    if not case.lattice.cells:
        walls = f"the solid members, {wall:.3g} mm"
    spacings = {walls: element}
    for component in plan.domain.components:
        kept = isinstance(component, SolidComponent) and component.phase == KEPT
        title = f"{'the passive solid ' if kept else ''}{component.name}"
        spacings[f"{title}, {component.least:.4g} mm"] = component.least / layer
    set_by = min(spacings, key=spacings.__getitem__)
    spacing = spacings[set_by]
    if case.run.explicit_mesh_size is not None:
        set_by, spacing = "[run] explicit_mesh_size", case.run.explicit_mesh_size
    return PredictedGrid(spacing=spacing, set_by=set_by, wall=wall)


def budget_warnings(limits: RunSpec, run: PredictedRun) -> tuple[str, ...]:
    """Say where a run is predicted to exceed the budgets of its case."""
    remarks = list(run.raised)
    if run.explicit and run.cost.memory_bytes > limits.memory:
        factor = (run.cost.memory_bytes / limits.memory) ** (1 / 3)
        remarks.append(
            f"the explicit analysis is predicted to take {run.cost.memory_bytes / 1e9:.2g} GB, "
            f"more than the {limits.memory / 1e9:.2g} GB of [run] memory; its grid of "
            f"{run.grid.spacing:.3g} mm is set by {run.grid.set_by}: a coarser one of "
            f"{factor * run.grid.spacing:.3g} mm would fit"
        )
    if run.run_s > limits.time:
        remarks.append(
            f"the run is predicted to take {run.run_s / 60:.0f} min, more than the "
            f"{limits.time / 60:.3g} min of [run] time: it may end before its design is accepted"
        )
    return tuple(remarks)
