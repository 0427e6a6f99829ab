"""The base material a lattice is printed in."""

from __future__ import annotations

from dataclasses import dataclass

from gradedesign.mechanics.material.fatigue_curve import FatigueCurve


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """An isotropic, linear elastic base material.

    Attributes
    ----------
    youngs_modulus : float, MPa
    density : float, t/mm^3
    yield_strength : float, MPa
        0.2 % proof stress or, for polymers, tensile yield.
    thermal_expansion : float, 1/K
    source : str
        Where the figures come from.
    fatigue : tuple of FatigueCurve
        S-N curves, one of every surface condition that is known.
    """

    name: str
    youngs_modulus: float
    poissons_ratio: float
    density: float
    yield_strength: float
    thermal_expansion: float = 0.0
    source: str = "stated in the case"
    fatigue: tuple[FatigueCurve, ...] = ()

    def fatigue_curve(self, surface: str) -> FatigueCurve | None:
        """The S-N curve of a surface condition; None where none is known."""
        return next((curve for curve in self.fatigue if curve.surface == surface), None)
