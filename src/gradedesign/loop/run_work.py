"""What a prepared case will ask of the machine, in the plain numbers of `predicted_cost`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradedesign.cell.wall_size import wall_mm
from gradedesign.limits.row import LimitRow
from gradedesign.loop.predicted_cost import (
    DOFS_PER_TET,
    TETS_PER_SOLID_CUBE,
    RunWork,
    mesher_tets,
)
from gradedesign.loop.round import build_design, density_grid, explicit_cube_for
from gradedesign.resolve.setup import Setup
from gradedesign.verify.acceptance import choose_scope
from gradedesign.verify.explicit_mesh import fitted_cube, fitting_cube, grid_for
from gradedesign.verify.mesh_within_budget import COARSEST
from gradedesign.verify.windows import MARGIN

#: Without a solid analysis, sizing is taken to end at this share of the window of densities.
USUAL_SHARE = 1.0 / 3.0
#: Densities between which the law is read.
SAMPLES = 65


def run_work(setup: Setup, solid: Sequence[LimitRow] = ()) -> RunWork:
    """Count unknowns and tetrahedra of a run before it.

    Parameters
    ----------
    setup : Setup
    solid : sequence of LimitRow
        Limits on the fully solid part, where they are known: they tell how much stiffness and
        strength a lattice may give up. Without them sizing is taken to end at a third of the
        window.

    Returns
    -------
    RunWork
    """
    case = setup.problem.case
    density = guessed_density(setup, solid)
    share = setup.model.solid_share
    volume = float(setup.model.volumes @ (share + (1 - share) * density))
    cube, cubes = predicted_grid(setup, density, volume)
    tets = TETS_PER_SOLID_CUBE * volume / cube**3
    scope = choose_scope(case.run.acceptance, tets, case.run.time)
    points = setup.problem.part.surface.vertices
    edges = np.minimum((1 + 2 * MARGIN) * setup.cells.layout.typical, np.ptp(points, axis=0))
    windows = min(1.0, case.run.window_count * density * float(edges.prod()) / volume)
    return RunWork(
        part_dofs=setup.problem.space.dof_count,
        load_cases=len(case.load_case),
        adjoint_solves=sum(limit.by_gradient for limit in setup.problem.limits),
        explicit_dofs=int(tets * DOFS_PER_TET),
        explicit_cubes=cubes,
        mesher_tets=mesher_tets(tets, 1.0 if scope == "whole" else windows),
        remeshed=scope,
        rounds=case.run.max_rounds,
    )


def predicted_grid(setup: Setup, density: float, volume: float) -> tuple[float, int]:
    """Edge of the explicit grid's cubes, mm, and their number, for a mean density of the lattice.

    Graded designs reach the lower bound somewhere, and the grid follows their thinnest wall, or
    what of it the memory holds. ``volume`` is that of the solid, mm^3.
    """
    case = setup.problem.case
    thinnest = density if case.lattice.grading == "uniform" else setup.cells.bounds[0]
    wall = case.lattice.wall or float(wall_mm(setup.cells.cell, thinnest, setup.cells.layout.least))
    problem, cells = setup.problem, setup.cells
    grid = density_grid(problem, np.full(setup.model.volumes.shape, density))
    design = build_design(problem, cells, grid)
    asked = explicit_cube_for(case, cells.cubes_per_wall, wall)
    fitting = fitting_cube(volume, case.run.memory)
    if asked < fitting <= COARSEST * asked:
        asked = fitting
    cube = fitted_cube(design, asked, fitting)
    return cube, int(np.prod(grid_for(design, cube)[1]))


def guessed_density(setup: Setup, solid: Sequence[LimitRow] = ()) -> float:
    """Mean density at which the law loses what the solid part has to spare."""
    low, high = setup.cells.bounds
    if not solid:
        return low + (high - low) * USUAL_SHARE
    rho = np.linspace(low, high, SAMPLES)
    stiffness = np.moveaxis(setup.cells.law.stiffness(rho), -1, 0)
    modulus = 1.0 / np.linalg.inv(stiffness)[:, 0, 0]
    strength = np.asarray(setup.cells.law.strength(rho), dtype=np.float64)
    stiff = {limit.key.kind for limit in setup.problem.limits if limit.by_gradient}
    soft = max((row.use for row in solid if row.key.kind in stiff), default=0.0)
    weak = max((row.use for row in solid if row.key.kind not in stiff), default=0.0)
    return float(max(np.interp(soft, modulus, rho), np.interp(weak, strength, rho)))
