"""The base material a lattice is printed in."""

from __future__ import annotations

from dataclasses import dataclass, replace

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.material.elasticity import (
    BuildStiffness,
    principal_moduli,
    stiffness_matrix,
)
from gradedesign.mechanics.material.fatigue_curve import FatigueCurve


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """A linear elastic base material, isotropic but for what is built another way.

    Attributes
    ----------
    youngs_modulus : float, MPa
        Across the build direction, where `build` is stated.
    density : float, t/mm^3
    yield_strength : float, MPa
        0.2 % proof stress or, for polymers, tensile yield.
    thermal_expansion : float, 1/K
    source : str
        Where the figures come from.
    fatigue : tuple of FatigueCurve
        S-N curves, one of every surface condition that is known.
    build : BuildStiffness or None
        How much stiffer it is along the direction it is built in; None: isotropic.
    """

    name: str
    youngs_modulus: float
    poissons_ratio: float
    density: float
    yield_strength: float
    thermal_expansion: float = 0.0
    source: str = "stated in the case"
    fatigue: tuple[FatigueCurve, ...] = ()
    build: BuildStiffness | None = None

    @property
    def stiffness(self) -> FloatArray:
        """Stiffness ``(6, 6)``, MPa, in Voigt order xx, yy, zz, yz, zx, xy."""
        return stiffness_matrix(self.youngs_modulus, self.poissons_ratio, self.build)

    @property
    def moduli(self) -> FloatArray:
        """Couplings of normal stresses and strains, and shear moduli, ``(2, 3, 3)``, MPa."""
        return principal_moduli(self.stiffness)

    def built(
        self, axis: int, across: float, along: float | None = None, shear: float | None = None
    ) -> Material:
        """The material as it is built along an axis, 0 to 2.

        ``across``, ``along``: Young's modulus across and along the axis over that of the material;
        None: the same in all directions. ``shear``: as in `BuildStiffness`.
        """
        build = None
        if along is not None:
            build = BuildStiffness(axis=axis, along=along / across, shear=shear)
        return replace(self, youngs_modulus=across * self.youngs_modulus, build=build)

    def fatigue_curve(self, surface: str) -> FatigueCurve | None:
        """The S-N curve of a surface condition; None where none is known."""
        return next((curve for curve in self.fatigue if curve.surface == surface), None)
