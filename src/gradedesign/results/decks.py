"""CalculiX decks of a run: the solid part, the homogenised part and the printed lattice."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.fe.load_case import (
    PartLoadCase,
    case_loads,
    load_vector,
    mechanical_force,
    region_nodes,
)
from gradedesign.fe.solution import Solution
from gradedesign.fe.solve import solve_elastic
from gradedesign.fe.space import TetSpace
from gradedesign.fe.stiffness import AnisotropicStiffness, IsotropicStiffness, mean_of
from gradedesign.loop.graded_cells import with_cells
from gradedesign.loop.iteration_steps import corrected_model
from gradedesign.output.calculix import Deck, DeckStep, write_calculix
from gradedesign.resolve.problem import Problem
from gradedesign.resolve.setup import Setup
from gradedesign.resolve.solid import solid_stiffness
from gradedesign.results.shown import Shown
from gradedesign.sizing.homogenised import mass_density, solve_homogenised
from gradedesign.sizing.homogenised_model import HomogenisedModel
from gradedesign.sizing.lattice_stiffness import effective_stiffness
from gradedesign.verify.analysis import SolvedSolid
from gradedesign.verify.correction import Correction
from gradedesign.verify.printed_solid import PrintedSolid
from gradedesign.verify.tet_fields import TetFields
from gradedesign.verify.tet_fields import solid_stiffness as printed_stiffness
from gradedesign.workspace.progress import report_step
from gradedesign.workspace.run_folder import RunFolder

#: A deck whose displacement differs by more than this share of the run's gets a warning.
SAME_MODEL = 1e-3


def write_decks(
    out: RunFolder,
    setup: Setup,
    files: dict[str, str],
    *,
    rho: FloatArray | None,
    correction: Correction,
    printed: Shown | None,
) -> tuple[str, ...]:
    """Write a deck of every model that was analysed; return warnings.

    Parameters
    ----------
    out : RunFolder
    setup : Setup
    files : dict of str to str
        Takes the names of the decks.
    rho : (M,) array, optional
        Design.
    correction : Correction
        Of the homogenised model.
    printed : Shown, optional
        The printed lattice.
    """
    problem = setup.problem
    warnings: tuple[str, ...] = ()
    _solid(out, problem, setup.solutions, files)
    if rho is not None:
        warnings += _homogenised(out, setup, rho, correction, files)
    if printed is not None:
        solved = None if printed.remeshed is None else printed.remeshed.solved
        warnings += _explicit(out, problem, printed.analysed.solid, solved, files)
    return warnings


def _solid(
    out: RunFolder, problem: Problem, solid: Sequence[Solution], files: dict[str, str]
) -> None:
    """``solid.inp``: the fully solid part."""
    density = np.full(problem.space.element_count, problem.material.density)
    deck = _deck(
        ["gradedesign: the fully solid part", problem.case.name],
        problem.space,
        solid_stiffness(problem),
        problem,
        _steps(problem.space, problem.loads, density, solid),
        problem.facets,
    )
    _write(out, "solid", deck, files)


def _homogenised(
    out: RunFolder,
    setup: Setup,
    rho: FloatArray,
    correction: Correction,
    files: dict[str, str],
) -> tuple[str, ...]:
    """``homogenised.inp``: a design as homogenised solid.

    Every tetrahedron has the stiffness of its own density. Where the model varies it inside the
    tetrahedra too, the deck has its mean over each, and a warning says what that changes.
    """
    setup = with_cells(setup, rho)
    model = corrected_model(setup.model, correction)
    stiffness = element_means(model, rho)
    vectors = [
        load_vector(
            model.space, case, stiffness, mass_density(model, rho), model.material.thermal_expansion
        )
        for case in model.cases
    ]
    report_step("displacements of the homogenised part")
    solved = solve_elastic(model.space, stiffness, vectors, solver=model.solver)
    warnings: tuple[str, ...] = ()
    if effective_stiffness(model, rho).ndim > 3:
        warnings = _difference_warning(solved, solve_homogenised(model, rho))
    deck = _deck(
        ["gradedesign: the part as homogenised solid, a material for each density",
         setup.problem.case.name, *warnings],
        model.space, stiffness, setup.problem,
        _steps(model.space, model.cases, mass_density(model, rho), solved), setup.problem.facets,
    )  # fmt: skip
    _write(out, "homogenised", deck, files)
    return warnings


def _explicit(
    out: RunFolder,
    problem: Problem,
    solid: PrintedSolid,
    solved: SolvedSolid | None,
    files: dict[str, str],
) -> tuple[str, ...]:
    """``explicit.inp``: the printed lattice on the tetrahedra of its acceptance."""
    if not isinstance(solved, TetFields):
        return (
            "explicit.inp is not written: the printed surface was not meshed as a whole; a design "
            'that is accepted with [run] acceptance = "whole" has its deck',
        )
    space = solved.space
    cases = case_loads(space, solid.case.load_case, solid.regions, solved.facets)
    density = np.full(space.element_count, solid.material.density)
    solutions = [solved.solutions[case.name] for case in cases]
    deck = _deck(
        ["gradedesign: the printed lattice", problem.case.name],
        space,
        printed_stiffness(space, solid.material),
        problem,
        _steps(space, cases, density, solutions),
        solved.facets,
    )
    _write(out, "explicit", deck, files)
    return ()


def element_means(model: HomogenisedModel, rho: FloatArray) -> AnisotropicStiffness:
    """Mean stiffness of every element, which is the stiffness where it is constant in each."""
    whole = effective_stiffness(model, rho)
    if whole.ndim == 3:
        return AnisotropicStiffness(C=whole)
    return AnisotropicStiffness(C=whole.mean(axis=2) if whole.shape[2] == 4 else mean_of(whole))


def _difference_warning(
    carried: Sequence[Solution], modelled: Sequence[Solution]
) -> tuple[str, ...]:
    worst = 0.0
    for in_deck, in_model in zip(carried, modelled, strict=True):
        size = float(np.linalg.norm(in_model.displacement, axis=0).max())
        off = float(np.linalg.norm(in_deck.displacement - in_model.displacement, axis=0).max())
        worst = max(worst, off / size if size > 0.0 else 0.0)
    if worst <= SAME_MODEL:
        return ()
    return (
        "homogenised.inp has one stiffness for each tetrahedron, while skins, walls and "
        "turned cells vary it inside; its displacements differ from those of the model of sizing "
        f"by up to {100 * worst:.2g} % of the largest one",
    )


def _steps(
    space: TetSpace,
    cases: Sequence[PartLoadCase],
    density: FloatArray,
    solutions: Sequence[Solution],
) -> list[DeckStep]:
    return [
        DeckStep(
            name=case.name,
            supports=case.supports,
            force=mechanical_force(space, case, density),
            temperature_change=case.temperature_change,
            displacement=float(np.linalg.norm(solution.displacement, axis=0).max()),
        )
        for case, solution in zip(cases, solutions, strict=True)
    ]


def _deck(
    title: Sequence[str],
    space: TetSpace,
    stiffness: IsotropicStiffness | AnisotropicStiffness,
    problem: Problem,
    steps: Sequence[DeckStep],
    facets: Mapping[str, IntArray],
) -> Deck:
    return Deck(
        title=title,
        space=space,
        stiffness=stiffness,
        steps=steps,
        thermal_expansion=problem.material.thermal_expansion,
        node_sets={
            name: region_nodes(space, facet_numbers) for name, facet_numbers in facets.items()
        },
    )


def _write(out: RunFolder, name: str, deck: Deck, files: dict[str, str]) -> None:
    report_step(f"writing {name}.inp")
    write_calculix(out.path_of(f"{name}.inp"), deck)
    out.adopt(f"{name}.inp")
    files[f"{name}_inp"] = f"{name}.inp"
