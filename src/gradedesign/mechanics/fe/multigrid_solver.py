"""The solver ``multigrid``: conjugate gradients preconditioned by multigrid, for any size."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.mechanics.solver.direct import DIRECT
from gradedesign.mechanics.solver.linear_solver import (
    LinearAnswer,
    LinearSolver,
    LinearSystem,
    Solve,
)

#: Unknowns below which a direct solver is at once faster and simpler. Chosen, not measured.
_SMALL = 3000
#: Iterations after which multigrid is given up; thin lattices take 50 to 70.
MAX_ITERATIONS = 300
#: Load cases iterated together: they share each pass over the matrix, and the vectors of one take
#: less than a tenth of its memory.
_TOGETHER = 2


def _prepare_multigrid(system: LinearSystem) -> Solve:
    """Build the levels; later right-hand sides share them."""
    from gradedesign.mechanics.fe.multigrid import build_hierarchy, preconditioner
    from gradedesign.mechanics.solver.conjugate_gradients import conjugate_gradients

    report_step(f"multigrid of {system.space.dof_count} unknowns")
    hierarchy = build_hierarchy(system.space, system.stiffness, system.matrix, system.fixed)
    keep = system.free.astype(np.float64)

    def solve(right: FloatArray, start: FloatArray, rtol: float) -> LinearAnswer:
        parts = [
            conjugate_gradients(
                system.matrix,
                keep,
                right[k : k + _TOGETHER],
                preconditioner(hierarchy, len(right[k : k + _TOGETHER])),
                rtol=rtol,
                max_iterations=MAX_ITERATIONS,
                start=start[k : k + _TOGETHER],
            )
            for k in range(0, len(right), _TOGETHER)
        ]
        return LinearAnswer(
            x=np.concatenate([part.x for part in parts]),
            iterations=np.concatenate([part.iterations for part in parts]),
        )

    return solve


MULTIGRID = LinearSolver(
    name="multigrid", prepare=_prepare_multigrid, other=DIRECT, least_unknowns=_SMALL
)
