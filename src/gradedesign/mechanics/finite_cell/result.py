"""Solution of an analysis by finite cells, and values of it at points and regions."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.finite_cell.elements import Elements
from gradedesign.mechanics.finite_cell.space import BrickSpace
from gradedesign.mechanics.finite_cell.stress import displacement_at as displacement_in
from gradedesign.mechanics.finite_cell.stress import solid_points
from gradedesign.mechanics.finite_cell.surface import SurfacePoints
from gradedesign.mechanics.finite_cell.traction_residual import GoalResidual


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModeValue:
    """A natural frequency, or the factor of the loads at which the solid buckles."""

    value: float  #: Of a frequency in Hz.
    shape: FloatArray  #: ``(N, 3)``. Whose strain energy is 1/2; only its form means something.
    buckling: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CaseSolution:
    """Displacement of one load case."""

    name: str
    u: FloatArray  #: ``(N, 3)``, mm. At the nodes of the elements.
    energy: float  #: N mm. Strain energy, that of springs and of the soft void included.
    work: float  #: N mm. Of loads and inertia on the displacements they cause.
    iterations: int
    residual: float  #: Norm of unbalanced forces over that of the right-hand side.
    thermal_strain: float
    #: What finer elements add to the work, but for a factor, see `traction_residual`. None where
    #: displacements are prescribed or the solid is heated: then the work says less of the error;
    #: and where elements have two sizes.
    traction_residual: float | None
    #: The same of the goals of the problem in this load case, whatever acts in it.
    goals: Mapping[Hashable, GoalResidual] = field(default_factory=dict)
    #: Those of the problem in this load case.
    modes: Mapping[Hashable, ModeValue] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FiniteCellResult:
    """Displacements of every load case on the elements."""

    elements: Elements
    space: BrickSpace
    solutions: tuple[CaseSolution, ...]  #: One per load case.
    places: dict[str, SurfacePoints]  #: By name. Where the solid reaches each region.
    volume: float  #: mm^3.
    spacing: float  #: mm. Longest edge of an element; of the small ones where there are two sizes.
    unknowns: int
    processor_seconds: float  #: s.
    moduli: FloatArray  #: ``(2, 3, 3)``, MPa, as `Material.moduli`.
    #: On planes that are not aligned and components that were left out.
    notes: tuple[str, ...] = ()

    @property
    def mode_values(self) -> dict[Hashable, float]:
        """Natural frequencies, Hz, and load factors by the keys of the problem's modes."""
        return {key: mode.value for s in self.solutions for key, mode in s.modes.items()}

    @property
    def work(self) -> dict[str, float]:
        """Work of loads and inertia on the displacements they cause, by load case, N mm."""
        return {s.name: s.work for s in self.solutions}

    def region_displacement(self, region: str, load_case: str) -> FloatArray:
        """Displacements where the solid reaches a region, ``(3, k)``, mm."""
        at = self.places[region]
        u = solution_of(self, load_case).u
        return displacement_in(self.elements, self.space, u, at.element, at.points)

    def mean_displacement(self, region: str, load_case: str) -> FloatArray:
        """Mean displacement over the area where the solid reaches a region, ``(3,)``, mm."""
        area = self.places[region].area
        mean: FloatArray = self.region_displacement(region, load_case) @ area / area.sum()
        return mean

    def mean_length(self, region: str, load_case: str) -> float:
        """Mean length of the displacement over the area where the solid reaches a region, mm."""
        area = self.places[region].area
        lengths = np.linalg.norm(self.region_displacement(region, load_case), axis=0)
        return float(lengths @ area / area.sum())

    def largest_displacement(self, load_case: str) -> float:
        """Largest displacement of the solid, mm: of the centroids of its sub-cells."""
        at = solid_points(self.elements)
        u = solution_of(self, load_case).u
        displacement = displacement_in(self.elements, self.space, u, at.element, at.points)
        return float(np.linalg.norm(displacement, axis=0).max())


def solution_of(result: FiniteCellResult, load_case: str) -> CaseSolution:
    """Solution of a load case by name."""
    return next(s for s in result.solutions if s.name == load_case)
