"""The cost of one run: predicted after its solid stage, learned from its first iteration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from gradedesign.case.run_schema import RunSpec
from gradedesign.limits.row import LimitRow
from gradedesign.loop.announce import Announcer
from gradedesign.loop.iteration import DesignIteration
from gradedesign.loop.predicted_cost import (
    CostPrediction,
    RunWork,
    learned_speed,
    predict_cost,
)
from gradedesign.loop.run_work import run_work
from gradedesign.loop.solver_room import require_solver_takes
from gradedesign.resolve.setup import Setup
from gradedesign.workspace.limits import Deadline


@dataclass(slots=True, kw_only=True)
class RunCost:
    """Budget of a run and its predicted cost; the clock starts with the record.

    Attributes
    ----------
    budget : RunSpec
    clock : Deadline
    work : RunWork or None
    before, after : CostPrediction or None
        The first prediction, and the one that the first iteration taught.
    """

    budget: RunSpec
    clock: Deadline = field(init=False)
    work: RunWork | None = None
    before: CostPrediction | None = None
    after: CostPrediction | None = None

    def __post_init__(self) -> None:
        self.clock = Deadline(self.budget.time)

    def deadline(self, iterations: Sequence[DesignIteration]) -> Deadline:
        """When time is over; iterations of an earlier process count."""
        spent = sum(i.summary.seconds for i in iterations)
        return replace(self.clock, start=self.clock.start - spent)

    def predict(self, setup: Setup, solid: Sequence[LimitRow], announce: Announcer) -> None:
        """Predict from the prepared case and report it.

        Raises
        ------
        ResourceError
            If the linear solver of the case cannot take what is to come.
        """
        self.work = run_work(setup, solid)
        problem = setup.problem
        require_solver_takes(problem.case, problem.solver, problem.analysis, self.work)
        self.before = predict_cost(self.work)
        announce.cost(self.before, self.budget)

    def learn(self, iterations: Sequence[DesignIteration], announce: Announcer) -> None:
        """Repeat the prediction with the times of the first iteration, once it has finished."""
        if len(iterations) != 1 or self.work is None:
            return
        self.after = learned_cost(self.work, iterations[0])
        announce.cost(self.after, self.budget)

    def data(self) -> dict[str, Any]:
        """Plain data for result.json."""
        predictions = {"at_start": self.before, "after_first_iteration": self.after}
        return {name: asdict(cost) for name, cost in predictions.items() if cost is not None}


def learned_cost(work: RunWork, first: DesignIteration) -> CostPrediction:
    """Predict a run from the seconds and the unknowns of its first iteration."""
    summary = first.summary
    grown = summary.dofs / work.explicit_dofs
    real = replace(
        work,
        explicit_dofs=summary.dofs,
        explicit_memory=int(grown * work.explicit_memory),
        explicit_solve_s=grown * work.explicit_solve_s,
        whole_s=grown * work.whole_s,
        mesher_tets=int(grown * work.mesher_tets),
    )
    speed = learned_speed(real, summary.sizing_iterations, summary.timing_s)
    return predict_cost(real, speed, learned=True)
