"""The cost of one run: predicted after its solid stage, learned from its first iteration."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from gradedesign.common.system.limits import Deadline
from gradedesign.common.values.locate import Where
from gradedesign.design.case.run_schema import RunSpec
from gradedesign.design.loop.accepted import Accepted
from gradedesign.design.loop.announce import Announcer
from gradedesign.design.loop.ended import require_time
from gradedesign.design.loop.iteration import DesignIteration
from gradedesign.design.loop.predicted_cost import (
    WITHIN,
    CostPrediction,
    RunWork,
    learned_speed,
    predict_cost,
)
from gradedesign.design.loop.run_work import run_work
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.errors import ResourceError
from gradedesign.mechanics.explicit.tets import DOFS_PER_TET
from gradedesign.mechanics.solver.linear_solver import LinearSolver

#: Share of the time budget that what is no part of the verdict leaves. Chosen, not measured.
_KEPT = 0.05


@dataclass(slots=True, kw_only=True)
class RunCost:
    """Budget of a run and its predicted cost; the clock starts with the record."""

    budget: RunSpec
    clock: Deadline = field(init=False)
    work: RunWork | None = None
    #: The first prediction, and the one that the first iteration taught.
    before: CostPrediction | None = None
    after: CostPrediction | None = None  #: As `before`.
    #: s. That the last acceptance took, and whether stress was judged in meshes of its own in it.
    judged_s: float | None = None
    remeshed: bool = False

    def __post_init__(self) -> None:
        self.clock = Deadline(self.budget.time)

    def deadline(self, iterations: Sequence[DesignIteration]) -> Deadline:
        """When time is over; iterations of an earlier process count."""
        spent = sum(i.summary.seconds for i in iterations)
        return replace(self.clock, start=self.clock.start - spent)

    def predict(self, model: DesignModel, announce: Announcer) -> None:
        """Predict from the prepared case and report it.

        Raises ResourceError if the linear solver of the case cannot take what is to come.
        """
        self.work = run_work(model)
        solver, case = model.plan.tools.solver, model.plan.case
        require_solver_takes(
            solver,
            self.work,
            self.budget.submodel_count,
            case.where,
            bricks=case.part.bricks is not None,
        )
        self.before = predict_cost(self.work)
        announce.cost(self.before, self.budget)

    def learn(self, iterations: Sequence[DesignIteration], announce: Announcer) -> None:
        """Repeat the prediction with the times of the first iteration, once it has finished."""
        if len(iterations) != 1 or self.work is None:
            return
        self.after = _learned_cost(self.work, iterations[0])
        announce.cost(self.after, self.budget)

    def acceptance(self, last: DesignIteration) -> tuple[float, float]:
        """Seconds of an acceptance of an iteration: the least, and those expected, s.

        By the speed of that iteration or, as far as it is known, of the last acceptance. The least
        are those of an idle machine of two cores, if they are fewer: the first iteration also
        compiles, and another process may have slowed it.
        """
        if self.work is None:
            return 0.0, 0.0
        idle = predict_cost(_real_work(self.work, last)).judging_s
        learned = _learned_cost(self.work, last)
        expected = learned.judging_s
        if self.judged_s is not None:
            expected = self.judged_s + (0.0 if self.remeshed else learned.acceptance_s)
        return min(idle, expected), expected

    def reserved(self, iterations: Sequence[DesignIteration]) -> float:
        """Seconds to keep for an acceptance when another iteration begins."""
        if not iterations:
            return 0.0
        least, expected = self.acceptance(iterations[-1])
        return least if len(iterations) == 1 else expected

    def begin_acceptance(
        self, iteration: DesignIteration, deadline: Deadline, announce: Announcer
    ) -> None:
        """Announce the predicted cost of an acceptance before it begins.

        Raises NoTimeError if it cannot end in time.
        """
        least, expected = self.acceptance(iteration)
        number = iteration.summary.number
        require_time(number, deadline, least)
        if expected > deadline.remaining():
            announce.say(
                "warning",
                f"the acceptance of iteration {number} is predicted to take {expected:.0f} s, more "
                f"than the {deadline.remaining():.0f} s that are left of [run] time: it may end "
                f"after it",
            )

    def timed(self, judge: Callable[[], Accepted]) -> Accepted:
        """The acceptance that ``judge`` makes, whose seconds are expected of the next one."""
        began = time.perf_counter()
        accepted = judge()
        self.judged_s = time.perf_counter() - began
        self.remeshed = accepted.acceptance.scope != "none"
        return accepted

    def data(self) -> dict[str, Any]:
        """Plain data for result.json."""
        predictions = {"at_start": self.before, "after_first_iteration": self.after}
        return {name: asdict(cost) for name, cost in predictions.items() if cost is not None}


def no_time_for_more(deadline: Deadline, began: float) -> str:
    """Why no more is computed beside the verdict, which is known; empty where there is time.

    ``began``, s on the deadline's clock, is when that was begun.
    """
    left, spent = deadline.remaining(), deadline.elapsed() - began
    if left > max(spent, _KEPT * deadline.seconds):
        return ""
    return f"left out: {left:.0f} of {deadline.seconds:.0f} s of [run] time are left"


def _learned_cost(work: RunWork, iteration: DesignIteration) -> CostPrediction:
    """Predict a run from the seconds and the unknowns of one of its iterations."""
    real, summary = _real_work(work, iteration), iteration.summary
    speed = learned_speed(real, summary.sizing_iterations, summary.timing_s)
    return predict_cost(real, speed, learned=True)


def _real_work(work: RunWork, iteration: DesignIteration) -> RunWork:
    """The work with the unknowns that an iteration really had."""
    summary = iteration.summary
    grown = summary.dofs / work.explicit_dofs
    return replace(
        work,
        explicit_dofs=summary.dofs,
        explicit_memory=int(grown * work.explicit_memory),
        explicit_solve_s=grown * work.explicit_solve_s,
        whole_s=grown * work.whole_s,
        mesher_tets=int(grown * work.mesher_tets),
    )


def require_solver_takes(
    solver: LinearSolver, work: RunWork, submodels: int, where: Where, *, bricks: bool
) -> tuple[str, ...]:
    """Refuse a solver for which the systems of a run are too large, before any is assembled.

    Each system is refused again by `LinearSolver.refusal` once it is there; this knows it as far as
    it can be predicted. What is too large only by less than predictions are off is a warning.

    Raises ResourceError with file and line, the analysis and its unknowns.
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
