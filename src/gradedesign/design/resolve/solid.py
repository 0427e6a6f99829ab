"""Analysis of the fully solid part, which must hold every limit."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.values.locate import Where
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.design.resolve.solid_part import solid_modes, solid_solutions
from gradedesign.design.resolve.solid_stress import (
    SolidStress,
    solid_field,
    solid_shares,
    solid_stress,
)
from gradedesign.errors import CaseError
from gradedesign.geometry.tets.tet_mesh import centroids
from gradedesign.mechanics.explicit.support_zones import SupportZone, evaluated_at, undisturbed_at
from gradedesign.mechanics.explicit.yielding import Yielding, yielding, yielding_words
from gradedesign.mechanics.fe.load_case import (
    mechanical_force,
    region_nodes,
    region_shares,
    work_of,
)
from gradedesign.mechanics.fe.solution import Solution
from gradedesign.mechanics.fe.stress import von_mises
from gradedesign.mechanics.limits.limit import Limit, limits_stress, mode_goals
from gradedesign.mechanics.limits.verdict import limit_rows
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel


def solve_solid(part: HomogenisedModel) -> tuple[Solution, ...]:
    """Displacements of the fully solid part in every load case."""
    return solid_solutions(part.space, part.cases, part.material, part.solver)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SolidAnalysis:
    """Analysis of the fully solid part, as limits read it."""

    displacement: dict[str, FloatArray]  #: By load case, each ``(3, N)``, mm.
    nodes: dict[str, IntArray]  #: By region, each ``(k,)``.
    #: By region, each ``(k,)``. Share of the region's area that each node stands for.
    shares: dict[str, FloatArray]
    measures: dict[str, tuple[SolidStress, ...]]  #: By load case.
    work: dict[str, float]  #: By load case, N mm.
    mode_values: dict[Hashable, float]  #: By LimitKey.
    judged_share: float  #: Share of the part's volume whose stress is judged.
    yields: Yielding | None  #: Stress above the yield strength that no support disturbs.

    def region_displacement(self, region: str, load_case: str) -> FloatArray:
        """Displacements of the nodes of a region, ``(3, k)``, mm."""
        return self.displacement[load_case][:, self.nodes[region]]

    def mean_displacement(self, region: str, load_case: str) -> FloatArray:
        """Mean displacement over the area of a region, ``(3,)``, mm."""
        mean: FloatArray = self.region_displacement(region, load_case) @ self.shares[region]
        return mean

    def mean_length(self, region: str, load_case: str) -> float:
        """Mean length of the displacement over the area of a region, mm."""
        lengths = np.linalg.norm(self.region_displacement(region, load_case), axis=0)
        return float(lengths @ self.shares[region])

    def largest_displacement(self, load_case: str) -> float:
        """Largest displacement of any node, mm."""
        return float(np.linalg.norm(self.displacement[load_case], axis=0).max())


def _solid_analysis(model: DesignModel, solutions: tuple[Solution, ...]) -> SolidAnalysis:
    """Measures of the fully solid part."""
    plan, part = model.plan, model.homogenised
    space, case, volume = part.space, plan.case, float(part.volumes.sum())
    measures: dict[str, tuple[SolidStress, ...]] = {}
    stresses: dict[str, FloatArray] = {}
    judged = None
    if any(limit.needs_stress for limit in model.limits):
        judged = solid_shares(space, plan.support_zones)
    for load, solution in zip(part.cases, solutions, strict=True):
        field = solid_field(space, part.material, load, solution)
        stresses[load.name] = von_mises(field.nodal)
        if judged is None:
            continue
        missing, size = volume / plan.part.volume - 1.0, case.part.element_size
        stress = solid_stress(field, judged, case.limits.percentile, missing, size)
        if stress is not None:
            measures[load.name] = (stress,)
    density = np.full(space.element_count, part.material.density)
    forces = [mechanical_force(space, load, density) for load in part.cases]
    return SolidAnalysis(
        displacement={s.name: s.displacement for s in solutions},
        nodes={name: region_nodes(space, on) for name, on in model.facets.items()},
        shares={name: region_shares(space, on) for name, on in model.facets.items()},
        measures=measures,
        work=work_of(forces, solutions),
        mode_values=solid_modes(part, solutions, mode_goals(model.limits)),
        judged_share=1.0 - unjudged_share(part, plan.support_zones),
        yields=_solid_yielding(part, stresses, plan.support_zones),
    )


def unjudged_share(part: HomogenisedModel, zones: Sequence[SupportZone]) -> float:
    """Share of the part's volume in the zones around supports."""
    evaluated = evaluated_at(centroids(part.space.mesh), zones)
    return 1.0 - float(part.volumes @ evaluated / part.volumes.sum())


def _solid_yielding(
    part: HomogenisedModel, stresses: Mapping[str, FloatArray], zones: Sequence[SupportZone]
) -> Yielding | None:
    """Stress of the solid part above the yield strength that no support disturbs.

    ``stresses`` ``(N,)`` MPa are von Mises stresses at the nodes, each of which stands for a tenth
    of the volumes of its elements.
    """
    space = part.space
    at_nodes = np.zeros(space.node_count)
    np.add.at(at_nodes, space.elements.ravel(), np.tile(part.volumes / 10.0, 10))
    return yielding(
        space.nodes,
        at_nodes,
        {name: stress[:, None] for name, stress in stresses.items()},
        undisturbed_at(space.nodes, zones),
        part.material.yield_strength,
    )


def with_solid(model: DesignModel, solutions: tuple[Solution, ...]) -> DesignModel:
    """The model with the analysis of the solid part, and with limits relative to it resolved.

    Raises CaseError if a limit is relative to a value that is nothing in the solid part.
    """
    analysis = _solid_analysis(model, solutions)
    where = model.plan.case.where
    limits = tuple(_resolved(where, limit, analysis) for limit in model.limits)
    return replace(
        model,
        limits=limits,
        solid=limit_rows(limits, analysis, "solid part"),
        solutions=solutions,
        solid_yields=yielding_words(
            analysis.yields, "the fully solid part", limited=limits_stress(limits)
        ),
    )


def _resolved(where: Where, limit: Limit, analysis: SolidAnalysis) -> Limit:
    """Allowed value of a limit in its unit; multiples are taken of the solid part's value."""
    if limit.times_solid is None:
        return limit
    value = limit.rows(analysis, "solid part")[0].value
    if value <= limit.rest(analysis):
        raise CaseError(
            f"{where(limit.case_key)}: found {limit.stated}, but {limit.name} of the "
            f"solid part is {value:.3g} {limit.unit} in load case '{limit.key.load_case}'; "
            f"expected more: state a value in {limit.unit}, or name the load_case it is meant for"
        )
    return replace(limit, allowed=limit.times_solid * value)
