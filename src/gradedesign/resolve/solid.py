"""The fully solid part, which must hold every limit before any lattice is worth making."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import CaseError
from gradedesign.fe.load_case import load_vector, mechanical_force, region_nodes
from gradedesign.fe.solution import Solution
from gradedesign.fe.solve import solve_elastic
from gradedesign.fe.stiffness import IsotropicStiffness
from gradedesign.fe.stress import element_von_mises, weighted_percentile
from gradedesign.limits.limit import Limit
from gradedesign.limits.verdict import limit_rows
from gradedesign.resolve.setup import Setup
from gradedesign.verify.explicit import work_of


def solve_solid(setup: Setup) -> tuple[Solution, ...]:
    """Displacements of the fully solid part in every load case."""
    material, space = setup.material, setup.space
    stiffness = solid_stiffness(setup)
    density = np.full(space.element_count, material.density)
    vectors = [
        load_vector(space, case, stiffness, density, material.thermal_expansion)
        for case in setup.model.cases
    ]
    return solve_elastic(space, stiffness, vectors, solver=setup.model.solver)


def solid_stiffness(setup: Setup) -> IsotropicStiffness:
    """The base material in every tetrahedron."""
    return IsotropicStiffness(
        E=np.full(setup.space.element_count, setup.material.youngs_modulus),
        nu=setup.material.poissons_ratio,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SolidStress:
    """Stress measure of the fully solid part, MPa."""

    value: float
    phase: str = "solid part"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SolidAnalysis:
    """What limits read of the fully solid part.

    Attributes
    ----------
    displacement : dict of load case to (3, N) array, mm
    nodes : dict of region to (k,) int array
    measures : dict of load case to tuple of SolidStress
    work : dict of load case to float, N mm
    """

    displacement: dict[str, FloatArray]
    nodes: dict[str, IntArray]
    measures: dict[str, tuple[SolidStress, ...]]
    work: dict[str, float]

    def region_displacement(self, region: str, load_case: str) -> FloatArray:
        """Displacements of the nodes of a region, ``(3, k)``, mm."""
        return self.displacement[load_case][:, self.nodes[region]]

    def largest_displacement(self, load_case: str) -> float:
        """Largest displacement of any node, mm."""
        return float(np.linalg.norm(self.displacement[load_case], axis=0).max())


def solid_analysis(setup: Setup, solutions: tuple[Solution, ...]) -> SolidAnalysis:
    """Measures of the fully solid part; its stress only where a limit reads any."""
    measures: dict[str, tuple[SolidStress, ...]] = {}
    if setup.considered.any() and any(limit.needs_stress for limit in setup.limits):
        weights = np.repeat((setup.model.volumes * setup.considered / 4.0)[:, None], 4, axis=1)
        stiffness = solid_stiffness(setup)
        for case, solution in zip(setup.model.cases, solutions, strict=True):
            stress = element_von_mises(
                setup.space,
                stiffness,
                solution.displacement,
                thermal_strain=setup.material.thermal_expansion * case.temperature_change,
            )
            value = weighted_percentile(stress, weights, setup.case.limits.percentile)
            measures[case.name] = (SolidStress(value=value),)
    density = np.full(setup.space.element_count, setup.material.density)
    forces = [mechanical_force(setup.space, case, density) for case in setup.model.cases]
    return SolidAnalysis(
        displacement={s.name: s.displacement for s in solutions},
        nodes={name: region_nodes(setup.space, found) for name, found in setup.facets.items()},
        measures=measures,
        work=work_of(forces, solutions),
    )


def with_solid(setup: Setup, solutions: tuple[Solution, ...]) -> Setup:
    """The setup with what the solid part shows: its rows, and limits relative to it resolved.

    Raises
    ------
    CaseError
        If a limit is relative to a value that is nothing in the solid part.
    """
    analysis = solid_analysis(setup, solutions)
    limits = tuple(_resolved(setup, limit, analysis) for limit in setup.limits)
    setup = replace(setup, limits=limits)
    return replace(setup, solid=limit_rows(limits, analysis, "solid part"))


def _resolved(setup: Setup, limit: Limit, analysis: SolidAnalysis) -> Limit:
    """A limit in its unit: so many times what the solid part has in this load case."""
    if limit.times_solid is None:
        return limit
    value = limit.rows(analysis, "solid part")[0].value
    if value <= limit.rest(analysis):
        raise CaseError(
            f"{setup.case.where(limit.case_key)}: found {limit.stated}, but {limit.name} of the "
            f"solid part is {value:.3g} {limit.unit} in load case '{limit.key.load_case}'; "
            f"expected more: state a value in {limit.unit}, or name the load_case it is meant for"
        )
    return replace(limit, allowed=limit.times_solid * value)
