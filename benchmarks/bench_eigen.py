"""Our Lanczos iteration against scipy's eigsh and lobpcg for the buckling loads of a cell.

All solve with the same preconditioned conjugate gradients, one solve more to check each end;
run with a number of voxels across. A peer whose answer does not pass the check is said not to
have converged.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace

import numpy as np
from scipy.sparse.linalg import LinearOperator, lobpcg

from gradedesign.arrays import FloatArray
from gradedesign.errors import SolverError
from gradedesign.mechanics.homogenise.periodic import solve_periodic
from gradedesign.mechanics.solver.eigen_solver import (
    EigenProblem,
    EigenSolver,
    ExtremeValue,
    Product,
)
from gradedesign_laboratory.buckling import macro_prestress, weakest_modes
from gradedesign_laboratory.lanczos import LANCZOS
from gradedesign_laboratory.scipy_eigen import SCIPY


def sheet(n: int, rho: float) -> FloatArray:
    """Voxels of a gyroid sheet."""
    x, y, z = 2 * np.pi * (np.indices((n, n, n)) + 0.5) / n
    f = np.abs(np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x))
    return (f <= np.quantile(f, rho)).astype(float)


def block(problem: EigenProblem) -> tuple[ExtremeValue, ExtremeValue | None]:
    """Locally optimal block preconditioned conjugate gradients, two vectors for each end."""
    other = np.random.default_rng(3).permutation(problem.start)
    start = [problem.solve(problem.form(v)) for v in (problem.start, other)]
    ends = []
    for largest in (True, False)[: 1 + problem.both]:
        values, vectors = lobpcg(
            operator(problem.form, problem), np.stack(start, axis=1),
            B=operator(problem.stiffness, problem), M=operator(problem.solve, problem),
            maxiter=20, largest=largest,
        )  # fmt: skip
        k = int(values.argmax() if largest else values.argmin())
        ends.append(ExtremeValue(value=float(values[k]), vector=vectors[:, k]))
    return ends[0], ends[1] if problem.both else None


def operator(product: Product, problem: EigenProblem) -> LinearOperator:
    """A product as scipy takes it."""
    n = problem.start.size
    return LinearOperator(
        (n, n),
        matvec=lambda x: product(x.ravel()),
        matmat=lambda block: np.stack([product(x) for x in block.T], axis=1),
        dtype=float,
    )


def counted(solver: EigenSolver, solves: list[int]) -> EigenSolver:
    """The solver, with every solve noted."""

    def solve_counted(problem: EigenProblem) -> tuple[ExtremeValue, ExtremeValue | None]:
        def solve(force: FloatArray) -> FloatArray:
            solves.append(1)
            return problem.solve(force)

        return solver.solve(replace(problem, solve=solve))

    return replace(solver, solve=solve_counted)


def main(n: int) -> None:
    """Print values, solves and seconds of every solver."""
    fill = sheet(n, 0.2)
    solution = solve_periodic(fill, poissons_ratio=0.3)
    start = np.random.default_rng(7).standard_normal((3, *fill.shape))
    for name, macro in (("compression", [-1, 0, 0, 0, 0, 0]), ("shear", [0, 0, 0, 0, 0, 1])):
        stress = macro_prestress(solution, np.array(macro, dtype=float))
        for both in (False, True):
            for solver in (LANCZOS, SCIPY, EigenSolver(name="lobpcg", solve=block)):
                solves: list[int] = []
                used = time.process_time()
                try:
                    high, low = weakest_modes(
                        fill, stress, poissons_ratio=0.3, start=start, both=both,
                        solver=counted(solver, solves),
                    )  # fmt: skip
                except SolverError:
                    # A peer that does not converge is a result, ours is a failure.
                    if solver is LANCZOS:
                        raise
                    values = "not converged"
                else:
                    values = " ".join(f"{end.value:.5g}" for end in (high, low) if end is not None)
                print(
                    f"{name}, {solver.name}: {values}, {len(solves)} solves, "
                    f"{time.process_time() - used:.2f} s of processor time",
                    flush=True,
                )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 24)
