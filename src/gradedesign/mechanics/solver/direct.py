"""The solver ``direct``: for small systems, and where multigrid does not converge.

Pardiso (extra ``fast``) takes symmetric positive definite systems of any size that fits memory;
SuperLU, which comes with scipy, is reasonable below about 60 000 unknowns only.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix, triu
from scipy.sparse.linalg import splu

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.common.system.limits import available_memory_bytes
from gradedesign.common.system.progress import report_step
from gradedesign.errors import ResourceError, SolverError
from gradedesign.mechanics.solver.linear_solver import (
    LinearAnswer,
    LinearSolver,
    LinearSystem,
    Solve,
)

log = logging.getLogger(__name__)

#: Unknowns above which SuperLU takes minutes and gigabytes (25 s and 2.6 GiB at 56 000).
SUPERLU_LIMIT = 60_000
#: Share of the memory left that a factorisation may fill. Chosen, not measured.
_MEMORY_SHARE = 0.9
#: Error codes of Pardiso that mean a zero or negative pivot.
_PIVOT_ERROR = -4


def direct_method(unknowns: int) -> str | None:
    """Name the direct solver for a number of unknowns; None if there is none fit for it."""
    if _pardiso() is not None:
        return "pardiso"
    return "superlu" if unknowns <= SUPERLU_LIMIT else None


def solve_direct(matrix: bsr_matrix, keep: BoolArray, right: FloatArray) -> tuple[FloatArray, str]:
    """Solve for the unknowns to keep, for several right-hand sides at once.

    Raises `SolverError` if the system is not positive definite, or too large for the solvers
    installed, and `ResourceError` if the factors do not fit the memory left. Returns ``x (k, n)``;
    ``method``: ``"pardiso"`` or ``"superlu"``.

    ``matrix``: ``(n, n)``, without supports. ``keep (n,)``: unknowns to solve for; the others are
    zero in the result. ``right (k, n)``.
    """
    x = np.zeros_like(right)
    free = np.flatnonzero(keep)
    method = direct_method(free.size)
    if method is None:
        raise SolverError(
            f"{free.size} unknowns are too many for SuperLU (at most {SUPERLU_LIMIT}); install "
            f"the extra 'fast' (pypardiso) for a direct solver, or improve the mesh"
        )
    if free.size == 0:
        return x, method
    reduced = matrix.tocsr()[free][:, free]
    reduced.sort_indices()
    factorised = _factorised_pardiso if method == "pardiso" else _factorised_superlu
    with factorised(reduced) as solve:
        for k, f in enumerate(right):
            x[k, free] = _refined(reduced, solve, f[free])
    log.info("%s solved %d unknowns for %d load cases", method, free.size, len(right))
    return x, method


def _refined(
    matrix: csr_matrix, solve: Callable[[FloatArray], FloatArray], f: FloatArray
) -> FloatArray:
    """Solve, with one step of iterative refinement."""
    x = solve(f)
    return x + solve(f - matrix @ x)


@contextmanager
def _factorised_superlu(matrix: csr_matrix) -> Iterator[Callable[[FloatArray], FloatArray]]:
    """Factorise by SuperLU in its symmetric mode."""
    try:
        factor = splu(
            matrix.tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError as error:
        raise SolverError(_singular(matrix)) from error
    yield factor.solve


@contextmanager
def _factorised_pardiso(matrix: csr_matrix) -> Iterator[Callable[[FloatArray], FloatArray]]:
    """Factorise by Pardiso as symmetric positive definite, and give its memory back."""
    pardiso = _pardiso()
    solver = pardiso.PyPardisoSolver(mtype=2)
    upper = triu(matrix, format="csr")
    upper.sort_indices()

    def call(phase: int, f: FloatArray) -> FloatArray:
        # The wrapper's own factorize() copies the matrix and hides the analysis; the phases of
        # Pardiso are 11 analyse, 22 factorise, 33 solve.
        solver.set_phase(phase)
        x: FloatArray = solver._call_pardiso(upper, f)
        return x

    nothing = np.zeros(matrix.shape[0])
    try:
        call(11, nothing)
        _require_memory(solver, matrix.shape[0])
        call(22, nothing)
        yield lambda f: call(33, np.ascontiguousarray(f))
    except pardiso.pardiso_wrapper.PyPardisoError as error:
        if error.value == _PIVOT_ERROR:
            raise SolverError(_singular(matrix)) from error
        raise SolverError(
            f"Pardiso failed with error {error.value} on {matrix.shape[0]} unknowns; "
            f"-2 means not enough memory"
        ) from error
    finally:
        solver.free_memory(everything=True)


def _require_memory(solver: Any, unknowns: int) -> None:
    """Raise unless the factors announced by Pardiso's analysis fit the memory left."""
    kibibytes = max(
        int(solver.get_iparm(15)), int(solver.get_iparm(16)) + int(solver.get_iparm(17))
    )
    need, available = 1024 * kibibytes, available_memory_bytes()
    if need > _MEMORY_SHARE * available:
        raise ResourceError(
            f"the direct factorisation of {unknowns} unknowns needs {need / 2**30:.2f} GiB, but "
            f"{available / 2**30:.2f} GiB are left; use a coarser mesh or a larger machine"
        )


def _singular(matrix: csr_matrix) -> str:
    """Message for a matrix that is not positive definite."""
    return (
        f"the stiffness of {matrix.shape[0]} free unknowns is not positive definite; some part "
        f"of the mesh can still move without strain, such as a piece hanging on one edge or node"
    )


def _pardiso() -> Any:
    """The module pypardiso, or None if it or its library is not there."""
    try:
        import pypardiso
    except ImportError:
        return None
    return pypardiso


def _prepare_direct(system: LinearSystem) -> Solve:
    """Factorise anew for each set of right-hand sides: factors take more memory than time."""

    def solve(right: FloatArray, _start: FloatArray, _rtol: float) -> LinearAnswer:
        report_step(f"direct solution of {np.count_nonzero(system.free)} unknowns")
        x, method = solve_direct(system.matrix, system.free, right)
        return LinearAnswer(x=x, method=method)

    return solve


DIRECT = LinearSolver(
    name="direct",
    prepare=_prepare_direct,
    # Whether it loads tells only the first solution; a broken one is refused there.
    most_unknowns=None if find_spec("pypardiso") else SUPERLU_LIMIT,
)
