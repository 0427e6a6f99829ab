"""An assembled stiffness, ready for load cases."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

from scipy.sparse import bsr_matrix, spmatrix

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.errors import ResourceError, SolverError
from gradedesign.mechanics.fe.assembly import AssemblyPattern, assemble, assembly_pattern
from gradedesign.mechanics.fe.multigrid_solver import MULTIGRID
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.fe.stiffness import Stiffness, require_positive
from gradedesign.mechanics.solver.linear_solver import LinearSolver, Solve

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ElasticSystem:
    """A space and its assembled stiffness, ready for load cases."""

    space: TetSpace
    stiffness: Stiffness
    matrix: bsr_matrix  #: Without supports.
    solver: LinearSolver
    #: What solvers prepared, by their name and fixed components: later load cases find it here.
    prepared: dict[tuple[str, bytes], Solve] = field(default_factory=dict, repr=False)
    #: ``(3, N)``, mm. Displacements of similar problems: iterations start from their best
    #: combination.
    earlier: tuple[FloatArray, ...] = ()


def prepare_elastic(
    space: TetSpace,
    stiffness: Stiffness,
    *,
    solver: LinearSolver = MULTIGRID,
    pattern: AssemblyPattern | None = None,
    earlier: Sequence[FloatArray] = (),
) -> ElasticSystem:
    """Assemble a stiffness once for all load cases to come.

    Raises `SolverError` if a stiffness is not positive, and `ResourceError` if the space has more
    unknowns than the solver takes.

    ``solver``: what the system will be solved by. ``pattern``: of `space`, to save finding it
    again. ``earlier``, each ``(3, N)``, mm: displacements of similar problems, to start iterations
    from.
    """
    start = time.perf_counter()
    _require_room(space, solver)
    report_step(f"assembling {space.dof_count} unknowns")
    require_positive(stiffness)
    if solver.assemble is None:
        matrix = assemble(pattern or assembly_pattern(space), stiffness)
    else:
        matrix = _as_blocks(solver, solver.assemble(space, stiffness), space)
    log.info(
        "assembled %d unknowns on %d tets in %.2f s",
        space.dof_count, space.element_count, time.perf_counter() - start,
    )  # fmt: skip
    return ElasticSystem(
        space=space, stiffness=stiffness, matrix=matrix, solver=solver, earlier=tuple(earlier)
    )


def _require_room(space: TetSpace, solver: LinearSolver) -> None:
    """Refuse more unknowns than a solver takes."""
    if words := solver.refusal(space.dof_count):
        raise ResourceError(words)


def _as_blocks(solver: LinearSolver, matrix: spmatrix, space: TetSpace) -> bsr_matrix:
    """A matrix that a solver assembled, in 3 by 3 blocks."""
    if matrix.shape != (space.dof_count, space.dof_count):
        raise SolverError(
            f"solver '{solver.name}' assembled a matrix of shape {matrix.shape} for "
            f"{space.dof_count} unknowns"
        )
    blocks = bsr_matrix(matrix, blocksize=(3, 3))
    blocks.sort_indices()
    return blocks
