"""The loop: rounds until limits hold with a limit used, then acceptance, then again if it misses.

State between rounds is small (factors, densities, history), so a killed run resumes from the last
finished round.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from gradedesign.arrays import FloatArray, locked
from gradedesign.ladder.buckling import buckling_rows
from gradedesign.ladder.cell_layout import CellLayout
from gradedesign.ladder.graded_cells import with_cells
from gradedesign.ladder.result import Iteration
from gradedesign.ladder.round import (
    FIRST_ITERATIONS,
    TARGET,
    TUNING_ITERATIONS,
    Prediction,
    build_design,
    density_grid,
    explicit_cube,
    explicit_displacements,
    explicit_masses,
    judged_solid,
    predict,
    size_round,
)
from gradedesign.ladder.setup import Setup
from gradedesign.ladder.verdict import Factors, LimitRow, limit_rows
from gradedesign.lattice.density_grid import DensityGrid
from gradedesign.lattice.lattice import LatticeDesign
from gradedesign.sizing.size import SizingStep
from gradedesign.verify.correction import (
    Correction,
    Gap,
    damped,
    damping_for,
    gap_between,
    kept_share,
    stiffness_exponent,
    stiffness_update,
)
from gradedesign.verify.explicit import (
    ExplicitResult,
    JudgedSolid,
    analyse_printed_solid,
    governing_measure,
)
from gradedesign.verify.explicit_mesh import ExplicitMesh, mesh_lattice
from gradedesign.verify.mesh_within_budget import COARSEST, mesh_within_budget
from gradedesign.workspace.progress import Event, Listener, ignore, report_step

#: Rounds after which a miss is taken for scatter, and the most room that is left for it.
SCATTERED_ROUNDS, MOST_ROOM = 3, 0.08
#: A density counts as at its lower bound within this relative distance.
AT_BOUND = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Round:
    """A finished round: its design, what it taught and how it compares.

    Attributes
    ----------
    iteration : Iteration
    rows : tuple of LimitRow
        Explicit values.
    correction : Correction
        For the next round.
    variables : (n,) array
        Design variables, to start the next sizing from.
    rho : (M,) array
        Density of every tetrahedron.
    at_lower_bound : bool
    gap : Gap
    """

    iteration: Iteration
    rows: tuple[LimitRow, ...]
    correction: Correction
    variables: FloatArray
    rho: FloatArray
    at_lower_bound: bool
    gap: Gap

    def __post_init__(self) -> None:
        object.__setattr__(self, "variables", locked(self.variables, (None,)))
        object.__setattr__(self, "rho", locked(self.rho, (None,)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Analysed:
    """The explicit analysis of one design."""

    grid: DensityGrid
    design: LatticeDesign
    judged: JudgedSolid
    mesh: ExplicitMesh
    result: ExplicitResult
    layout: CellLayout


def analyse_design(
    setup: Setup, rho: FloatArray, *, cube: float | None = None, on_event: Listener = ignore
) -> Analysed:
    """Build the lattice of element densities, mesh it and solve it.

    ``cube``, mm, is taken as it is; without it the grid follows the thinnest wall and is refined
    until it holds what the field holds.
    """
    return analyse_cells(with_cells(setup, rho), rho, cube=cube, on_event=on_event)


def analyse_cells(
    setup: Setup,
    rho: FloatArray,
    *,
    cube: float | None = None,
    finer: float = 1.0,
    on_event: Listener = ignore,
) -> Analysed:
    """Build the lattice of element densities in the cells of the setup, mesh it and solve it.

    ``finer`` is the share of the grid of the thinnest wall that an earlier round had to go down to.
    """
    grid = density_grid(setup, rho)
    design = build_design(setup, grid)
    judged = judged_solid(setup, design)
    memory, bodies = setup.case.run.memory, setup.domain.bodies
    if cube is not None:
        mesh = mesh_lattice(design, cube, memory_limit_bytes=memory, bodies=bodies)
    else:
        asked = explicit_cube(setup, grid)
        mesh = mesh_within_budget(
            design,
            finer * asked,
            coarsest=asked * COARSEST,
            memory_limit_bytes=memory,
            bodies=bodies,
            on_refusal=lambda message: on_event(Event(stage="explicit", message=message)),
        )
    result = analyse_printed_solid(
        mesh.mesh, judged, mesh_size=mesh.cube, surface_tolerance=0.5 * mesh.cube
    )
    return Analysed(
        grid=grid, design=design, judged=judged, mesh=mesh, result=result, layout=setup.layout
    )


def play_round(
    setup: Setup,
    previous: tuple[Round, ...],
    factors: Factors,
    matrix: csr_matrix,
    *,
    on_step: Callable[[SizingStep], None] | None = None,
    on_event: Listener = ignore,
) -> tuple[Round, Analysed]:
    """Size with what earlier rounds taught, analyse explicitly, and learn.

    ``factors`` are accepted over explicit values by name and load case: sizing leaves that much
    room. ``matrix`` is the design filter.
    """
    began = time.perf_counter()
    timing: dict[str, float] = {}
    correction = (
        previous[-1].correction
        if previous
        else Correction(displacement=(1.0,) * len(setup.displacement_limits))
    )
    start = previous[-1].variables if previous else None
    sized = size_round(
        with_cells(setup, previous[-1].rho) if previous else setup,
        correction,
        factors,
        matrix,
        start=start,
        most_iterations=(
            FIRST_ITERATIONS[len(previous)]
            if len(previous) < len(FIRST_ITERATIONS)
            else TUNING_ITERATIONS
        ),
        target=aim_of(previous),
        keep=kept_share([done.gap for done in previous]),
        on_step=on_step,
    )
    timing["sizing"] = time.perf_counter() - began
    setup = with_cells(setup, sized.rho)
    predicted = predict(setup, correction, sized.rho)
    finer = previous[-1].iteration.grid_share if previous else 1.0
    meshing = time.perf_counter()
    analysed = analyse_cells(setup, sized.rho, finer=finer, on_event=on_event)
    result = analysed.result
    timing["explicit solve"] = result.seconds
    timing["explicit mesh"] = time.perf_counter() - meshing - result.seconds
    report_step("learning from the explicit analysis")
    displacements = explicit_displacements(setup, result)
    rows = (
        *limit_rows(setup, displacements, result.measures, "explicit analysis"),
        *buckling_rows(setup, predicted.buckling),
    )
    lattice = governing_measure(result.measures, "lattice")
    stress = None if lattice is None else lattice[1].value
    gap = gap_between(
        predicted.displacement,
        displacements,
        predicted.stress,
        stress,
        governing=_most_used(setup, displacements),
    )
    gaps = (*(r.gap for r in previous), gap)
    learned = _learn(setup, correction, predicted, displacements, gap, gaps, sized.rho)
    masses = explicit_masses(setup, analysed.mesh, result)
    weights = setup.model.lattice_volumes
    iteration = Iteration(
        round=len(previous) + 1,
        lattice_mass_g=masses["lattice"],
        mass_g=sum(masses.values()),
        mean_density=float(weights @ sized.rho / weights.sum()),
        predicted_displacement=predicted.displacement,
        explicit_displacement=displacements,
        predicted_stress=predicted.stress,
        explicit_stress=stress if predicted.stress is not None else None,
        displacement_gap=gap.displacement,
        stress_gap=gap.stress,
        use=max((row.use for row in rows), default=0.0),
        passed=all(row.passed for row in rows),
        dofs=result.space.dof_count,
        mesh_size_mm=result.mesh_size,
        grid_share=min(analysed.mesh.asked / explicit_cube(setup, analysed.grid), 1.0),
        seconds=time.perf_counter() - began,
        stiffness_factor=correction.stiffness,
        stress_factor=correction.stress,
        sizing_iterations=len(sized.history),
        sizing_converged=sized.converged,
        timing_s={name: round(value, 3) for name, value in timing.items()},
    )
    low = setup.bounds[0]
    active = weights > 0
    done = Round(
        iteration=iteration,
        rows=rows,
        correction=learned,
        variables=sized.variables,
        rho=sized.rho,
        at_lower_bound=bool(sized.rho[active].max(initial=low) <= low * (1 + AT_BOUND)),
        gap=gap,
    )
    return done, analysed


def _most_used(setup: Setup, displacements: tuple[float, ...]) -> int:
    """Number of the displacement limit that is used most; 0 without any."""
    limits = np.array([limit.limit for limit in setup.displacement_limits])
    return int(np.argmax(np.asarray(displacements) / limits)) if displacements else 0


def aim_of(previous: Sequence[Round]) -> float:
    """Use of the limits that the next sizing aims at.

    `TARGET`; after three rounds whose last one breaks a limit less, by what its prediction was off:
    designs of one mass then differ by as much, and rounds that aim at the limit miss it again.
    """
    if len(previous) < SCATTERED_ROUNDS or previous[-1].iteration.passed:
        return TARGET
    gap = previous[-1].gap
    off = abs(gap.displacement[gap.governing]) if gap.displacement else abs(gap.stress or 0.0)
    return TARGET * (1.0 - min(off, MOST_ROOM))


def _learn(
    setup: Setup,
    correction: Correction,
    predicted: Prediction,
    displacements: tuple[float, ...],
    gap: Gap,
    gaps: tuple[Gap, ...],
    rho: FloatArray,
) -> Correction:
    """Factors that make the homogenised model agree with this explicit analysis."""
    damping = damping_for(gaps)
    stress = correction.stress
    if gap.stress is not None:
        stress = damped(stress, stress * (1.0 + gap.stress), damping)
    if not displacements:
        return replace(correction, stress=stress)
    worst = gap.governing
    ratio = stiffness_update(
        displacements[worst], predicted.displacement[worst], predicted.lattice_share
    )
    mean = predicted.mean_density
    factor = correction.stiffness * (mean / correction.reference) ** correction.exponent
    samples = (*correction.samples, (mean, damped(factor, factor * ratio, damping)))
    trial = Correction(
        stiffness=samples[-1][1],
        exponent=stiffness_exponent(samples),
        reference=mean,
        samples=samples,
        displacement=correction.displacement,
        stress=correction.stress,
    )
    # What the stiffness leaves goes to each limit's own factor.
    again = predict(setup, trial, rho)
    factors = tuple(
        damped(old, old * explicit / new, damping)
        for old, explicit, new in zip(
            correction.displacement, displacements, again.displacement, strict=True
        )
    )
    # The stiffness changes the homogenised stress too: keep the product right.
    if again.stress and predicted.stress:
        stress *= predicted.stress / again.stress
    return replace(trial, displacement=factors, stress=stress)


def round_to_stage(done: Round) -> tuple[dict[str, FloatArray], dict[str, Any]]:
    """Arrays and plain data of a round for the run folder."""
    meta = {
        "iteration": asdict(done.iteration),
        "rows": [asdict(row) for row in done.rows],
        "correction": asdict(done.correction),
        "at_lower_bound": done.at_lower_bound,
        "gap": asdict(done.gap),
    }
    return {"variables": done.variables, "rho": done.rho}, meta


def round_from_stage(arrays: Mapping[str, FloatArray], meta: Mapping[str, Any]) -> Round:
    """The round that `round_to_stage` stored."""
    iteration = dict(meta["iteration"])
    for key in ("predicted_displacement", "explicit_displacement", "displacement_gap"):
        iteration[key] = tuple(iteration[key])
    correction = dict(meta["correction"])
    correction["displacement"] = tuple(correction["displacement"])
    correction["samples"] = tuple((float(a), float(b)) for a, b in correction["samples"])
    gap = dict(meta["gap"])
    return Round(
        iteration=Iteration(**iteration),
        rows=tuple(LimitRow(**row) for row in meta["rows"]),
        correction=Correction(**correction),
        variables=arrays["variables"],
        rho=arrays["rho"],
        at_lower_bound=bool(meta["at_lower_bound"]),
        gap=Gap(**{**gap, "displacement": tuple(gap["displacement"])}),
    )
