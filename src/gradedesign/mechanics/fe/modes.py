"""Modes of a part on tetrahedra: natural vibrations about its supports, and buckling under loads.

Natural frequencies are undamped and without prestress: neither loads nor prescribed displacements
change the stiffness. Buckling is linear: displacements and stress grow with the loads until the
stress takes all stiffness off some shape, ``K x = factor (-K_stress) x`` (Zienkiewicz and Taylor,
The Finite Element Method, 5th ed., vol. 2, section 11.4).
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.common.system.progress import stepping
from gradedesign.mechanics.fe.assembly import matvec
from gradedesign.mechanics.fe.elastic_system import ElasticSystem
from gradedesign.mechanics.fe.free_pieces import require_held
from gradedesign.mechanics.fe.geometric_stiffness import geometric_stiffness
from gradedesign.mechanics.fe.mass import mass_product
from gradedesign.mechanics.fe.solve import prepared_solve
from gradedesign.mechanics.solver.lowest_modes import (
    GUARD,
    LEAST_BLOCK,
    ModeProblem,
    Modes,
    lowest_factors,
    lowest_modes,
)

log = logging.getLogger(__name__)

#: Residual to which the solver is a preconditioner: some two to four cycles of multigrid. Chosen,
#: not measured.
_ROUGHLY = 0.1
#: Residual of modes whose values alone are looked for: the error of a frequency is half its square,
#: that of a load factor its square, over the relative distance to the next one.
_FOUND = 1e-4

_Product: TypeAlias = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeGoal:
    """A value of a mode that an analysis is to find."""

    load_case: str  #: Whose supports hold the part, and whose loads make it buckle.
    number: int  #: Counted from 1, the lowest.
    #: The value is the factor of the loads at which the part buckles, else a natural frequency.
    buckling: bool = False

    @property
    def room(self) -> int:
        """Number of natural modes that take as much memory: matrices of buckling count as one."""
        return LEAST_BLOCK - GUARD + 1 if self.buckling else self.number


def highest_mode(goals: Iterable[ModeGoal]) -> int:
    """Greatest number of any goal; 0 without any."""
    return max((goal.number for goal in goals), default=0)


def mode_room(goals: Iterable[ModeGoal]) -> int:
    """Number of natural modes that take as much memory as any goal; 0 without any."""
    return max((goal.room for goal in goals), default=0)


def natural_modes(
    system: ElasticSystem,
    fixed: BoolArray,
    masses: FloatArray,
    count: int,
    *,
    rtol: float,
    name: str,
) -> Modes:
    """Lowest natural modes of a prepared system, shapes by ``3 * node + component``.

    Raises `SolverError` if supports leave rigid motions free, or the iteration does not converge.

    - ``fixed (3, N)``: held components
    - ``masses (M,)``, t: of the tetrahedra
    - ``rtol``: see `lowest_modes`
    - ``name``: of the load case that holds the part
    """
    began = time.perf_counter()
    space = system.space
    problem = _problem(system, fixed, name, lambda x: mass_product(space, masses, x))
    with stepping(f"natural frequencies of {name}"):
        modes = lowest_modes(problem, count, rtol=rtol, name=name)
    log.info(
        "'%s': %d natural frequencies from %.4g Hz, %d iterations in %.2f s",
        name, count, modes.frequencies[0], modes.iterations, time.perf_counter() - began,
    )  # fmt: skip
    return modes


def buckling_modes(
    system: ElasticSystem,
    fixed: BoolArray,
    stress: FloatArray,
    count: int,
    *,
    rtol: float,
    name: str,
) -> Modes:
    """Lowest modes in which a prepared system buckles; their values are factors of its loads.

    Raises `SolverError` if supports leave rigid motions free, nothing is compressed, or the
    iteration does not converge.

    - ``fixed (3, N)``: held components
    - ``stress (3, 3, M, 4)``, MPa: of the loads, at the Gauss points
    - ``rtol``: see `lowest_modes`
    - ``name``: of the load case
    """
    began = time.perf_counter()
    geometric = geometric_stiffness(system.space, stress)

    def taken_off(x: FloatArray) -> FloatArray:
        return np.asarray(-(geometric @ x.reshape(-1, 3)).ravel())

    problem = _problem(system, fixed, name, taken_off)
    with stepping(f"buckling under {name}"):
        modes = lowest_factors(problem, count, rtol=rtol, name=name)
    log.info(
        "'%s': %d load factors from %.4g, %d iterations in %.2f s",
        name, modes.values.size, modes.values[0], modes.iterations, time.perf_counter() - began,
    )  # fmt: skip
    return modes


def _problem(system: ElasticSystem, fixed: BoolArray, name: str, mass: _Product) -> ModeProblem:
    """Modes of a held system, of a mass that is given for all displacements."""
    require_held(system.space, fixed, name)
    solve = prepared_solve(system, fixed)
    free = (~fixed).T.ravel().astype(np.float64)

    def stiffness(x: FloatArray) -> FloatArray:
        return free * np.asarray(matvec(system.matrix, x.reshape(-1, 3).T)).T.ravel()

    def precondition(forces: FloatArray) -> FloatArray:
        return np.asarray(solve(forces, np.zeros_like(forces), _ROUGHLY).x)

    return ModeProblem(
        stiffness=stiffness,
        mass=lambda x: free * mass(x),
        precondition=precondition,
        start=[free * np.ascontiguousarray(u.T).ravel() for u in _first_guesses(system)],
    )


def found_modes(
    system: ElasticSystem,
    held: Mapping[str, BoolArray],
    masses: FloatArray,
    stress: Callable[[str], FloatArray],
    goals: Mapping[Hashable, ModeGoal],
) -> dict[Hashable, float]:
    """Natural frequencies, Hz, and load factors by the keys of goals.

    Raises `SolverError` as `natural_modes` and `buckling_modes`.

    ``held``: by load case, each ``(3, N)``; components that its supports hold. ``masses (M,)``, t.
    ``stress``: load case to its stress at the Gauss points, ``(3, 3, M, 4)``, MPa.
    """
    found: dict[Hashable, float] = {}
    for name, buckling in dict.fromkeys((g.load_case, g.buckling) for g in goals.values()):
        own = {
            key: goal
            for key, goal in goals.items()
            if (goal.load_case, goal.buckling) == (name, buckling)
        }
        count, fixed = highest_mode(own.values()), held[name]
        if buckling:
            modes = buckling_modes(system, fixed, stress(name), count, rtol=_FOUND, name=name)
            values = modes.values
        else:
            modes = natural_modes(system, fixed, masses, count, rtol=_FOUND, name=name)
            values = modes.frequencies
        found |= {key: float(values[goal.number - 1]) for key, goal in own.items()}
    return found


def _first_guesses(system: ElasticSystem) -> list[FloatArray]:
    """Displacements of similar problems, or else motions that are linear in place, (3, N)."""
    if system.earlier:
        return list(system.earlier)
    nodes = system.space.nodes
    centred = nodes - nodes.mean(axis=1, keepdims=True)
    fields = [np.ones(nodes.shape[1]), *centred]
    return [axis[:, None] * field for axis in np.eye(3) for field in fields]
