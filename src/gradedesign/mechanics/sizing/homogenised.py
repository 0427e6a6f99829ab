"""The homogenised part: its mass, its loads and its displacements for a density field."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.fe.elastic_system import ElasticSystem, prepare_elastic
from gradedesign.mechanics.fe.load_case import load_vector
from gradedesign.mechanics.fe.modes import natural_modes
from gradedesign.mechanics.fe.solution import LoadVector, Solution
from gradedesign.mechanics.fe.solve import solve_cases, solve_roughly
from gradedesign.mechanics.sizing.homogenised_model import (
    HomogenisedModel,
    effective_density,
    effective_slope,
)
from gradedesign.mechanics.sizing.lattice_stiffness import as_stiffness, effective_stiffness
from gradedesign.mechanics.solver.lowest_modes import Modes

#: Residual of the homogenised solves: sizing needs no more, and balance is checked to it. Of modes,
#: whose error their gradients carry at first order.
RTOL = 1e-6


def solid_held(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Density of the lattice phase with the solid that faces add to it or cut from it, ``(M,)``."""
    effective = effective_density(model, rho)
    return effective if model.walls is None else effective * model.walls.solid(rho)


def solid_slope(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Derivative of effective solid by nominal density, ``(M,)``."""
    slope = effective_slope(model, rho)
    if model.walls is None:
        return slope
    added = effective_density(model, rho) * model.walls.solid_slope(rho)
    return slope * model.walls.solid(rho) + added


def mass_density(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Mass per volume of every tetrahedron, ``(M,)``, t/mm^3."""
    share = model.solid_fraction
    return model.material.density * (share + (1 - share) * solid_held(model, rho))


def mass_slope(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Derivative of `mass_density` by nominal density, ``(M,)``, t/mm^3."""
    return np.asarray(model.material.density * (1 - model.solid_fraction) * solid_slope(model, rho))


def lattice_mass(model: HomogenisedModel, rho: FloatArray) -> float:
    """Mass of the lattice phase alone, t."""
    weights = model.lattice_volumes
    return float(model.material.density * (weights @ solid_held(model, rho)))


def total_mass(model: HomogenisedModel, rho: FloatArray) -> float:
    """Mass of lattice and solid phases, t."""
    return float(model.volumes @ mass_density(model, rho))


def homogenised_system(
    model: HomogenisedModel, rho: FloatArray, earlier: Sequence[FloatArray] = ()
) -> ElasticSystem:
    """Stiffness for lattice densities ``(M,)``, ready for loads and adjoint loads alike.

    ``earlier`` are displacements ``(3, N)`` of similar densities, to start iterations from.
    """
    stiffness = as_stiffness(effective_stiffness(model, rho))
    return prepare_elastic(
        model.space, stiffness, solver=model.solver, pattern=model.pattern, earlier=earlier
    )


def solve_homogenised(
    model: HomogenisedModel, rho: FloatArray, system: ElasticSystem | None = None
) -> tuple[Solution, ...]:
    """Displacements of every load case for lattice densities ``(M,)``.

    ``system`` is theirs by `homogenised_system`, where it is at hand.
    """
    system = system or homogenised_system(model, rho)
    return solve_cases(system, _load_vectors(model, rho, system), rtol=RTOL)


def homogenised_displacements(
    model: HomogenisedModel, rho: FloatArray, system: ElasticSystem, rtol: float | None = None
) -> dict[str, FloatArray]:
    """Displacements ``(3, N)``, mm, by load case, where nothing else is asked for.

    ``rtol``: residual that does for them; by default they are balanced, as `solve_homogenised`.
    """
    if rtol is None:
        return {s.name: s.displacement for s in solve_homogenised(model, rho, system)}
    found = solve_roughly(system, _load_vectors(model, rho, system), rtol=rtol)
    return {case.name: u for case, u in zip(model.cases, found, strict=True)}


def _load_vectors(
    model: HomogenisedModel, rho: FloatArray, system: ElasticSystem
) -> list[LoadVector]:
    density, expansion = mass_density(model, rho), model.material.thermal_expansion
    return [
        load_vector(model.space, case, system.stiffness, density, expansion) for case in model.cases
    ]


def homogenised_modes(
    model: HomogenisedModel, rho: FloatArray, system: ElasticSystem, load_case: str, count: int
) -> Modes:
    """Lowest modes for lattice densities ``(M,)`` about the supports of a load case.

    ``system`` is theirs by `homogenised_system`.
    """
    case = next(case for case in model.cases if case.name == load_case)
    masses = model.volumes * mass_density(model, rho)
    return natural_modes(system, case.supports.fixed, masses, count, rtol=RTOL, name=load_case)
