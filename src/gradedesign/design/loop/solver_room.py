"""Whether the linear solver that a case names takes the systems that its run will solve."""

from __future__ import annotations

from gradedesign.common.values.locate import Where
from gradedesign.design.loop.predicted_cost import WITHIN, RunWork
from gradedesign.errors import ResourceError
from gradedesign.mechanics.explicit.tets import DOFS_PER_TET
from gradedesign.mechanics.solver.linear_solver import LinearSolver


def require_solver_takes(
    solver: LinearSolver, work: RunWork, submodels: int, where: Where, *, bricks: bool
) -> tuple[str, ...]:
    """Refuse a solver for which the systems of a run are too large, before any is assembled.

    Each system is refused again by `LinearSolver.refusal` once it is there; this knows it as far as
    it can be predicted. What is too large only by less than predictions are off is a warning.

    Raises
    ------
    ResourceError
        With file and line, the analysis and its unknowns.
    """
    # Submodels are about as large as each other; of the whole surface this is a part.
    remeshed = int(DOFS_PER_TET * work.mesher_tets / submodels)
    systems = {"the part": work.part_dofs}
    systems["the printed surface as it is meshed again"] = remeshed
    doubts = []
    for name, unknowns in systems.items():
        exact = name == "the part" and bricks
        least = unknowns if exact else int(unknowns / WITHIN)
        if words := solver.refusal(least):
            about = "" if exact else "at least about "
            raise ResourceError(
                f"{where('run.solver')}: {name} has {about}{least} unknowns: {words}"
            )
        if words := solver.refusal(unknowns):
            doubts.append(f"{where('run.solver')}: {name} has about {unknowns}: {words}")
    return tuple(doubts)
