"""Solutions of the fully solid part."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.fe.elastic_system import prepare_elastic
from gradedesign.mechanics.fe.load_case import PartLoadCase, load_vector
from gradedesign.mechanics.fe.modes import ModeGoal, found_modes
from gradedesign.mechanics.fe.scikit_fem import assemble_scikit_fem
from gradedesign.mechanics.fe.solution import Solution
from gradedesign.mechanics.fe.solve import solve_elastic
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.fe.stiffness import dense_stiffness
from gradedesign.mechanics.fe.stress import element_stress
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel
from gradedesign.mechanics.solver.linear_solver import LinearSolver


def solid_solutions(
    space: TetSpace, loads: Sequence[PartLoadCase], material: Material, solver: LinearSolver
) -> tuple[Solution, ...]:
    """Displacements of the fully solid part in every load case.

    The stiffness is scikit-fem's, whatever solves its system.
    """
    stiffness = dense_stiffness(space, material)
    density = np.full(space.element_count, material.density)
    vectors = [
        load_vector(space, case, stiffness, density, material.thermal_expansion) for case in loads
    ]
    return solve_elastic(space, stiffness, vectors, solver=_by_scikit_fem(solver))


def solid_modes(
    part: HomogenisedModel, solutions: Sequence[Solution], goals: Mapping[Hashable, ModeGoal]
) -> dict[Hashable, float]:
    """Natural frequencies, Hz, and load factors of the fully solid part.

    ``solutions`` are those of its load cases.

    On the same stiffness.
    """
    if not goals:
        return {}
    stiffness = dense_stiffness(part.space, part.material)
    system = prepare_elastic(
        part.space,
        stiffness,
        solver=_by_scikit_fem(part.solver),
        earlier=[solution.displacement for solution in solutions],
    )
    held = {case.name: case.supports.fixed for case in part.cases}
    by_name = {
        case.name: (solution.displacement, case.temperature_change)
        for case, solution in zip(part.cases, solutions, strict=True)
    }

    def stress(name: str) -> FloatArray:
        u, change = by_name[name]
        strain = part.material.thermal_expansion * change
        return element_stress(part.space, stiffness, u, thermal_strain=strain)

    return found_modes(system, held, part.volumes * part.material.density, stress, goals)


def _by_scikit_fem(solver: LinearSolver) -> LinearSolver:
    """The solver on a stiffness that scikit-fem assembles."""
    return replace(solver, assemble=assemble_scikit_fem)
