"""The loop: rounds until limits hold with a limit used, then acceptance, then again if it misses.

State between rounds is small (factors, densities, history), so a killed run resumes from the last
finished round.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from scipy.sparse import csr_matrix

from gradedesign.arrays import FloatArray, locked
from gradedesign.lattice.density_grid import DensityGrid
from gradedesign.lattice.lattice import LatticeDesign
from gradedesign.layout.cell_layout import CellLayout
from gradedesign.limits.key import LimitKey, keyed_from_json
from gradedesign.limits.limit import predicted_row
from gradedesign.limits.row import LimitRow, row_from_json
from gradedesign.limits.verdict import Factors, limit_rows
from gradedesign.loop.graded_cells import with_cells
from gradedesign.loop.round import (
    FIRST_ITERATIONS,
    TARGET,
    TUNING_ITERATIONS,
    Prediction,
    SizingPlan,
    build_design,
    density_grid,
    explicit_cube,
    explicit_masses,
    judged_solid,
    predict,
    size_round,
)
from gradedesign.output.result import Iteration, LimitIteration, iteration_from_json
from gradedesign.resolve.setup import Setup
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

    ``factors`` are accepted over explicit values: sizing leaves that much room. ``matrix`` is the
    design filter.
    """
    began = time.perf_counter()
    timing: dict[str, float] = {}
    correction = previous[-1].correction if previous else Correction()
    start = previous[-1].variables if previous else None
    sized = size_round(
        with_cells(setup, previous[-1].rho) if previous else setup,
        correction,
        factors,
        matrix,
        SizingPlan(
            start=start,
            most_iterations=(
                FIRST_ITERATIONS[len(previous)]
                if len(previous) < len(FIRST_ITERATIONS)
                else TUNING_ITERATIONS
            ),
            target=aim_of(previous),
            keep=kept_share([done.gap for done in previous]),
        ),
        on_step,
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
    rows = judged_rows(setup, result, predicted)
    explicit = {row.key: row.value for row in rows if not row.homogenised}
    gap = gap_between(
        {key: found.value for key, found in predicted.values.items()},
        explicit,
        governing=_most_used(setup, explicit),
    )
    gaps = (*(r.gap for r in previous), gap)
    learned = _learn(setup, correction, predicted, explicit, gaps, sized.rho)
    masses = explicit_masses(setup, analysed.mesh, result)
    weights = setup.model.lattice_volumes
    iteration = Iteration(
        round=len(previous) + 1,
        lattice_mass_g=masses["lattice"],
        mass_g=sum(masses.values()),
        mean_density=float(weights @ sized.rho / weights.sum()),
        limits=tuple(
            LimitIteration(
                key=limit.key,
                name=limit.name,
                unit=limit.unit,
                predicted=float(predicted.values[limit.key].value),
                explicit=explicit.get(limit.key),
                gap=dict(gap.values).get(limit.key),
                factor=correction.factor(limit.key),
            )
            for limit in setup.limits
        ),
        use=max((row.use for row in rows), default=0.0),
        passed=all(row.passed for row in rows),
        dofs=result.space.dof_count,
        mesh_size_mm=result.mesh_size,
        grid_share=min(analysed.mesh.asked / explicit_cube(setup, analysed.grid), 1.0),
        seconds=time.perf_counter() - began,
        stiffness_factor=correction.stiffness,
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


def judged_rows(
    setup: Setup, result: ExplicitResult, predicted: Prediction
) -> tuple[LimitRow, ...]:
    """Every limit by the explicit analysis, or by its prediction where that measures nothing."""
    return (
        *limit_rows(setup.limits, result, "explicit analysis"),
        *(
            predicted_row(limit, predicted.values[limit.key])
            for limit in setup.limits
            if not limit.explicit
        ),
    )


def _most_used(setup: Setup, explicit: Mapping[LimitKey, float]) -> LimitKey | None:
    """The limit by gradient that is used most; None without any."""
    uses = {
        limit.key: explicit[limit.key] / limit.allowed
        for limit in setup.limits
        if limit.by_gradient and limit.key in explicit
    }
    return max(uses, key=lambda key: uses[key], default=None)


def aim_of(previous: Sequence[Round]) -> float:
    """Use of the limits that the next sizing aims at.

    `TARGET`; after three rounds whose last one breaks a limit less, by what its prediction was off:
    designs of one mass then differ by as much, and rounds that aim at the limit miss it again.
    """
    if len(previous) < SCATTERED_ROUNDS or previous[-1].iteration.passed:
        return TARGET
    gap = previous[-1].gap
    others = max((abs(value) for _, value in gap.values), default=0.0)
    off = others if gap.governing is None else abs(gap.of(gap.governing))
    return TARGET * (1.0 - min(off, MOST_ROOM))


def _learn(
    setup: Setup,
    correction: Correction,
    predicted: Prediction,
    explicit: Mapping[LimitKey, float],
    gaps: tuple[Gap, ...],
    rho: FloatArray,
) -> Correction:
    """Factors that make the homogenised model agree with this explicit analysis."""
    damping, gap = damping_for(gaps), gaps[-1]
    factors = {limit.key: correction.factor(limit.key) for limit in setup.limits if limit.explicit}
    bounds = [one.key for one in setup.limits if one.explicit and not one.by_gradient]
    for key in bounds:
        factors[key] = damped(factors[key], factors[key] * (1.0 + gap.of(key)), damping)
    worst = gap.governing
    if worst is None:
        return replace(correction, factors=tuple(factors.items()))
    before = {key: found.value for key, found in predicted.values.items()}
    ratio = stiffness_update(explicit[worst], before[worst], predicted.lattice_share)
    mean = predicted.mean_density
    factor = correction.stiffness * (mean / correction.reference) ** correction.exponent
    samples = (*correction.samples, (mean, damped(factor, factor * ratio, damping)))
    trial = Correction(
        stiffness=samples[-1][1],
        exponent=stiffness_exponent(samples),
        reference=mean,
        samples=samples,
        factors=correction.factors,
    )
    again = {key: found.value for key, found in predict(setup, trial, rho).values.items()}
    for key, old in factors.items():
        if key in bounds and again[key] and before[key]:
            # The stiffness changes the homogenised stress too: keep the product right.
            factors[key] = old * before[key] / again[key]
        elif key not in bounds and key in explicit:
            # What the stiffness leaves goes to each limit's own factor.
            factors[key] = damped(old, old * explicit[key] / again[key], damping)
    return replace(trial, factors=tuple(factors.items()))


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
    correction, gap = dict(meta["correction"]), dict(meta["gap"])
    correction["samples"] = tuple((float(a), float(b)) for a, b in correction["samples"])
    correction["factors"] = keyed_from_json(correction["factors"])
    governing = gap["governing"]
    return Round(
        iteration=iteration_from_json(meta["iteration"]),
        rows=tuple(row_from_json(row) for row in meta["rows"]),
        correction=Correction(**correction),
        variables=arrays["variables"],
        rho=arrays["rho"],
        at_lower_bound=bool(meta["at_lower_bound"]),
        gap=Gap(
            values=keyed_from_json(gap["values"]),
            governing=None if governing is None else LimitKey(**governing),
        ),
    )
