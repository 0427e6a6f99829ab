"""State of the homogenised part as limits read it, and their predictions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.material.law_field import LawField
from gradedesign.mechanics.solver.lowest_modes import Modes


class HomogenisedState(Protocol):
    """A density field with the displacements and stresses of every load case.

    M tetrahedra, N nodes, P variables: the density of every tetrahedron and then, where solid
    members are designed, the share that they take of its room for lattice. Stresses are there only
    for limits that say `Limit.needs_stress`.
    """

    @property
    def load_cases(self) -> Sequence[str]:
        """Names of the load cases, in the order of the case."""

    @property
    def rho(self) -> FloatArray:
        """Nominal relative density of the lattice, ``(M,)``."""

    @property
    def effective_density(self) -> FloatArray:
        """Effective relative density: that of the cells as the part's faces trim them, ``(M,)``."""

    @property
    def lattice_volumes(self) -> FloatArray:
        """Volume that lattice fills, ``(M,)``, mm^3: zero in passive solid regions."""

    @property
    def nodes(self) -> FloatArray:
        """Nodes, edge middles included, ``(3, N)``, mm."""

    @property
    def centroids(self) -> FloatArray:
        """Centroids of the tetrahedra, ``(3, M)``, mm."""

    @property
    def law(self) -> LawField:
        """Laws of stiffness and strength of the lattice."""

    def displacement(self, load_case: str) -> FloatArray:
        """Nodal displacements, ``(3, N)``, mm."""

    def modes(self, load_case: str) -> Modes:
        """Lowest modes about the supports of a load case; for limits that ask, `Limit.mode`."""

    def load_factors(self, load_case: str) -> Modes:
        """Lowest modes in which the part buckles; for limits that ask, `Limit.mode`."""

    def through_load_factors(
        self, load_case: str, by_factor: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives by displacements ``(3, N)``, and by the design at these, ``(P,)``.

        ``by_factor`` holds those of a value by each of the load factors.
        """

    def force(self, load_case: str) -> FloatArray:
        """Nodal forces of loads and inertia, without reactions and thermal forces, (3, N), N."""

    def force_slope(self, load_case: str, displacement: FloatArray) -> FloatArray:
        """Derivative by every variable of the work of those forces, ``(P,)``, N mm."""

    def local_stress(self, load_case: str) -> FloatArray:
        """Predicted von Mises stress in the solid of the lattice, ``(M,)``, MPa."""

    def by_design(self, by_effective: FloatArray, by_volume: FloatArray) -> FloatArray:
        """Derivatives ``(P,)`` of those by effective densities and by volumes of lattice, (M,)."""

    @property
    def member_volumes(self) -> FloatArray:
        """Volume that solid members fill, ``(M,)``, mm^3."""

    def solid_stress(self, load_case: str) -> FloatArray:
        """Von Mises stress of the base material strained as the tetrahedra are, ``(M,)``, MPa."""

    def through_solid_stress(self, load_case: str, by_stress: FloatArray) -> FloatArray:
        """Derivatives by displacements ``(3, N)`` of those by the stress in solid, ``(M,)``."""

    def by_member_volume(self, by_volume: FloatArray) -> FloatArray:
        """Derivatives ``(P,)`` of those by the volumes of members, ``(M,)``."""

    def by_density(self, by_density: FloatArray) -> FloatArray:
        """Derivatives ``(P,)`` of what depends on nominal densities alone, ``(M,)``."""

    def through_local_stress(
        self, load_case: str, by_local: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives of a value by displacements, (3, N), and by densities at these, ``(M,)``.

        ``by_local`` holds its derivatives by the local stress of every tetrahedron, ``(M,)``.
        """

    def buckling_profile(self, load_case: str) -> FloatArray:
        """Use of the resistance against buckling, as `LawField.buckling_profile`, ``(b, M)``."""

    def through_buckling(self, load_case: str, by_use: FloatArray) -> tuple[FloatArray, FloatArray]:
        """As `through_local_stress`, of a value with derivatives ``(2, M)`` by `LawField.buckling`.

        At fixed displacements by nominal densities.
        """


@dataclass(frozen=True, slots=True, kw_only=True)
class Predicted:
    """A value that the homogenised part predicts for a limit, corrections included.

    Attributes
    ----------
    value : float
        In the unit of the limit.
    load_case : str
        That governs.
    place : (float, float, float) or None, mm
        Where the value is taken, if that is one place.
    governs : str
        What governs there, in words; empty: there is nothing to tell apart.
    extrapolated : str
        Why the value rests on no data, in words; empty where it does.
    """

    value: float
    load_case: str
    place: tuple[float, float, float] | None = None
    governs: str = ""
    extrapolated: str = ""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModeShape:
    """The mode that a value belongs to."""

    shape: FloatArray  #: ``(3, N)``. Normalised so that the work of the stiffness on it is 1.
    square: float  #: 1/s^2. Of the angular frequency.
    by_square: float  #: Derivative of the value by it.


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Response:
    """A value with its derivative by the nodal displacements, or its mode: its gradient follows.

    That of a mode needs no adjoint problem: its shape makes the frequency stationary.

    Attributes
    ----------
    name : str
        For progress and messages.
    value : float
        In the unit of the limit, corrections included.
    by_displacement : (3, N) array or None
        Derivative of the value by every nodal displacement: the load of the adjoint problem.
    by_design : (P,) array or None
        Derivative by every variable of the design at fixed displacements; None: there is none.
    mode : ModeShape or None
        In place of the other derivatives.
    shape : (3, N) array or None
        Displacements whose strain energy of 1 resists the value, as that of displacement and
        adjoint does for others.
    """

    name: str
    load_case: str
    value: float
    by_displacement: FloatArray | None = None
    by_design: FloatArray | None = None
    mode: ModeShape | None = None
    shape: FloatArray | None = None
