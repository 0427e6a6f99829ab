"""Solve linear elasticity for several load cases, and check every answer.

Load cases with the same fixed components share one matrix and one multigrid hierarchy. Nothing is
accepted unchecked: rigid motions are looked for before, residual, balance of forces and moments,
and energy after.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import bsr_matrix

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.errors import ResourceError, SolverError
from gradedesign.fe.assembly import (
    AssemblyPattern,
    assemble,
    assembly_pattern,
    strain_energy_per_element,
)
from gradedesign.fe.conjugate_gradients import conjugate_gradients
from gradedesign.fe.direct import solve_direct
from gradedesign.fe.equilibrium import ACCEPTED, defects, evaluate, right_hand_side
from gradedesign.fe.multigrid import build_hierarchy, preconditioner
from gradedesign.fe.rigid_modes import require_held
from gradedesign.fe.solution import Balance, LoadVector, Solution
from gradedesign.fe.space import TetSpace
from gradedesign.fe.stiffness import Stiffness, require_positive

__all__ = [
    "Balance",
    "LoadVector",
    "Solution",
    "predict_memory_bytes",
    "solve_elastic",
    "strain_energy_per_element",
]

log = logging.getLogger(__name__)

#: Unknowns below which a direct solver is at once faster and simpler.
SMALL = 3000
#: Iterations after which multigrid is given up; thin lattices take 50 to 70.
MAX_ITERATIONS = 300
#: Rounding may leave the true residual this much above the tolerance; more is no convergence.
STALLED = 10.0
#: Tightening of the tolerance, and how often, where balance needs more than the residual asked.
TIGHTER, TIGHTENINGS = 1e-2, 2
#: Peak bytes per unknown by order, from benchmarks/bench_fe.py, with the mesh; plus a base.
BYTES_PER_UNKNOWN = {1: 2800, 2: 1750}
BASE_BYTES = 250_000_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _System:
    """A space and its assembled stiffness."""

    space: TetSpace
    matrix: bsr_matrix


def solve_elastic(
    space: TetSpace,
    stiffness: Stiffness,
    cases: Sequence[LoadVector],
    *,
    rtol: float = 1e-8,
    pattern: AssemblyPattern | None = None,
) -> tuple[Solution, ...]:
    """Displacements, reactions and energy of every load case.

    Parameters
    ----------
    space : TetSpace
    stiffness : IsotropicStiffness or AnisotropicStiffness
    cases : sequence of LoadVector
    rtol : float
        Residual at which conjugate gradients stop, over the right-hand side; tightened by itself
        where balance needs it.
    pattern : AssemblyPattern, optional
        Of `space`, to save finding it again.

    Returns
    -------
    tuple of Solution
        In the order of `cases`.

    Raises
    ------
    SolverError
        If supports leave rigid motions free, a stiffness is not positive, or no solver reaches a
        residual and balance of 1e-6.
    ResourceError
        If memory does not suffice.
    """
    start = time.perf_counter()
    if not 0.0 < rtol <= ACCEPTED:
        raise SolverError(f"rtol is {rtol:g}, expected more than 0 and at most {ACCEPTED:g}")
    for case in cases:
        if case.force.shape != space.nodes.shape:
            raise SolverError(
                f"load case '{case.name}' is given for {case.force.shape[1]} nodes, but the "
                f"space has {space.node_count}"
            )
    require_positive(stiffness)
    groups = _equal_supports(cases)
    for members in groups:
        require_held(space, cases[members[0]].supports.fixed, cases[members[0]].name)
    matrix = assemble(pattern or assembly_pattern(space), stiffness)
    log.info(
        "assembled %d unknowns on %d tets in %.2f s",
        space.dof_count, space.element_count, time.perf_counter() - start,
    )  # fmt: skip
    system = _System(space=space, matrix=matrix)
    solved: dict[int, Solution] = {}
    for members in groups:
        solutions = _solve_group(system, stiffness, [cases[k] for k in members], rtol)
        solved.update(zip(members, solutions, strict=True))
    log.info("solved %d load cases in %.2f s", len(cases), time.perf_counter() - start)
    return tuple(solved[k] for k in range(len(cases)))


def predict_memory_bytes(unknowns: int, order: int = 2) -> int:
    """Predict the peak memory of a solve by multigrid, mesh and matrix included.

    Parameters
    ----------
    unknowns : int
        Three per node.
    order : int
        1 or 2.
    """
    return BASE_BYTES + BYTES_PER_UNKNOWN[order] * unknowns


def _equal_supports(cases: Sequence[LoadVector]) -> list[list[int]]:
    """Indices of load cases, grouped by equal fixed components."""
    groups: dict[bytes, list[int]] = {}
    for k, case in enumerate(cases):
        groups.setdefault(np.packbits(case.supports.fixed).tobytes(), []).append(k)
    return list(groups.values())


def _solve_group(
    system: _System, stiffness: Stiffness, cases: Sequence[LoadVector], rtol: float
) -> list[Solution]:
    """Solve load cases that share their fixed components."""
    fixed = cases[0].supports.fixed
    free = ~fixed.T.ravel()
    right = np.stack([free * right_hand_side(system.matrix, case) for case in cases])
    if np.count_nonzero(free) < SMALL:
        return _directly(system, cases, free, right, note="")
    hierarchy = build_hierarchy(system.space, stiffness, system.matrix, fixed)
    precondition = preconditioner(hierarchy)
    solutions = [
        _by_multigrid(system, case, free, f, precondition, rtol)
        for case, f in zip(cases, right, strict=True)
    ]
    poor = [k for k, s in enumerate(solutions) if s.residual > STALLED * rtol or defects(s)]
    if poor:
        replaced = _instead(
            system, [cases[k] for k in poor], free, right[poor], [solutions[k] for k in poor]
        )
        for k, solution in zip(poor, replaced, strict=True):
            solutions[k] = solution
    return solutions


def _by_multigrid(
    system: _System,
    case: LoadVector,
    free: BoolArray,
    right: FloatArray,
    precondition: Callable[[FloatArray], FloatArray],
    rtol: float,
) -> Solution:
    """Iterate to the residual, and further while balance asks for it; the caller judges."""
    x: FloatArray | None = None
    done = 0
    keep = free.astype(np.float64)
    for tightening in range(1 + TIGHTENINGS):
        goal = rtol * TIGHTER**tightening
        step = conjugate_gradients(
            system.matrix, keep, right, precondition,
            rtol=goal, max_iterations=MAX_ITERATIONS - done, start=x,
        )  # fmt: skip
        x = step.x
        done += step.iterations
        solution = evaluate(
            system.space, system.matrix, case, x, right, iterations=done, method="multigrid"
        )
        if step.residual > STALLED * goal or not defects(solution):
            break
    log.info("'%s': multigrid, %d iterations, residual %.1e", case.name, done, solution.residual)
    return solution


def _directly(
    system: _System, cases: Sequence[LoadVector], free: BoolArray, right: FloatArray, note: str
) -> list[Solution]:
    """Solve by factorisation; raise if an answer is not sound."""
    x, method = solve_direct(system.matrix, free, right)
    solutions = [
        evaluate(
            system.space, system.matrix, case, x[k], right[k], iterations=0, method=method + note
        )
        for k, case in enumerate(cases)
    ]
    for solution in solutions:
        found = defects(solution)
        if found:
            raise SolverError(f"load case '{solution.name}', solved by {method}: {found}")
    return solutions


def _instead(
    system: _System,
    cases: Sequence[LoadVector],
    free: BoolArray,
    right: FloatArray,
    stopped: Sequence[Solution],
) -> list[Solution]:
    """Solve directly what multigrid did not; keep its answers if they are good enough."""
    worst = max(stopped, key=lambda s: s.residual)
    note = f" (multigrid stopped at residual {worst.residual:.1e})"
    log.warning(
        "'%s': multigrid stopped after %d iterations at residual %.1e; trying a direct solver",
        worst.name, worst.iterations, worst.residual,
    )  # fmt: skip
    try:
        return _directly(system, cases, free, right, note)
    except (SolverError, ResourceError) as error:
        unsound = [s for s in stopped if defects(s)]
        if unsound:
            raise type(error)(
                f"load case '{unsound[0].name}': multigrid stopped after "
                f"{unsound[0].iterations} iterations: {defects(unsound[0])}; direct solver: "
                f"{error}"
            ) from error
        log.warning("kept the answers of multigrid; direct solver: %s", error)
        return [replace(s, method=f"multigrid (stopped at {s.residual:.1e})") for s in stopped]
