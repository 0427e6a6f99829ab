"""One MPI rank: reads its rows, solves every right-hand side; rank 0 writes the answers.

Run by a Python of its own with nothing but petsc4py and numpy: ``FOLDER RTOL``.
"""

from __future__ import annotations

import os
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np

#: Iterations after which it is given up.
_MOST_ITERATIONS = 1000


def main(folder: Path, rtol: float) -> None:
    """Solve what lies in the folder."""
    import petsc4py

    petsc4py.init([])
    from petsc4py import PETSc

    world = PETSc.COMM_WORLD
    if world.rank == 0:
        threading.Thread(target=_end_with_parent, daemon=True).start()
    matrix, first, last = _matrix(PETSc, folder)
    fixed = np.load(folder / "fixed.npy", mmap_mode="r")
    rows = np.flatnonzero(fixed[first:last]).astype(PETSc.IntType) + first
    diagonal = matrix.getDiagonal()
    matrix.zeroRowsColumns(rows, diag=diagonal.sum() / diagonal.getSize())
    matrix.setNearNullSpace(_rigid_motions(PETSc, folder, fixed, first, last))
    solver = _solver(PETSc, matrix, rtol)
    right = np.load(folder / "right.npy", mmap_mode="r")
    start = np.load(folder / "start.npy", mmap_mode="r")
    answers, counts = [], []
    for force, guess in zip(right, start, strict=True):
        b, x = matrix.createVecRight(), matrix.createVecRight()
        b.array[:], x.array[:] = force[first:last], guess[first:last]
        solver.solve(b, x)
        if solver.getConvergedReason() <= 0:
            sys.exit(f"not converged in {solver.getIterationNumber()} iterations: "
                     f"reason {solver.getConvergedReason()} of KSPConvergedReason")  # fmt: skip
        scatter, whole = PETSc.Scatter.toZero(x)
        scatter.scatter(x, whole, mode=PETSc.ScatterMode.FORWARD)
        answers.append(np.array(whole.array))
        counts.append(solver.getIterationNumber())
    if world.rank == 0:
        np.save(folder / "x.npy", np.array(answers))
        np.save(folder / "iterations.npy", np.array(counts, dtype=np.int64))
    world.barrier()


def _end_with_parent() -> None:
    """End when standard input closes: who started the ranks is gone."""
    # Unbuffered: a buffer's lock, held for ever, would break the end of the interpreter.
    while os.read(0, 1):
        pass
    os._exit(1)


def _matrix(PETSc: Any, folder: Path) -> tuple[Any, int, int]:
    """Rows of the stiffness that are this rank's, their first and the first of the next rank."""
    indptr = np.load(folder / "indptr.npy", mmap_mode="r")
    nodes, world = len(indptr) - 1, PETSc.COMM_WORLD
    first, last = (nodes * k // world.size for k in (world.rank, world.rank + 1))
    span = slice(int(indptr[first]), int(indptr[last]))
    indices = np.load(folder / "indices.npy", mmap_mode="r")[span].astype(PETSc.IntType)
    blocks = np.array(np.load(folder / "blocks.npy", mmap_mode="r")[span])
    local = (indptr[first : last + 1] - indptr[first]).astype(PETSc.IntType)
    sizes = (3 * (last - first), 3 * nodes)
    matrix = PETSc.Mat().createBAIJ(
        (sizes, sizes), 3, csr=(local, indices, blocks.ravel()), comm=world
    )
    matrix.assemble()
    matrix.convert("aij")
    matrix.setOption(PETSc.Mat.Option.SPD, True)
    return matrix, 3 * first, 3 * last


def _rigid_motions(PETSc: Any, folder: Path, fixed: Any, first: int, last: int) -> Any:
    """Near-null space: rigid motions, zero where fixed, orthonormal as PETSc wants them."""
    motions = np.load(folder / "near_null_space.npy", mmap_mode="r")
    free = ~np.asarray(fixed[first:last])
    vectors: list[Any] = []
    for k in range(motions.shape[1]):
        vector = PETSc.Vec().createMPI((last - first, len(motions)), bsize=3)
        vector.array[:] = motions[first:last, k] * free
        for earlier in vectors:
            vector.axpy(-vector.dot(earlier), earlier)
        vector.normalize()
        vectors.append(vector)
    return PETSc.NullSpace().create(constant=False, vectors=vectors)


def _solver(PETSc: Any, matrix: Any, rtol: float) -> Any:
    """Conjugate gradients to a residual over the right-hand side, with smoothed aggregation."""
    options = PETSc.Options()
    options["pc_gamg_agg_nsmooths"] = 1
    options["pc_gamg_threshold"] = 0.01
    options["mg_levels_ksp_type"] = "chebyshev"
    options["mg_levels_pc_type"] = "jacobi"
    options["mg_levels_ksp_max_it"] = 3
    solver = PETSc.KSP().create()
    solver.setOperators(matrix)
    solver.setType("cg")
    solver.setNormType(PETSc.KSP.NormType.UNPRECONDITIONED)
    solver.getPC().setType("gamg")
    solver.setInitialGuessNonzero(True)
    solver.setTolerances(rtol=rtol, atol=0.0, max_it=_MOST_ITERATIONS)
    solver.setFromOptions()
    return solver


if __name__ == "__main__":
    main(Path(sys.argv[1]), float(sys.argv[2]))
