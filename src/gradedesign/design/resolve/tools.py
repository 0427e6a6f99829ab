"""Meshers, solver, explicit analysis and formats that a case names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from gradedesign.arrays import FloatArray
from gradedesign.common.values.locate import Where, locating
from gradedesign.design.case.schema import Case
from gradedesign.design.resolve.lattice_files import LatticeFile, lattice_files
from gradedesign.design.resolve.registry import Registry, lookup
from gradedesign.errors import CaseError, blaming
from gradedesign.geometry.tets.mesher import PYTETWILD, Mesher
from gradedesign.mechanics.explicit.analysis import ExplicitAnalysis, Resolution, SolvedSolid
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid
from gradedesign.mechanics.solver.linear_solver import (
    LinearAnswer,
    LinearSolver,
    LinearSystem,
    Solve,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Tools:
    """Records that a case names; what solver and analysis raise names their plugin."""

    mesher: Mesher  #: Of the part, and of the acceptance.
    surface_mesher: Mesher  #: Of the part, and of the acceptance.
    solver: LinearSolver
    #: That the case names; of a design model, with the resolution that its memory allows.
    analysis: ExplicitAnalysis
    files: tuple[LatticeFile, ...]  #: Of the printed lattice.


def stated_tools(case: Case, registry: Registry) -> Tools:
    """Meshers, solver, analysis and formats of a case.

    Raises `CaseError` with line and nearest spelling, if nothing installed supplies one; if the
    analysis does not take the case. Raises `PluginError`: the same, when a plugin that might have
    supplied it is disabled.
    """
    files = lattice_files(case.output.formats, registry, case.where)
    return Tools(
        mesher=_mesher(case.part.mesher or PYTETWILD.name, registry, case.where, "part.mesher"),
        surface_mesher=_mesher(case.run.mesher, registry, case.where, "run.mesher"),
        solver=linear_solver(case.run.solver, registry, case.where),
        analysis=explicit_analysis(case, registry),
        files=files,
    )


def _mesher(name: str, registry: Registry, where: Where, key: str) -> Mesher:
    """The mesher that a key names."""
    with locating(where, key):
        mesher: Mesher = lookup(registry, "meshers", name)
    return mesher


def linear_solver(name: str, registry: Registry, where: Where) -> LinearSolver:
    """Solver that ``[run] solver`` names."""
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


def explicit_analysis(case: Case, registry: Registry) -> ExplicitAnalysis:
    """The analysis that ``[run] analysis`` names."""
    with locating(case.where, "run.analysis"):
        analysis = lookup(registry, "analyses", case.run.analysis)
    if words := analysis.refuses(case.limits, case.load_case):
        raise CaseError(
            f"{case.where('run.analysis')}: {analysis.name}: {words}; take another analysis"
        )
    who = f"analysis '{analysis.name}' of {registry.sources['analyses'][analysis.name]}"

    def solve(
        solid: PrintedSolid, resolution: Resolution, say: Callable[[str], None]
    ) -> SolvedSolid:
        with blaming(who, always=False):
            return analysis.solve(solid, resolution, say)

    return replace(analysis, solve=solve)
