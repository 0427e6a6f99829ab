"""The homogenised part at one density field, as limits read it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.geometry.tets.tet_mesh import centroids, signed_volumes
from gradedesign.mechanics.fe.elastic_system import ElasticSystem
from gradedesign.mechanics.fe.load_case import PartLoadCase, mechanical_force
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.limits.limit import Limit
from gradedesign.mechanics.material.law_field import LawField
from gradedesign.mechanics.sizing.homogenised import (
    homogenised_displacements,
    homogenised_modes,
    homogenised_system,
    mass_density,
    mass_slope,
    solid_held,
)
from gradedesign.mechanics.sizing.homogenised_model import (
    HomogenisedModel,
    effective_density,
    effective_slope,
)
from gradedesign.mechanics.sizing.lattice_stress import (
    LatticeStress,
    lattice_stress,
    local_stress_at,
)
from gradedesign.mechanics.sizing.members import POINTS, at_points
from gradedesign.mechanics.sizing.part_buckling import (
    homogenised_buckling,
    through_load_factors,
)
from gradedesign.mechanics.sizing.solid_strain import solid_stress, through_solid_stress
from gradedesign.mechanics.sizing.stress_slopes import through_buckling, through_local_stress
from gradedesign.mechanics.solver.lowest_modes import Modes

#: Lowest load factors that enter sizing together. Chosen, not measured.
LOAD_FACTORS = 5
#: Modes that are found beyond the one that a limit asks for: equal ones enter sizing together.
#: Chosen, not measured.
_BEYOND = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SolvedState:
    """A `HomogenisedState`: the model, the densities and what solves their load cases."""

    model: HomogenisedModel
    rho: FloatArray  #: ``(M,)``.
    #: ``(4 M,)``. Of the room for lattice at every Gauss point that solid members take; None: no
    #: members.
    share: FloatArray | None
    lattice_alone: HomogenisedModel  #: The model without these members.
    displacements: dict[str, FloatArray]  #: By load case, each ``(3, N)``, mm.
    stress: dict[str, LatticeStress]  #: By load case. Empty unless a limit needs it.
    #: By load case. Of those whose modes a limit asks for.
    natural_modes: dict[str, Modes] = field(default_factory=dict)
    buckling_modes: dict[str, Modes] = field(default_factory=dict)

    @property
    def load_cases(self) -> Sequence[str]:
        """Names of the load cases."""
        return tuple(case.name for case in self.model.cases)

    @property
    def effective_density(self) -> FloatArray:
        """Effective relative density, ``(M,)``."""
        return effective_density(self.model, self.rho)

    @property
    def lattice_volumes(self) -> FloatArray:
        """Volume that lattice fills, ``(M,)``, mm^3."""
        return self.model.lattice_volumes

    @property
    def nodes(self) -> FloatArray:
        """Nodes of the space, ``(3, N)``, mm."""
        return self.model.space.nodes

    @property
    def centroids(self) -> FloatArray:
        """Centroids of the tetrahedra, ``(3, M)``, mm."""
        return centroids(self.model.space.mesh)

    @property
    def law(self) -> LawField:
        """Laws of the lattice."""
        return self.model.law

    def displacement(self, load_case: str) -> FloatArray:
        """Nodal displacements, ``(3, N)``, mm."""
        return self.displacements[load_case]

    def modes(self, load_case: str) -> Modes:
        """Lowest modes about the supports of a load case."""
        return self.natural_modes[load_case]

    def load_factors(self, load_case: str) -> Modes:
        """Lowest modes in which the part buckles under a load case."""
        return self.buckling_modes[load_case]

    def through_load_factors(
        self, load_case: str, by_factor: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives by displacements ``(3, N)`` and by the design, see `through_load_factors`."""
        return through_load_factors(
            self.model,
            self.rho,
            None if self.share is None else self.lattice_alone,
            case_named(self.model, load_case),
            self.displacement(load_case),
            self.load_factors(load_case),
            by_factor,
        )

    def force(self, load_case: str) -> FloatArray:
        """Nodal forces of loads and inertia, ``(3, N)``, N."""
        case = case_named(self.model, load_case)
        return mechanical_force(self.model.space, case, mass_density(self.model, self.rho))

    def force_slope(self, load_case: str, displacement: FloatArray) -> FloatArray:
        """Derivative by every variable of the design of the work of those forces, (P,), N mm."""
        return force_slope(self, case_named(self.model, load_case), displacement)

    def local_stress(self, load_case: str) -> FloatArray:
        """Predicted von Mises stress in the solid of the lattice, ``(M,)``, MPa."""
        return local_stress_at(self.model, self.stress[load_case], self.rho)

    def through_local_stress(
        self, load_case: str, by_local: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives by displacements ``(3, N)`` and densities, see `through_local_stress`."""
        return through_local_stress(
            self.model,
            self.rho,
            case_named(self.model, load_case),
            self.displacement(load_case),
            self.stress[load_case],
            by_local,
        )

    def by_design(self, by_effective: FloatArray, by_volume: FloatArray) -> FloatArray:
        """Derivatives by the variables of the design of those by densities and volumes, (P,)."""
        by_density = by_effective * effective_slope(self.model, self.rho)
        if self.share is None:
            return np.asarray(by_density)
        return np.concatenate(
            [by_density, at_points(-by_volume * self.lattice_alone.lattice_volumes)]
        )

    @property
    def member_volumes(self) -> FloatArray:
        """Volume that solid members fill, ``(M,)``, mm^3."""
        share = self.model.member_fraction
        return np.zeros(self.rho.shape) if share is None else self.model.volumes * share

    def solid_stress(self, load_case: str) -> FloatArray:
        """Mean over a tetrahedron of the von Mises stress of the base material, ``(M,)``, MPa."""
        case = case_named(self.model, load_case)
        return solid_stress(self.model, case, self.displacement(load_case))

    def through_solid_stress(self, load_case: str, by_stress: FloatArray) -> FloatArray:
        """Derivatives by displacements ``(3, N)``, see `through_solid_stress`."""
        case = case_named(self.model, load_case)
        return through_solid_stress(self.model, case, self.displacement(load_case), by_stress)

    def by_member_volume(self, by_volume: FloatArray) -> FloatArray:
        """Derivatives by the variables of the design of those by volumes of members, ``(P,)``."""
        none = np.zeros(self.rho.shape)
        if self.share is None:
            return none
        return np.concatenate([none, at_points(by_volume * self.lattice_alone.lattice_volumes)])

    def by_density(self, by_density: FloatArray) -> FloatArray:
        """Derivatives ``(P,)`` of what depends on nominal densities alone, ``(M,)``."""
        none = np.zeros(0 if self.share is None else len(self.share))
        return np.concatenate([by_density, none])

    def buckling_profile(self, load_case: str) -> FloatArray:
        """Use of the resistance against buckling, as `LawField.buckling_profile`, ``(b, M)``."""
        return self.stress[load_case].buckling

    def through_buckling(self, load_case: str, by_use: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Derivatives by displacements ``(3, N)`` and densities, see `through_buckling`."""
        return through_buckling(
            self.model,
            self.rho,
            case_named(self.model, load_case),
            self.displacement(load_case),
            self.stress[load_case],
            by_use,
        )


def solved_state(
    model: HomogenisedModel,
    rho: FloatArray,
    limits: Sequence[Limit],
    system: ElasticSystem | None = None,
    *,
    share: FloatArray | None = None,
    lattice_alone: HomogenisedModel | None = None,
    rtol: float | None = None,
) -> SolvedState:
    """Solve every load case for densities ``(M,)``, with the stress if a limit needs it.

    Parameters
    ----------
    model : HomogenisedModel
        With its solid members.
    system : ElasticSystem, optional
        Of these densities by `homogenised_system`, where it is at hand.
    share, lattice_alone
        As in `SolvedState`, where the members are variables.
    rtol : float, optional
        As for `homogenised_displacements`.
    """
    system = system or homogenised_system(model, rho)
    displacements = homogenised_displacements(model, rho, system, rtol)
    stress: Mapping[str, LatticeStress] = {}
    if any(limit.needs_stress for limit in limits):
        stresses = lattice_stress(model, rho, displacements)
        stress = {case.name: value for case, value in zip(model.cases, stresses, strict=True)}
    return SolvedState(
        model=model,
        rho=rho,
        share=share,
        lattice_alone=model if lattice_alone is None else lattice_alone,
        displacements=displacements,
        stress=dict(stress),
        natural_modes={
            name: homogenised_modes(model, rho, system, name, number + _BEYOND)
            for name, number in _highest_modes(limits, buckling=False).items()
        },
        buckling_modes={
            name: homogenised_buckling(
                model, system, case_named(model, name), displacements[name], LOAD_FACTORS
            )
            for name in _highest_modes(limits, buckling=True)
        },
    )


def _highest_modes(limits: Sequence[Limit], *, buckling: bool) -> dict[str, int]:
    """Greatest number of a mode that limits ask for, by load case."""
    highest: dict[str, int] = {}
    for limit in limits:
        goal = limit.mode()
        if goal is not None and goal.buckling is buckling:
            highest[goal.load_case] = max(goal.number, highest.get(goal.load_case, 0))
    return highest


def mode_shapes(state: SolvedState) -> list[FloatArray]:
    """Shapes of all modes of a state, ``(3, N)`` each."""
    found = (*state.natural_modes.values(), *state.buckling_modes.values())
    return [x.reshape(-1, 3).T for modes in found for x in modes.shapes]


def case_named(model: HomogenisedModel, name: str) -> PartLoadCase:
    """The load case of a model by its name."""
    return next(case for case in model.cases if case.name == name)


def mass_slopes(state: SolvedState) -> list[FloatArray]:
    """Derivatives of the mass density by densities, and by shares of members, ``(M,)`` each."""
    slopes = [mass_slope(state.model, state.rho)]
    if state.share is not None:
        room = 1 - state.lattice_alone.solid_fraction
        void = 1 - solid_held(state.model, state.rho)
        each = np.asarray(state.model.material.density * room * void) / POINTS
        slopes += [each] * POINTS
    return slopes


def force_slope(state: SolvedState, case: PartLoadCase, displacement: FloatArray) -> FloatArray:
    """Derivative by every variable of the design of the work of inertia, ``(P,)``, N mm."""
    slopes = mass_slopes(state)
    if not np.any(case.acceleration):
        return np.zeros(sum(map(len, slopes)))
    work = _body_force_work(state.model.space, case.acceleration, displacement)
    return np.concatenate([work * slope for slope in slopes])


def _body_force_work(
    space: TetSpace, acceleration: FloatArray, displacement: FloatArray
) -> FloatArray:
    """Integral of ``acceleration . displacement`` over every element, ``(M,)``, mm^5/s^2.

    Multiplied by mass per volume it is the work of inertia forces in N mm.
    """
    projected = np.asarray(acceleration) @ displacement
    values = projected[space.elements]
    if space.order == 1:
        mean = values.mean(axis=0)
    else:
        mean = 0.2 * values[4:].sum(axis=0) - 0.05 * values[:4].sum(axis=0)
    return signed_volumes(space.mesh) * mean
