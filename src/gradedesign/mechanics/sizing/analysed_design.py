"""One design of sizing, solved for its limits, and the gradients of those in reach."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.mechanics.fe.elastic_system import ElasticSystem
from gradedesign.mechanics.limits.state import Response
from gradedesign.mechanics.sizing.homogenised import homogenised_system
from gradedesign.mechanics.sizing.members import with_members
from gradedesign.mechanics.sizing.problem import (
    SizingProblem,
    element_densities,
    element_shares,
)
from gradedesign.mechanics.sizing.responses import response_gradients, solve_adjoints
from gradedesign.mechanics.sizing.state import SolvedState, mode_shapes, solved_state

#: Residuals of the loads' and of the adjoint solves, over their loads: `bracket` passes the same
#: designs with 1e-4 and 1e-2, with members among cells and alone, since iterations start from the
#: designs before and what is left moves no limit.
_RTOL, _ADJOINT_RTOL = 1e-2, 1e-1
#: The same where modes are limits: the stress of the loads is the stiffness of load factors, and
#: with the residuals above the strongest column comes out 3 % off Keller's in places.
_MODES_RTOL, _MODES_ADJOINT_RTOL = 1e-4, 1e-2

#: Displacements under loads and adjoint loads, and modes, of the last designs.
Recent: TypeAlias = deque[tuple[FloatArray, ...]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SolvedDesign:
    """A design with the value of every limit."""

    system: ElasticSystem
    state: SolvedState
    utilisations: tuple[float, ...]  #: Of every limit.


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Governing:
    """Values of limits at the k points that govern them, as far as they are in reach."""

    limit: IntArray  #: ``(k,)``. Place of the limit in the problem.
    used: FloatArray  #: ``(k,)``. Utilisations.
    gradients: FloatArray  #: ``(k, P)``. Theirs by every variable of the design.


def solved_design(problem: SizingProblem, x: FloatArray, recent: Recent) -> SolvedDesign:
    """Solve design variables ``(n,)`` for every limit, from the displacements of other designs."""
    rho, share = element_densities(problem, x), element_shares(problem, x)
    model, limits = with_members(problem.model, share), problem.limits
    system = homogenised_system(model, rho, [u for design in recent for u in design])
    state = solved_state(
        model, rho, limits, system, share=share, lattice_alone=problem.model,
        rtol=_MODES_RTOL if _has_modes(problem) else _RTOL,
    )  # fmt: skip
    return SolvedDesign(
        system=system,
        state=state,
        utilisations=tuple(
            limit.utilisation(float(limit.predict(state).value)) for limit in limits
        ),
    )


def governing_values(problem: SizingProblem, design: SolvedDesign, recent: Recent) -> Governing:
    """Values and gradients of the limits in reach; ``recent`` receives what was solved for."""
    state, number = design.state, list[int]()
    responses, used, slopes = list[Response](), list[float](), list[float]()
    # No value of a limit is used more than its prediction: those out of reach need no derivative.
    for place in np.flatnonzero(_in_reach(np.array(design.utilisations))):
        limit = problem.limits[place]
        predicted = limit.responses(state)
        number += [int(place)] * len(predicted)
        responses += predicted
        used += [limit.utilisation(response.value) for response in predicted]
        slopes += [limit.utilisation_slope(response.value) for response in predicted]
    reach = _in_reach(np.array(used))
    near = [response for response, chosen in zip(responses, reach, strict=True) if chosen]
    adjoints = solve_adjoints(
        state.model, design.system, near,
        rtol=_MODES_ADJOINT_RTOL if _has_modes(problem) else _ADJOINT_RTOL,
    )  # fmt: skip
    gradients = response_gradients(state, near, adjoints) * np.array(slopes)[reach][:, None]
    known = [adjoint for adjoint in adjoints if adjoint is not None]
    recent.append((*state.displacements.values(), *known, *mode_shapes(state)))
    return Governing(
        limit=np.array(number, dtype=np.int64)[reach],
        used=np.array(used)[reach],
        gradients=gradients,
    )


def _has_modes(problem: SizingProblem) -> bool:
    return any(limit.mode() is not None for limit in problem.limits)


def _in_reach(utilisation: FloatArray) -> BoolArray:
    """Limits that one step can make active: used to a third of the most used one.

    Move limits of 30 % change a displacement by less than a factor of three.
    """
    return np.asarray(utilisation > utilisation.max(initial=0.0) / 3.0)
