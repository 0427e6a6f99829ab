"""The base material a lattice is printed in."""

from __future__ import annotations

from dataclasses import dataclass


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
    """

    name: str
    youngs_modulus: float
    poissons_ratio: float
    density: float
    yield_strength: float
    thermal_expansion: float = 0.0
    source: str = "stated in the case"
