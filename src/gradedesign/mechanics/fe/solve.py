"""Solve linear elasticity for several load cases, and check every answer.

Load cases with the same fixed components share one matrix and its preconditioner or factors.
Whatever solver it is, nothing is accepted unchecked: rigid motions are looked for before, residual,
balance of forces and moments, and energy after.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.common.system.progress import stepping
from gradedesign.common.values.suggest import listed
from gradedesign.errors import ResourceError, SolverError
from gradedesign.mechanics.fe.assembly import matvec
from gradedesign.mechanics.fe.elastic_system import ElasticSystem, prepare_elastic
from gradedesign.mechanics.fe.equilibrium import ACCEPTED, defects, evaluate, right_hand_side
from gradedesign.mechanics.fe.free_pieces import require_held
from gradedesign.mechanics.fe.multigrid_solver import MULTIGRID
from gradedesign.mechanics.fe.solution import LoadVector, Solution
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.fe.stiffness import Stiffness
from gradedesign.mechanics.solver.galerkin_start import galerkin_start
from gradedesign.mechanics.solver.linear_solver import (
    LinearAnswer,
    LinearSolver,
    LinearSystem,
    Solve,
)

log = logging.getLogger(__name__)

#: Rounding may leave the true residual this much above the tolerance; more is no convergence.
_STALLED = 10.0
#: Factor on the tolerance, and how often it is applied, where equilibrium needs a smaller residual.
#: Chosen, not measured.
_TIGHTER, _TIGHTENINGS = 1e-2, 2
#: Peak bytes per unknown by order, from benchmarks/bench_fe.py, with the mesh; plus a base.
BYTES_PER_UNKNOWN = {1: 2800, 2: 1750}
#: The base: what a process takes however small its mesh is, from the same runs.
BASE_BYTES = 250_000_000


def solve_elastic(
    space: TetSpace,
    stiffness: Stiffness,
    cases: Sequence[LoadVector],
    *,
    rtol: float = 1e-8,
    solver: LinearSolver = MULTIGRID,
) -> tuple[Solution, ...]:
    """Displacements, reactions and energy of every load case: `prepare_elastic`, `solve_cases`.

    Raises `SolverError` if supports leave rigid motions free, a stiffness is not positive, or the
    solver does not reach a residual and balance of 1e-6, and `ResourceError` if memory does not
    suffice, or the solver does not take as many unknowns.
    """
    _require_matching(space, cases, rtol)
    groups = _equal_supports(cases)
    _require_all_held(space, groups, cases)
    return _solve_groups(prepare_elastic(space, stiffness, solver=solver), cases, groups, rtol)


def solve_cases(
    system: ElasticSystem, cases: Sequence[LoadVector], *, rtol: float = 1e-8
) -> tuple[Solution, ...]:
    """Displacements, reactions and energy of every load case on a prepared system.

    Raises `SolverError` if supports leave rigid motions free, or the solver does not reach a
    residual and balance of 1e-6, and `ResourceError` if memory does not suffice.

    ``rtol``: residual at which a solver may stop, over the right-hand side; tightened by itself
    where balance needs it.

    Returns
    -------
    tuple of Solution
        In the order of `cases`.
    """
    _require_matching(system.space, cases, rtol)
    groups = _equal_supports(cases)
    prepared_keys = {key for _, key in system.prepared}
    fresh = {key: members for key, members in groups.items() if key not in prepared_keys}
    _require_all_held(system.space, fresh, cases)
    return _solve_groups(system, cases, groups, rtol)


def solve_roughly(
    system: ElasticSystem, cases: Sequence[LoadVector], *, rtol: float
) -> list[FloatArray]:
    """Displacements ``(3, N)`` to a residual alone, without balance.

    For loads of which nothing but the displacements is asked, and these to some digits, such as
    those of adjoint problems. What does not reach ten times the residual goes through
    `solve_cases`.

    Parameters
    ----------
    rtol : float
        Residual over the right-hand side.
    """
    found: dict[int, FloatArray] = {}
    for key, members in _equal_supports(cases).items():
        fixed = cases[members[0]].supports.fixed
        free = ~fixed.T.ravel()
        right = np.stack([free * right_hand_side(system.matrix, cases[k]) for k in members])
        solver = _for_size(system.solver, int(np.count_nonzero(free)))
        start = galerkin_start(system.matrix, free, right, system.earlier)
        with stepping(f"solving {listed(dict.fromkeys(cases[k].name for k in members), 2)}"):
            answer = _prepared(system, solver, key, fixed)(right, start, rtol)
        _require_answer(solver, answer, right.shape)
        for k, x, force in zip(members, answer.x, right, strict=True):
            moved = np.ascontiguousarray(x.reshape(-1, 3).T)
            left = force - free * matvec(system.matrix, moved).T.ravel()
            found[k] = moved + cases[k].supports.value
            if not np.linalg.norm(left) <= _STALLED * rtol * np.linalg.norm(force):
                found[k] = solve_cases(system, [cases[k]], rtol=ACCEPTED)[0].displacement
    return [found[k] for k in range(len(cases))]


def prepared_solve(system: ElasticSystem, fixed: BoolArray) -> Solve:
    """The solver of a system for held components ``(3, N)``; its answers are not checked."""
    solver = _for_size(system.solver, int(np.count_nonzero(~fixed)))
    return _prepared(system, solver, _support_key(fixed), fixed)


def predict_memory_bytes(unknowns: int, order: int = 2) -> int:
    """Predict the peak memory of a solve by multigrid, mesh and matrix included.

    ``unknowns``: three per node. ``order``: 1 or 2.
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
        groups.setdefault(_support_key(case.supports.fixed), []).append(k)
    return groups


