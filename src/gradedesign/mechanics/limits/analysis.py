"""Analysis of the solid part or of the explicit lattice, as limits read it."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Protocol

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.limits.banded import Banded


class PhaseStress(Protocol):
    """Stress measure of one phase of the solid."""

    @property
    def phase(self) -> str:
        """Name of the phase."""

    @property
    def value(self) -> float:
        """Volume percentile of the von Mises stress outside the exclusion radius, MPa."""

    @property
    def maximum(self) -> float:
        """Largest von Mises stress there, MPa."""

    @property
    def maximum_place(self) -> tuple[float, float, float] | None:
        """Where it is, mm; None where that is not known."""

    @property
    def band(self) -> Banded | None:
        """Band of `value`; None where one resolution alone does not tell."""


class Analysis(Protocol):
    """Displacements, stress measures and work of every load case; no mesh."""

    @property
    def measures(self) -> Mapping[str, Sequence[PhaseStress]]:
        """Stress measures by load case, the phases in one order."""

    @property
    def judged_share(self) -> float:
        """Share of the lattice's volume, or of the solid part's, whose stress is judged."""

    @property
    def work(self) -> Mapping[str, float]:
        """Work of loads and inertia on the displacements they cause, by load case, N mm.

        Force times displacement: twice the strain energy where supports are rigid and nothing is
        heated.
        """

    @property
    def mode_values(self) -> Mapping[Hashable, float]:
        """Natural frequencies, Hz, and load factors by the keys of the limits that ask for them."""

    def region_displacement(self, region: str, load_case: str) -> FloatArray:
        """Displacements of the nodes of a region, ``(3, k)``, mm."""

    def mean_displacement(self, region: str, load_case: str) -> FloatArray:
        """Mean displacement over the area of a region, ``(3,)``, mm."""

    def mean_length(self, region: str, load_case: str) -> float:
        """Mean length of the displacement over the area of a region, mm."""

    def largest_displacement(self, load_case: str) -> float:
        """Largest displacement of any node, mm."""


class SubmodelStress(Protocol):
    """Stress in one submodel of the printed surface, and in the driving analysis."""

    @property
    def value(self) -> float:
        """Stress percentile in the submodel, MPa."""

    @property
    def driving_value(self) -> float:
        """The same percentile of the driving analysis, MPa."""

    @property
    def matches(self) -> bool:
        """Whether boundary force and strain energy match the driving analysis."""
