"""The linear solver that a case names; what it raises names its plugin."""

from __future__ import annotations

from dataclasses import replace

from gradedesign.arrays import FloatArray
from gradedesign.common.values.locate import Where, locating
from gradedesign.design.resolve.registry import Registry, lookup
from gradedesign.errors import blaming
from gradedesign.mechanics.solver.linear_solver import (
    LinearAnswer,
    LinearSolver,
    LinearSystem,
    Solve,
)


def linear_solver(name: str, registry: Registry, where: Where) -> LinearSolver:
    """Solver that ``[run] solver`` names.

    Raises
    ------
    CaseError
        With line and nearest spelling, if nothing installed supplies it.
    PluginError
        The same, when a plugin that might have supplied it is disabled.
    """
    with locating(where, "run.solver"):
        solver: LinearSolver = lookup(registry, "solvers", name)
    who = f"solver '{solver.name}' of {registry.sources['solvers'][solver.name]}"

    def prepare(system: LinearSystem) -> Solve:
        with blaming(who, always=False):
            solve = solver.prepare(system)

        def blamed(right: FloatArray, start: FloatArray, rtol: float) -> LinearAnswer:
            with blaming(who, always=False):
                return solve(right, start, rtol)

        return blamed

    return replace(solver, prepare=prepare)