def _support_key(fixed: BoolArray) -> bytes:
    """Held components ``(3, N)`` as a key."""
    return np.packbits(fixed).tobytes()


def _for_size(solver: LinearSolver, free: int) -> LinearSolver:
    """The solver, or the one that solves as few free unknowns."""
    return solver.other if solver.other is not None and free < solver.least_unknowns else solver


def _prepared(system: ElasticSystem, solver: LinearSolver, key: bytes, fixed: BoolArray) -> Solve:
    """The solver prepared for held components ``(3, N)``, once a system."""
    if (solver.name, key) not in system.prepared:
        system.prepared[solver.name, key] = solver.prepare(
            LinearSystem(
                matrix=system.matrix,
                fixed=fixed,
                space=system.space,
                stiffness=system.stiffness,
            )
        )
    return system.prepared[solver.name, key]


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
    free = ~cases[0].supports.fixed.T.ravel()
    right = np.stack([free * right_hand_side(system.matrix, case) for case in cases])
    solver = _for_size(system.solver, int(np.count_nonzero(free)))
    solutions = _iterated(system, solver, key, cases, right, rtol)
    if solver.other is None:
        _require_sound(solutions)
        return solutions
    poor = [k for k, s in enumerate(solutions) if s.residual > _STALLED * rtol or defects(s)]
    if poor:
        replaced = _solve_by_other(
            system, solver.other, key, [cases[k] for k in poor], right[poor],
            [solutions[k] for k in poor], rtol,
        )  # fmt: skip
        for k, solution in zip(poor, replaced, strict=True):
            solutions[k] = solution
    return solutions


def _iterated(
    system: ElasticSystem,
    solver: LinearSolver,
    key: bytes,
    cases: Sequence[LoadVector],
    right: FloatArray,
    rtol: float,
) -> list[Solution]:
    """Solve to the residual, and further where equilibrium needs it; the caller checks it."""
    solve = _prepared(system, solver, key, cases[0].supports.fixed)
    free = ~cases[0].supports.fixed.T.ravel()
    x = galerkin_start(system.matrix, free, right, system.earlier)
    done = np.zeros(len(cases), dtype=np.int64)
    solved: dict[int, Solution] = {}
    open_cases = list(range(len(cases)))
    for tightening in range(1 + _TIGHTENINGS):
        goal = rtol * _TIGHTER**tightening
        with stepping(f"solving {listed(dict.fromkeys(cases[k].name for k in open_cases), 2)}"):
            answer = solve(right[open_cases], x[open_cases], goal)
        _require_answer(solver, answer, (len(open_cases), right.shape[1]))
        x[open_cases] = answer.x
        if answer.iterations is not None:
            done[open_cases] += answer.iterations
        for k in open_cases:
            solved[k] = evaluate(
                system.space, system.matrix, cases[k], x[k], right[k],
                iterations=int(done[k]), method=answer.method or solver.name,
            )  # fmt: skip
        open_cases = [
            k for k in open_cases if solved[k].residual <= _STALLED * goal and defects(solved[k])
        ]
        if not open_cases or answer.iterations is None:
            break
    for k, case in enumerate(cases):
        log.info(
            "'%s': %s, %d iterations, residual %.1e",
            case.name, solved[k].method, done[k], solved[k].residual,
        )  # fmt: skip
    return [solved[k] for k in range(len(cases))]


def _solve_by_other(
    system: ElasticSystem,
    solver: LinearSolver,
    key: bytes,
    cases: Sequence[LoadVector],
    right: FloatArray,
    stopped: Sequence[Solution],
    rtol: float,
) -> list[Solution]:
    """Solve the cases in which a solver stopped by another one; keep its solutions if sound."""
    worst = max(stopped, key=lambda s: s.residual)
    first = worst.method
    log.warning(
        "'%s': %s stopped after %d iterations at residual %.1e; trying a %s solver",
        worst.name, first, worst.iterations, worst.residual, solver.name,
    )  # fmt: skip
    try:
        solutions = _iterated(system, solver, key, cases, right, rtol)
        _require_sound(solutions)
    except (SolverError, ResourceError) as error:
        unsound = [s for s in stopped if defects(s)]
        if unsound:
            raise type(error)(
                f"load case '{unsound[0].name}': {first} stopped after "
                f"{unsound[0].iterations} iterations: {defects(unsound[0])}; {solver.name} "
                f"solver: {error}"
            ) from error
        log.warning("kept the answers of %s; %s solver: %s", first, solver.name, error)
        return [replace(s, method=f"{first} (stopped at {s.residual:.1e})") for s in stopped]
    note = f" ({first} stopped at residual {worst.residual:.1e})"
    return [replace(s, method=s.method + note) for s in solutions]


def _require_sound(solutions: Sequence[Solution]) -> None:
    """Refuse answers that do not balance."""
    for solution in solutions:
        violations = defects(solution)
        if violations:
            after = f" in {solution.iterations} iterations" if solution.iterations else ""
            raise SolverError(
                f"load case '{solution.name}', solved by {solution.method}{after}: {violations}"
            )


def _require_answer(solver: LinearSolver, answer: LinearAnswer, shape: tuple[int, int]) -> None:
    """Refuse an answer that does not have the shape of the right-hand sides."""
    answer_shape = answer.x.shape if isinstance(answer, LinearAnswer) else type(answer).__name__
    if answer_shape != shape:
        raise SolverError(
            f"solver '{solver.name}' returned {answer_shape}, expected a LinearAnswer whose x has "
            f"shape {shape}, as the right-hand sides"
        )
