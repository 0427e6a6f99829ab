"""Steps of one iteration of the design loop: size, build, predict."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.design.loop.designed import member_grid, with_design
from gradedesign.design.resolve.analysable import grid_spacing
from gradedesign.design.resolve.cell_choice import CellChoice, thinnest_wall
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.design.resolve.plan import Plan
from gradedesign.errors import LatticeError
from gradedesign.geometry.cell.cells import single
from gradedesign.geometry.lattice.density_grid import DensityGrid
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.geometry.tets.tet_mesh import centroids
from gradedesign.mechanics.explicit.correction import Correction, energy_weighted_density
from gradedesign.mechanics.fe.assembly import strain_energy_per_element
from gradedesign.mechanics.fe.elastic_system import ElasticSystem
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.limit import Limit
from gradedesign.mechanics.limits.local_stress import allowed_stress
from gradedesign.mechanics.limits.state import Predicted
from gradedesign.mechanics.limits.verdict import Factors
from gradedesign.mechanics.sizing.filter import DensityFilter, cone_filter, uniform_filter
from gradedesign.mechanics.sizing.homogenised import homogenised_system
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel, filter_weights
from gradedesign.mechanics.sizing.lattice_stiffness import (
    as_stiffness,
    in_lattice,
    lattice_stiffness,
)
from gradedesign.mechanics.sizing.members import MemberField
from gradedesign.mechanics.sizing.responses import solve_adjoints
from gradedesign.mechanics.sizing.size import SizingProblem, SizingResult, SizingStep
from gradedesign.mechanics.sizing.size_members import size_members
from gradedesign.mechanics.sizing.state import SolvedState, solved_state
from gradedesign.mechanics.sizing.stored_sizing import stored_sizing
from gradedesign.mechanics.sizing.stress_to_density import size_by_stress

#: Sizing aims a little below each limit, so that a small discrepancy does not break it.
TARGET = 0.985
#: Sizing iterations in the first iterations of the loop. Each sizing goes on from the variables of
#: the one before. The first design only serves to find the correction, which changes more than
#: further sizing would gain.
FIRST_SIZING_ITERATIONS = (10, 20)
#: Later ones only tune: corrections of the last design do not fit one that has changed much. Twenty
#: in every iteration took the cubic bracket five iterations of the loop instead of three to four.
TUNING_SIZING_ITERATIONS = 8
#: Tables of a case on which a sizing depends.
_SIZED_BY = {"material", "keep", "load_case", "limits", "lattice", "zone", "print", "region"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """Prediction of the corrected homogenised model for a design, before its explicit analysis."""

    values: dict[LimitKey, Predicted]  #: Of every limit.
    #: Share of the governing value by gradient that comes from strain of the lattice phase.
    lattice_share: float
    #: Of the lattice phase, weighted by its strain energy in the governing value, so that it stands
    #: for the lattice that carries.
    mean_density: float


def corrected_model(model: HomogenisedModel, correction: Correction) -> HomogenisedModel:
    """Homogenised model with the stiffness corrected by explicit analyses."""
    return replace(
        model,
        stiffness_factor=correction.stiffness,
        stiffness_exponent=correction.exponent,
        reference_density=correction.reference,
    )


def corrected_limits(limits: Sequence[Limit], correction: Correction) -> tuple[Limit, ...]:
    """Limits whose predicted values carry their factors."""
    return tuple(replace(limit, factor=correction.factor(limit.key)) for limit in limits)


def tightened_limits(limits: Sequence[Limit], factors: Factors) -> tuple[Limit, ...]:
    """Limits tightened by the ratio of accepted to explicit values."""
    return tuple(
        replace(limit, allowed=limit.allowed / factors.get(limit.key, 1.0)) for limit in limits
    )


def design_filter(model: DesignModel) -> DensityFilter:
    """Filter from design variables to element densities; every iteration of a run shares it."""
    report_step("filter of densities")
    part, lattice = model.homogenised, model.plan.case.lattice
    if lattice.grading == "uniform":
        return uniform_filter(part.volumes.size)
    radius = lattice.filter_radius * model.cells.layout.typical
    return cone_filter(centroids(part.space.mesh), filter_weights(part), radius)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SizingPlan:
    """Settings of one sizing; by default those of the first iteration, whose design is stored."""

    most_iterations: int = FIRST_SIZING_ITERATIONS[0]
    start: FloatArray | None = None  #: ``(n,)``. Design variables to begin with.
    members: MemberField | None = None  #: Of the design with which it begins.
    target: float = TARGET  #: Utilisation of the limits that it aims at.
    keep: float = 0.0  #: Share of its start that every variable keeps at least.
    bodies: bool = True  #: Whether shares of solid members become bodies.
    #: Whether members tie in what is solid in any case, as they do where neither cells nor a skin
    #: can, and in a design that follows such a one.
    tie: bool = False


def size_design(
    model: DesignModel,
    correction: Correction,
    factors: Factors,
    density_filter: DensityFilter,
    plan: SizingPlan,
    on_step: Callable[[SizingStep], None] | None = None,
) -> SizingResult:
    """Size the corrected homogenised part, densities filtered by ``density_filter``.

    ``factors`` are accepted over explicit values, where acceptance found more than the explicit
    analysis did: the limits are that much tighter here.
    """
    sizing = SizingProblem(
        model=corrected_model(model.homogenised, correction),
        limits=tightened_limits(corrected_limits(model.limits, correction), factors),
        bounds=model.cells.bounds,
        filter=density_filter,
        windows=None if model.cells.zoning is None else model.cells.zoning.windows,
        target=plan.target,
    )
    case = model.plan.case
    if case.lattice.by_stress:
        return size_by_stress(
            sizing, model.solutions, allowed_stress(case.limits, model.plan.material),
            start=None if plan.start is None else float(plan.start[0]),
            max_iterations=plan.most_iterations, on_step=on_step,
        )  # fmt: skip
    cell, most = model.cells.cell, plan.most_iterations
    stated = (
        case.model_dump_json(include=_SIZED_BY),
        case.part.element_size,
        cell.name,
        repr(sorted(cell.parameters.items())),
    )

    thickness = case.lattice.least_member
    if thickness is None:
        return stored_sizing(
            sizing, stated, start=plan.start, max_iterations=most, keep=plan.keep, on_step=on_step
        )

    def sized(
        problem: SizingProblem, start: FloatArray | None, most: int, insistence: int, near: float
    ) -> SizingResult:
        return stored_sizing(
            problem, stated, start=start, max_iterations=most, insistence=insistence,
            keep=plan.keep, tolerance=near, on_step=on_step,
        )  # fmt: skip

    def bodied(members: MemberField) -> Callable[[float], HomogenisedModel]:
        grid, rho = member_grid(model, members, thickness), sizing.model.volumes
        return lambda offset: (
            with_design(model, rho, replace(members, offset=offset), grid).homogenised
        )

    made = bodied if plan.bodies else None
    zoning = model.cells.zoning
    weight = None if zoning is None else zoning.member_weight
    tie, earlier = plan.tie, None
    if not (case.lattice.cells or any(s.all_round for s in model.plan.domain.solids)):
        tie = True
    if plan.start is not None and plan.members is not None:
        tie, earlier = tie or plan.members.tied, (plan.start, plan.members)
    return size_members(sizing, thickness, earlier, sized, made, on_step, weight=weight, tie=tie)


def build_design(
    domain: DesignDomain, cells: CellChoice, density: DensityGrid | float
) -> LatticeDesign:
    """The lattice of a density field."""
    return LatticeDesign(
        domain=domain,
        cells=single(cells.cell) if cells.zoning is None else cells.zoning.cells,
        cell_map=cells.layout.cell_map,
        cell_size=cells.layout.typical,
        density=density,
    )


def explicit_spacing(model: DesignModel, grid: DensityGrid) -> float:
    """Element size of the explicit analysis from the thinnest wall or layer of a design, mm.

    Raises LatticeError if the thinnest wall is thinner than [print] min_wall.
    """
    printer = model.plan.case.print
    report_step("thinnest wall")
    thinnest, element = thinnest_wall(model.homogenised, model.cells, grid)
    least = None if printer is None else printer.min_wall
    if least is not None and thinnest < least * (1 - 1e-6):
        raise LatticeError(
            f"the thinnest wall is {thinnest:.3g} mm, less than [print] min_wall "
            f"{least:g} mm; raise the lower density"
        )
    return explicit_spacing_for(model.plan, element)


def explicit_spacing_for(plan: Plan, element: float) -> float:
    """Element size that the case states, or that follows the layers and walls, mm.

    ``element``, mm, is the size that the thinnest wall needs.
    """
    case = plan.case
    if case.run.explicit_mesh_size is not None:
        return case.run.explicit_mesh_size
    return float(grid_spacing(plan.domain, element, 1.0, plan.tools.analysis))


def predict(
    model: HomogenisedModel, limits: Sequence[Limit], correction: Correction, rho: FloatArray
) -> Prediction:
    """Solve the corrected homogenised part for the densities that sizing chose.

    The smoothing by the density grid is part of the corrections from explicit analyses, so that the
    value sizing aims at is the value of the built lattice.
    """
    model = corrected_model(model, correction)
    limits = corrected_limits(limits, correction)
    report_step("predicting the design")
    system = homogenised_system(model, rho)
    state = solved_state(model, rho, limits, system)
    report_step("stress and share of the lattice")
    share, carrying = lattice_share(system, state, limits)
    return Prediction(
        values={limit.key: limit.predict(state) for limit in limits},
        lattice_share=share,
        mean_density=carrying,
    )


def lattice_share(
    system: ElasticSystem, state: SolvedState, limits: Sequence[Limit]
) -> tuple[float, float]:
    """Lattice phase's share of the most used value by gradient, and its energy-weighted density."""
    model, rho = state.model, state.rho
    weights = state.lattice_volumes
    mean = float(weights @ rho / weights.sum())
    pairs = [(limit.responses(state)[0], limit) for limit in limits if limit.follows_stiffness]
    if not pairs:
        return 0.0, mean
    worst, _ = max(pairs, key=lambda pair: pair[1].utilisation(pair[0].value))
    lattice = as_stiffness(in_lattice(model, lattice_stiffness(model, rho)))
    (adjoint,) = solve_adjoints(model, system, [worst])
    shape = worst.shape if worst.mode is None else worst.mode.shape
    if shape is not None:
        u, v, whole = shape, shape, 1.0
    elif adjoint is not None:
        u, v, whole = state.displacement(worst.load_case), adjoint, worst.value
    shared = strain_energy_per_element(model.space, lattice, u, v)
    if whole <= 0 or shared.sum() <= 0:
        return 0.0, mean
    return float(shared.sum() / whole), energy_weighted_density(shared, rho)
