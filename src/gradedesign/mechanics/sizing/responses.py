"""Adjoint gradients of the responses of limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.fe.assembly import strain_energy_per_element
from gradedesign.mechanics.fe.elastic_system import ElasticSystem
from gradedesign.mechanics.fe.mass import squares_per_element
from gradedesign.mechanics.fe.solution import LoadVector, Solution
from gradedesign.mechanics.fe.stiffness import MomentStiffness, Stiffness, gauss_equivalent
from gradedesign.mechanics.fe.stress import element_stress
from gradedesign.mechanics.fe.supports import Supports
from gradedesign.mechanics.limits.state import ModeShape, Response
from gradedesign.mechanics.sizing.homogenised import mass_slope, solve_vectors
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel
from gradedesign.mechanics.sizing.lattice_stiffness import (
    as_stiffness,
    in_lattice,
    lattice_stiffness_derivative,
)
from gradedesign.mechanics.sizing.state import SolvedState, case_named, force_slope


def response_gradients(
    state: SolvedState, responses: Sequence[Response], adjoints: Sequence[Solution | None]
) -> FloatArray:
    """Derivatives of responses by the density of every tetrahedron, ``(k, M)``.

    ``adjoints`` are those of the responses, by `solve_adjoints`.
    """
    if not responses:
        return np.zeros((0, len(state.rho)))
    derivative = stiffness_derivative(state.model, state.rho)
    return np.array(
        [
            _response_gradient(state, derivative, response, adjoint)
            for response, adjoint in zip(responses, adjoints, strict=True)
        ]
    )


def solve_adjoints(
    model: HomogenisedModel, system: ElasticSystem, responses: Sequence[Response]
) -> tuple[Solution | None, ...]:
    """Displacements under the derivatives of responses as loads, supports at rest.

    None for a response that has none, but a mode.
    """
    loads = []
    for response in responses:
        if response.by_displacement is None:
            continue
        supports = case_named(model, response.load_case).supports
        loads.append(
            LoadVector(
                name=f"adjoint of {response.name}",
                supports=Supports(fixed=supports.fixed, value=np.zeros_like(supports.value)),
                force=response.by_displacement,
            )
        )
    solutions = iter(solve_vectors(system, loads))
    return tuple(None if r.by_displacement is None else next(solutions) for r in responses)


def stiffness_derivative(model: HomogenisedModel, rho: FloatArray) -> Stiffness:
    """Derivative of the stiffness of every tetrahedron by its density, MPa."""
    return as_stiffness(in_lattice(model, lattice_stiffness_derivative(model, rho)))


def _response_gradient(
    state: SolvedState, derivative: Stiffness, response: Response, adjoint: Solution | None
) -> FloatArray:
    """Derivative of one response by the density of every tetrahedron, ``(M,)``.

    ``dg/drho = lambda^T (df/drho - dK/drho u)``, with inertia and thermal loads in f, and what of
    the response depends on density at fixed displacements; `derivative` is that of
    `stiffness_derivative`.
    """
    model, case = state.model, case_named(state.model, response.load_case)
    if response.mode is not None:
        return _mode_gradient(state, derivative, response.mode)
    if adjoint is None:
        raise ValueError(f"{response.name} has neither an adjoint solution nor a mode")
    gradient = -strain_energy_per_element(
        model.space, derivative, state.displacement(case.name), adjoint.displacement
    )
    if np.any(case.acceleration):
        gradient = gradient + force_slope(model, state.rho, case, adjoint.displacement)
    if case.temperature_change:
        # The work of C alpha dT on the adjoint strain is that of alpha dT on its stress.
        expansion = model.material.thermal_expansion * case.temperature_change
        if isinstance(derivative, MomentStiffness):
            derivative = gauss_equivalent(derivative)
        stress = element_stress(model.space, derivative, adjoint.displacement)
        gradient = gradient + model.volumes * expansion * np.trace(stress).mean(axis=-1)
    return gradient if response.by_density is None else gradient + response.by_density


def _mode_gradient(state: SolvedState, derivative: Stiffness, mode: ModeShape) -> FloatArray:
    """Derivative of a value that follows a frequency by the density of every element, ``(M,)``.

    ``d omega^2/drho = x^T (dK/drho - omega^2 dM/drho) x / (x^T M x)``, where the last is one over
    omega^2 as the shape is normalised (Wittrick, Proc. R. Soc. A 268, 1962; of equal frequencies
    only their sum has this derivative).
    """
    strained = strain_energy_per_element(state.model.space, derivative, mode.shape)
    moved = squares_per_element(state.model.space, mode.shape)
    moved = moved * state.model.volumes * mass_slope(state.model, state.rho)
    return mode.by_square * mode.square * (strained - mode.square * moved)
