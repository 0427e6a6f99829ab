"""Adjoint gradients of the responses of limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.fe.elastic_system import ElasticSystem
from gradedesign.mechanics.fe.mass import squares_per_element
from gradedesign.mechanics.fe.solution import LoadVector
from gradedesign.mechanics.fe.solve import solve_roughly
from gradedesign.mechanics.fe.stiffness import MomentStiffness, gauss_equivalent
from gradedesign.mechanics.fe.stress import element_stress
from gradedesign.mechanics.fe.supports import Supports
from gradedesign.mechanics.limits.state import ModeShape, Response
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel
from gradedesign.mechanics.sizing.lattice_stiffness import StiffnessSlopes, stiffness_slopes
from gradedesign.mechanics.sizing.state import SolvedState, case_named, force_slope, mass_slopes

#: Residual of adjoint problems, over their loads: gradients have as many digits.
_RTOL = 1e-4


def response_gradients(
    state: SolvedState, responses: Sequence[Response], adjoints: Sequence[FloatArray | None]
) -> FloatArray:
    """Derivatives of responses by every variable of the design, ``(k, P)``.

    ``adjoints`` are those of the responses, by `solve_adjoints`.
    """
    if not responses:
        return np.zeros((0, len(state.rho) + (0 if state.share is None else len(state.share))))
    slopes = stiffness_slopes(
        state.model, state.rho, None if state.share is None else state.lattice_alone
    )
    fields = [
        _fields(state, response, adjoint)
        for response, adjoint in zip(responses, adjoints, strict=True)
    ]
    energies = slopes.energies(state.model.space, fields)
    return np.array(
        [
            _mode_gradient(state, energy, response.mode)
            if response.mode is not None
            else _response_gradient(state, slopes, energy, response, adjoint)
            for energy, response, (_, adjoint) in zip(energies, responses, fields, strict=True)
        ]
    )


def _fields(
    state: SolvedState, response: Response, adjoint: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    """Displacement and adjoint displacement of a response, or its mode's shape twice, (3, N)."""
    if response.mode is not None:
        return response.mode.shape, response.mode.shape
    if adjoint is None:
        raise ValueError(f"{response.name} has neither an adjoint solution nor a mode")
    return state.displacement(response.load_case), adjoint


def solve_adjoints(
    model: HomogenisedModel,
    system: ElasticSystem,
    responses: Sequence[Response],
    *,
    rtol: float = _RTOL,
) -> tuple[FloatArray | None, ...]:
    """Displacements ``(3, N)`` under the derivatives of responses as loads, supports at rest.

    None for a response that has none, but a mode. ``rtol``: residual over the loads.
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
    solutions = iter(solve_roughly(system, loads, rtol=rtol))
    return tuple(None if r.by_displacement is None else next(solutions) for r in responses)


def _response_gradient(
    state: SolvedState,
    slopes: StiffnessSlopes,
    energy: FloatArray,
    response: Response,
    adjoint: FloatArray,
) -> FloatArray:
    """Derivative of one response by every variable of the design, ``(P,)``, of its energies.

    ``dg/dp = lambda^T (df/dp - dK/dp u)``, with inertia and thermal loads in f, and what of the
    response depends on the design at fixed displacements.
    """
    model, case = state.model, case_named(state.model, response.load_case)
    whole = -energy
    if case.temperature_change:
        # The work of C alpha dT on the adjoint strain is that of alpha dT on its stress.
        expansion = model.material.thermal_expansion * case.temperature_change
        works = []
        for derivative in slopes:
            at_points = derivative
            if isinstance(derivative, MomentStiffness):
                at_points = gauss_equivalent(derivative)
            stress = element_stress(model.space, at_points, adjoint)
            works.append(model.volumes * expansion * np.trace(stress).mean(axis=-1))
        whole += np.concatenate(works)
    if np.any(case.acceleration):
        whole += force_slope(state, case, adjoint)
    return whole if response.by_design is None else whole + response.by_design


def _mode_gradient(state: SolvedState, stiffer: FloatArray, mode: ModeShape) -> FloatArray:
    """Derivative of a value that follows a frequency by every variable of the design, ``(P,)``.

    ``stiffer`` is ``x^T dK/dp x``.

    ``d omega^2/dp = x^T (dK/dp - omega^2 dM/dp) x / (x^T M x)``, where the last is one over omega^2
    as the shape is normalised (Wittrick, Proc. R. Soc. A 268, 1962; of equal frequencies only their
    sum has this derivative).
    """
    moved = squares_per_element(state.model.space, mode.shape) * state.model.volumes
    inertia = np.concatenate([moved * slope for slope in mass_slopes(state)])
    return mode.by_square * mode.square * (stiffer - mode.square * inertia)
