"""Solve linear elasticity for several load cases, and check every answer.

Load cases with the same fixed components share one matrix and one multigrid hierarchy. Nothing is
accepted unchecked: rigid motions are looked for before, residual, balance of forces and moments,
and energy after.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

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
from gradedesign.fe.multigrid import Hierarchy, build_hierarchy, preconditioner
from gradedesign.fe.rigid_modes import require_held
from gradedesign.fe.solution import Balance, LoadVector, Solution
from gradedesign.fe.space import TetSpace
from gradedesign.fe.stiffness import Stiffness, require_positive
from gradedesign.workspace.progress import report_step, stepping

__all__ = [
    "Balance",
    "ElasticSystem",
    "LoadVector",
    "Solution",
    "predict_memory_bytes",
    "prepare_elastic",
    "solve_cases",
    "solve_elastic",
    "strain_energy_per_element",
]

log = logging.getLogger(__name__)

#: Unknowns below which a direct solver is at once faster and simpler.
SMALL = 3000
#: Iterations after which multigrid is given up; thin lattices take 50 to 70.
MAX_ITERATIONS = 300
#: Load cases iterated together: they share each pass over the matrix, and the vectors of one take
#: less than a tenth of its memory.
TOGETHER = 2
#: Rounding may leave the true residual this much above the tolerance; more is no convergence.
STALLED = 10.0
#: Tightening of the tolerance, and how often, where balance needs more than the residual asked.
TIGHTER, TIGHTENINGS = 1e-2, 2
#: Peak bytes per unknown by order, from benchmarks/bench_fe.py, with the mesh; plus a base.
BYTES_PER_UNKNOWN = {1: 2800, 2: 1750}
BASE_BYTES = 250_000_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ElasticSystem:
    """A space and its assembled stiffness, ready for load cases.

    Attributes
    ----------
    space : TetSpace
    stiffness : Stiffness
    matrix : bsr_matrix
        Without supports.
    hierarchies : dict
        Multigrid by fixed components, built when first needed: later load cases find it here.
    """

    space: TetSpace
    stiffness: Stiffness
    matrix: bsr_matrix
    hierarchies: dict[bytes, Hierarchy] = field(default_factory=dict, repr=False)


def prepare_elastic(
    space: TetSpace, stiffness: Stiffness, *, pattern: AssemblyPattern | None = None
) -> ElasticSystem:
    """Assemble a stiffness once for all load cases to come.

    Parameters
    ----------
    space : TetSpace
    stiffness : Stiffness
    pattern : AssemblyPattern, optional
        Of `space`, to save finding it again.

    Returns
    -------
    ElasticSystem

    Raises
    ------
    SolverError
        If a stiffness is not positive.
    """
    start = time.perf_counter()
    report_step(f"assembling {space.dof_count} unknowns")
    require_positive(stiffness)
    matrix = assemble(pattern or assembly_pattern(space), stiffness)
    log.info(
        "assembled %d unknowns on %d tets in %.2f s",
        space.dof_count, space.element_count, time.perf_counter() - start,
    )  # fmt: skip
    return ElasticSystem(space=space, stiffness=stiffness, matrix=matrix)


def solve_elastic(
    space: TetSpace,
    stiffness: Stiffness,
    cases: Sequence[LoadVector],
    *,
    rtol: float = 1e-8,
    pattern: AssemblyPattern | None = None,
) -> tuple[Solution, ...]:
    """Displacements, reactions and energy of every load case: `prepare_elastic`, `solve_cases`.

    Raises
    ------
    SolverError
        If supports leave rigid motions free, a stiffness is not positive, or no solver reaches a
        residual and balance of 1e-6.
    ResourceError
        If memory does not suffice.
    """
    _require_matching(space, cases, rtol)
    groups = _equal_supports(cases)
    _require_all_held(space, groups, cases)
    return _solve_groups(prepare_elastic(space, stiffness, pattern=pattern), cases, groups, rtol)


def solve_cases(
    system: ElasticSystem, cases: Sequence[LoadVector], *, rtol: float = 1e-8
) -> tuple[Solution, ...]:
    """Displacements, reactions and energy of every load case on a prepared system.

    Parameters
    ----------
    system : ElasticSystem
    cases : sequence of LoadVector
    rtol : float
        Residual at which conjugate gradients stop, over the right-hand side; tightened by itself
        where balance needs it.

    Returns
    -------
    tuple of Solution
        In the order of `cases`.

    Raises
    ------
    SolverError
        If supports leave rigid motions free, or no solver reaches a residual and balance of 1e-6.
    ResourceError
        If memory does not suffice.
    """
    _require_matching(system.space, cases, rtol)
    groups = _equal_supports(cases)
    fresh = {key: members for key, members in groups.items() if key not in system.hierarchies}
    _require_all_held(system.space, fresh, cases)
    return _solve_groups(system, cases, groups, rtol)


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


def _require_matching(space: TetSpace, cases: Sequence[LoadVector], rtol: float) -> None:
    """Refuse a tolerance out of range, and load cases of another space."""
    if not 0.0 < rtol <= ACCEPTED:
        raise SolverError(f"rtol is {rtol:g}, expected more than 0 and at most {ACCEPTED:g}")
    for case in cases:
        if case.force.shape != space.nodes.shape:
            raise SolverError(
                f"load case '{case.name}' is given for {case.force.shape[1]} nodes, but the "
                f"space has {space.node_count}"
            )


def _require_all_held(
    space: TetSpace, groups: Mapping[bytes, list[int]], cases: Sequence[LoadVector]
) -> None:
    """Refuse supports that leave rigid motions free."""
    for members in groups.values():
        require_held(space, cases[members[0]].supports.fixed, cases[members[0]].name)


def _equal_supports(cases: Sequence[LoadVector]) -> dict[bytes, list[int]]:
    """Indices of load cases, grouped by equal fixed components."""
    groups: dict[bytes, list[int]] = {}
    for k, case in enumerate(cases):
        groups.setdefault(np.packbits(case.supports.fixed).tobytes(), []).append(k)
    return groups


def _solve_groups(
    system: ElasticSystem,
    cases: Sequence[LoadVector],
    groups: Mapping[bytes, list[int]],
    rtol: float,
) -> tuple[Solution, ...]:
    """Solve checked load cases group by group."""
    start = time.perf_counter()
    solved: dict[int, Solution] = {}
    for key, members in groups.items():
        solutions = _solve_group(system, key, [cases[k] for k in members], rtol)
        solved.update(zip(members, solutions, strict=True))
    log.info("solved %d load cases in %.2f s", len(cases), time.perf_counter() - start)
    return tuple(solved[k] for k in range(len(cases)))


def _solve_group(
    system: ElasticSystem, key: bytes, cases: Sequence[LoadVector], rtol: float
) -> list[Solution]:
    """Solve load cases that share their fixed components."""
    fixed = cases[0].supports.fixed
    free = ~fixed.T.ravel()
    right = np.stack([free * right_hand_side(system.matrix, case) for case in cases])
    if np.count_nonzero(free) < SMALL:
        return _directly(system, cases, free, right, note="")
    if key not in system.hierarchies:
        report_step(f"multigrid of {right.shape[1]} unknowns")
        system.hierarchies[key] = build_hierarchy(
            system.space, system.stiffness, system.matrix, fixed
        )
    hierarchy = system.hierarchies[key]
    solutions = [
        solution
        for k in range(0, len(cases), TOGETHER)
        for solution in _by_multigrid(
            system, hierarchy, cases[k : k + TOGETHER], free, right[k : k + TOGETHER], rtol
        )
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
    system: ElasticSystem,
    hierarchy: Hierarchy,
    cases: Sequence[LoadVector],
    free: BoolArray,
    right: FloatArray,
    rtol: float,
) -> list[Solution]:
    """Iterate to the residual, and further while balance asks for it; the caller judges."""
    keep = free.astype(np.float64)
    x = np.zeros_like(right)
    done = np.zeros(len(cases), dtype=np.int64)
    found: dict[int, Solution] = {}
    open_cases = list(range(len(cases)))
    for tightening in range(1 + TIGHTENINGS):
        goal = rtol * TIGHTER**tightening
        names = dict.fromkeys(cases[k].name for k in open_cases)
        with stepping(f"solving {', '.join(names)}"):
            step = conjugate_gradients(
                system.matrix, keep, right[open_cases], preconditioner(hierarchy, len(open_cases)),
                rtol=goal, max_iterations=MAX_ITERATIONS - int(done[open_cases].max()),
                start=x[open_cases],
            )  # fmt: skip
        x[open_cases] = step.x
        done[open_cases] += step.iterations
        for k in open_cases:
            found[k] = evaluate(
                system.space, system.matrix, cases[k], x[k], right[k],
                iterations=int(done[k]), method="multigrid",
            )  # fmt: skip
        reached = step.residual <= STALLED * goal
        open_cases = [
            k for k, near in zip(open_cases, reached, strict=True) if near and defects(found[k])
        ]
        if not open_cases:
            break
    for k, case in enumerate(cases):
        log.info(
            "'%s': multigrid, %d iterations, residual %.1e",
            case.name, done[k], found[k].residual,
        )  # fmt: skip
    return [found[k] for k in range(len(cases))]


def _directly(
    system: ElasticSystem,
    cases: Sequence[LoadVector],
    free: BoolArray,
    right: FloatArray,
    note: str,
) -> list[Solution]:
    """Solve by factorisation; raise if an answer is not sound."""
    report_step(f"direct solution of {np.count_nonzero(free)} unknowns")
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
    system: ElasticSystem,
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
