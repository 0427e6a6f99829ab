"""Amount of work of a prepared case, in the plain numbers of `predicted_cost`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradedesign.design.acceptance.acceptance import choose_scope
from gradedesign.design.acceptance.meshed_anew import mesher_tets
from gradedesign.design.acceptance.submodel_choice import BUFFERS
from gradedesign.design.acceptance.whole_resolution import first_spacing, judged_seconds
from gradedesign.design.case.run_schema import RunSpec
from gradedesign.design.loop.iteration_steps import explicit_spacing_for
from gradedesign.design.loop.predicted_cost import RunWork
from gradedesign.design.loop.printed_stage import planned_design
from gradedesign.design.resolve.cell_choice import CellChoice, cells_in_zones
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.design.resolve.plan import Plan
from gradedesign.geometry.cell.wall_size import wall_mm
from gradedesign.mechanics.explicit.analysis import SURFACE_PER_ELEMENT, PlannedSolid
from gradedesign.mechanics.explicit.small_solid import small_solid_spacing
from gradedesign.mechanics.limits.limit import Limit
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.material.scaling_law import has_strength

#: Without a solid analysis, sizing is taken to end at this share of the window of densities.
#: Chosen, not measured.
_USUAL_SHARE = 1.0 / 3.0
#: Densities between which the law is read. Chosen, not measured.
SAMPLES = 65


def run_work(model: DesignModel) -> RunWork:
    """Work of a run before it.

    ``model``: its limits on the fully solid part tell how much stiffness and strength a lattice may
    give up. Without them sizing is taken to end at a third of the window.
    """
    plan, cells = model.plan, model.cells
    case, analysis = plan.case, plan.tools.analysis
    density = guessed_density(cells, model.limits, model.solid)
    planned = planned_design(model, density)
    walls, spacing = _predicted_spacings(plan, cells, density, planned)
    explicit = analysis.estimate(planned, spacing)
    first = min(first_spacing(analysis, spacing, cell) for cell, _, _ in cells_in_zones(cells))
    return RunWork(
        part_dofs=model.homogenised.space.dof_count,
        load_cases=len(case.load_case),
        adjoint_solves=len(model.limits),
        explicit_dofs=explicit.unknowns,
        explicit_memory=explicit.memory_bytes,
        explicit_mesh_s=explicit.mesh_s,
        explicit_solve_s=explicit.solve_s,
        whole_s=judged_seconds(planned, first, explicit.unknowns, case.run.memory, case.run.time),
        mesher_tets=remeshed_tets(case.run, planned, walls, density, cells.layout.typical),
        iterations=case.run.max_iterations,
        members=case.lattice.members,
        cells=case.lattice.cells,
    )


def remeshed_tets(
    run: RunSpec, planned: PlannedSolid, spacing: float, density: float, cell: float
) -> int:
    """Tetrahedra of the mesher of the acceptance, in the whole lattice or in all submodels.

    ``spacing`` is that which walls ask for, ``cell`` the edge of a cell, both mm.
    """
    tets = mesher_tets(planned.volume, SURFACE_PER_ELEMENT * spacing)
    if choose_scope(run.acceptance, tets, run.time) == "whole":
        return int(tets)
    edges = np.minimum((1 + 2 * BUFFERS[0]) * cell, planned.box)
    share = run.submodel_count * density * float(edges.prod()) / planned.volume
    return int(min(1.0, share) * tets)


def _predicted_spacings(
    plan: Plan, cells: CellChoice, density: float, planned: PlannedSolid
) -> tuple[float, float]:
    """Element size that walls ask for and that of the explicit analysis, mm.

    Of a mean density of the lattice. Graded designs reach the lower bound somewhere, and the
    elements follow their thinnest wall, or what of it the memory holds.
    """
    case, analysis = plan.case, plan.tools.analysis
    uniform, least = case.lattice.grading == "uniform", cells.layout.least
    elements = []
    for cell, bounds, per_wall in cells_in_zones(cells):
        thinnest = density if uniform else bounds[0]
        wall = case.lattice.wall or float(wall_mm(cell, thinnest, least))
        elements.append(wall / per_wall)
    follows = explicit_spacing_for(plan, min(elements))
    stated = case.run.states_resolution
    fine = small_solid_spacing(analysis, planned, follows, stated=stated)
    fitted = analysis.fitted_spacing(planned, fine, case.run.memory)
    return max(follows, fitted), fitted


def guessed_density(cells: CellChoice, limits: Sequence[Limit], solid: Sequence[LimitRow]) -> float:
    """Mean density at which the lattice, by the law, uses up the margin of the solid part."""
    low, high = cells.bounds
    solid = [row for row in solid if row.unfavourable == "high"]
    if not solid:
        return low + (high - low) * _USUAL_SHARE
    rho = np.linspace(low, high, SAMPLES)
    stiffness = np.moveaxis(cells.law.stiffness(rho), -1, 0)
    modulus = 1.0 / np.linalg.inv(stiffness)[:, 0, 0]
    stiff = {limit.key.kind for limit in limits if limit.follows_stiffness}
    soft = max((row.utilisation for row in solid if row.key.kind in stiff), default=0.0)
    weak = max((row.utilisation for row in solid if row.key.kind not in stiff), default=0.0)
    guess = float(np.interp(soft, modulus, rho))
    if not has_strength(cells.law):
        return guess
    strength = np.asarray(cells.law.strength(rho), dtype=np.float64)
    return max(guess, float(np.interp(weak, strength, rho)))
