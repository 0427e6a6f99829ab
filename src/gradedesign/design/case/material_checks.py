"""Material values that contradict a limit, or that no solid has."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from gradedesign.common.values.problems import Problem
from gradedesign.common.values.units import DIMENSIONS
from gradedesign.mechanics.limits.limits_schema import LimitsSpec
from gradedesign.mechanics.material.material_schema import MaterialSpec

#: Elastic limit over E that no rigid solid exceeds: perfect crystals break near E / 15 (Ashby and
#: Jones, Engineering Materials 1), the strongest wires and glassy polymers yield below E / 20.
_MOST_STRAIN = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class _Span:
    """Values of one property between which all dense solids lie, in its usual unit."""

    key: str
    dimension: str
    unit: str
    least: float
    most: float
    ends: str

    def remark(self, value: float) -> str:
        """Warn of a value in internal units outside the usual range; empty if it is inside."""
        shown = value / DIMENSIONS[self.dimension].units[self.unit]
        if self.least <= shown <= self.most:
            return ""
        words = f"found {shown:g} {self.unit}".rstrip()
        span = f"{self.least:g} and {self.most:g} {self.unit}".rstrip()
        return f"{words}; solids lie between {span}, {self.ends}: is it right?"


#: Ends as in the CRC Handbook of Chemistry and Physics (elements, crystals of carbon) and in the
#: property charts of Ashby, Materials Selection in Mechanical Design (rubbers, woods, cork),
#: widened to round figures: a slip of the unit is a factor of a thousand and falls outside.
_SPANS = (
    _Span(
        key="youngs_modulus", dimension="stress", unit="GPa", least=5e-4, most=1250.0,
        ends="from soft rubber to the stiffest crystal",
    ),
    _Span(
        key="poissons_ratio", dimension="number", unit="", least=0.0, most=0.5,
        ends="from cork to rubber",
    ),
    _Span(
        key="density", dimension="density", unit="g/cm^3", least=0.1, most=23.0,
        ends="from balsa wood to osmium",
    ),
    _Span(
        key="thermal_expansion", dimension="thermal_expansion", unit="um/m/K", least=-10.0,
        most=500.0, ends="from zirconium tungstate to silicone rubber",
    ),
)  # fmt: skip


def material_warnings(spec: MaterialSpec) -> Iterator[Problem]:
    """Warnings about stated values outside those of all dense solids."""
    for span in _SPANS:
        value = getattr(spec, span.key)
        if value is not None and (remark := span.remark(value)):
            yield Problem(key=("material", span.key), message=remark)
    modulus, strength = spec.youngs_modulus, spec.yield_strength
    if modulus is not None and strength is not None and strength > _MOST_STRAIN * modulus:
        yield Problem(
            key=("material", "yield_strength"),
            message=f"found {strength:g} MPa, more than a twentieth of the "
            f"youngs_modulus of {modulus / 1e3:g} GPa, {_MOST_STRAIN * modulus:g} MPa, which no "
            f"metal, ceramic or rigid polymer reaches, only rubbers do: is its unit right?",
        )


def beyond_yield(limits: LimitsSpec, strength: float, modulus: float, *, name: str) -> str:
    """Say why a limit of stress is above the yield strength; empty if it is not.

    ``strength``, ``modulus``, MPa: yield strength, not a number where none is known, and Young's
    modulus. ``name``: of the material.
    """
    stress = limits.stress
    if stress is None or limits.beyond_yield:
        return ""
    if stress > strength:
        return (
            f"found {stress:g} MPa, above the yield strength of {strength:g} MPa of {name}, where "
            f"no linear elastic analysis holds; expected at most {strength:g} MPa, or "
            f"safety_factor = 1.5 in its place; beyond_yield = true in [limits] allows it"
        )
    if math.isnan(strength) and stress > _MOST_STRAIN * modulus:
        return (
            f"found {stress:g} MPa, more than a twentieth of the Young's modulus of {modulus:g} "
            f"MPa of {name}, which no metal, ceramic or rigid polymer bears; expected less than "
            f"{_MOST_STRAIN * modulus:g} MPa; beyond_yield = true in [limits] allows it"
        )
    return ""


def beyond_yield_warning(limits: LimitsSpec, strength: float, *, name: str) -> str:
    """Warning of a limit above yield that the case allows; empty otherwise."""
    if limits.stress is None or not limits.beyond_yield or not limits.stress > strength:
        return ""
    return (
        f"the stress limit of {limits.stress:g} MPa is above the yield strength of {strength:g} "
        f"MPa of {name}, as [limits] beyond_yield allows; the analysis is linear elastic, so that "
        f"its stress and displacements beyond yield are none that the part will show"
    )
