"""Analyses of a run as models: the solid part, the homogenised part and the printed lattice."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.system.progress import report_step
from gradedesign.design.loop.designed import with_design
from gradedesign.design.loop.iteration_steps import corrected_model
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.design.verdict.shown import Shown
from gradedesign.mechanics.explicit.correction import Correction
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid
from gradedesign.mechanics.explicit.tet_fields import TetFields
from gradedesign.mechanics.fe.load_case import (
    PartLoadCase,
    case_loads,
    load_vector,
    mechanical_force,
    region_nodes,
)
from gradedesign.mechanics.fe.solution import Solution
from gradedesign.mechanics.fe.solve import solve_elastic
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.fe.stiffness import dense_stiffness, mean_stiffness
from gradedesign.mechanics.sizing.homogenised import mass_density, solve_homogenised
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel
from gradedesign.mechanics.sizing.lattice_stiffness import as_stiffness, effective_stiffness
from gradedesign.mechanics.sizing.members import MemberField
from gradedesign.program.outputs.analysed_model import AnalysedModel, ModelStep


def analysed_models(
    model: DesignModel,
    *,
    rho: FloatArray | None,
    members: MemberField | None,
    correction: Correction,
    printed: Shown | None,
) -> Iterator[AnalysedModel]:
    """Every model that was analysed and that tetrahedra carry, one at a time.

    - ``rho (M,)``: design
    - ``members``: of its solid members
    - ``correction``: of the homogenised model
    - ``printed``: the printed lattice
    """
    name = model.plan.case.name
    yield _solid(name, model.homogenised, model.facets, model.solutions)
    if rho is not None:
        part = with_design(model, rho, members).homogenised
        yield _homogenised(name, corrected_model(part, correction), model.facets, rho)
    if printed is not None and (solved := _tets(printed)) is not None:
        yield _explicit(name, printed.analysed.solid, solved)


def without_model(printed: Shown | None) -> dict[str, str]:
    """Analyses of which there is no model, and why."""
    if printed is None or _tets(printed) is not None:
        return {}
    return {"explicit": "the printed surface was not meshed as a whole"}


def _tets(printed: Shown) -> TetFields | None:
    """Tetrahedra of the acceptance of the whole printed surface, if there was one."""
    solved = None if printed.remeshed is None else printed.remeshed.solved
    return solved if isinstance(solved, TetFields) else None


def _solid(
    name: str,
    part: HomogenisedModel,
    facets: Mapping[str, IntArray],
    solutions: Sequence[Solution],
) -> AnalysedModel:
    """``solid``: the fully solid part."""
    density = np.full(part.space.element_count, part.material.density)
    return AnalysedModel(
        name="solid",
        title=["gradedesign: the fully solid part", name],
        space=part.space,
        stiffness=dense_stiffness(part.space, part.material),
        steps=_steps(part.space, part.cases, density, solutions),
        thermal_expansion=part.material.thermal_expansion,
        node_sets=_node_sets(part.space, facets),
    )


def _homogenised(
    name: str, part: HomogenisedModel, facets: Mapping[str, IntArray], rho: FloatArray
) -> AnalysedModel:
    """``homogenised``: a design as homogenised solid.

    Every tetrahedron has the stiffness of its own density. Where the run varies it inside the
    tetrahedra too, the model has its mean over each.
    """
    whole = as_stiffness(effective_stiffness(part, rho))
    stiffness = mean_stiffness(whole)
    density = mass_density(part, rho)
    expansion = part.material.thermal_expansion
    vectors = [load_vector(part.space, case, stiffness, density, expansion) for case in part.cases]
    report_step("displacements of the homogenised part")
    solved = solve_elastic(part.space, stiffness, vectors, solver=part.solver)
    varied = stiffness is not whole
    return AnalysedModel(
        name="homogenised",
        title=[
            "gradedesign: the part as homogenised solid, a material for each density",
            name,
        ],
        space=part.space,
        stiffness=stiffness,
        steps=_steps(part.space, part.cases, density, solved),
        thermal_expansion=expansion,
        node_sets=_node_sets(part.space, facets),
        off=_largest_difference(solved, solve_homogenised(part, rho)) if varied else 0.0,
    )


def _explicit(name: str, solid: PrintedSolid, solved: TetFields) -> AnalysedModel:
    """``explicit``: the printed lattice on the tetrahedra of its acceptance."""
    space = solved.space
    cases = case_loads(space, solid.load_cases, solid.regions, solved.facets)
    density = np.full(space.element_count, solid.material.density)
    solutions = [solved.solutions[case.name] for case in cases]
    return AnalysedModel(
        name="explicit",
        title=["gradedesign: the printed lattice", name],
        space=space,
        stiffness=dense_stiffness(space, solid.material),
        steps=_steps(space, cases, density, solutions),
        thermal_expansion=solid.material.thermal_expansion,
        node_sets=_node_sets(space, solved.facets),
    )


def _node_sets(space: TetSpace, facets: Mapping[str, IntArray]) -> dict[str, IntArray]:
    return {name: region_nodes(space, numbers) for name, numbers in facets.items()}


def _largest_difference(carried: Sequence[Solution], modelled: Sequence[Solution]) -> float:
    """Largest difference of displacements over the largest displacement, of all load cases."""
    worst = 0.0
    for one, other in zip(carried, modelled, strict=True):
        size = float(np.linalg.norm(other.displacement, axis=0).max())
        off = float(np.linalg.norm(one.displacement - other.displacement, axis=0).max())
        worst = max(worst, off / size if size > 0.0 else 0.0)
    return worst


def _steps(
    space: TetSpace,
    cases: Sequence[PartLoadCase],
    density: FloatArray,
    solutions: Sequence[Solution],
) -> list[ModelStep]:
    return [
        ModelStep(
            name=case.name,
            supports=case.supports,
            force=mechanical_force(space, case, density),
            temperature_change=case.temperature_change,
            displacement=float(np.linalg.norm(solution.displacement, axis=0).max()),
        )
        for case, solution in zip(cases, solutions, strict=True)
    ]
