"""Fatigue: stress in the solid of lattice and members, for loads that come and go many times.

What is allowed is the largest stress of a cycle that the solid bears so often, by the S-N curve of
the material in the surface condition that is printed. Measured, predicted and judged as stress of
loads that act once is: stress grows with the loads, so that all of it has their ratio.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, ClassVar

from pydantic import Field

from gradedesign.common.values.suggest import listed, shown
from gradedesign.common.values.value_types import Name, Number
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.limits.limit import Limit, LimitKind, PlacedModel, StatedLimit
from gradedesign.mechanics.limits.limits_schema import LimitEntry, LimitsSpec
from gradedesign.mechanics.limits.local_stress import stress_limits
from gradedesign.mechanics.material.material import Material

#: Fatigue strength of tested lattices of Ti-6Al-4V, of several cells, over their yield stress: the
#: least and the largest that de Jonge, Kolken and Zadpoor (Materials 12, 2019, 635, doi
#: 10.3390/ma12040635) give in their abstract, beside 0.4 of the solid.
_TESTED_LATTICES = (0.12, 0.36)


class FatigueEntry(LimitEntry):
    """Cycles that a load case is borne for; without one, every load case by itself.

    The load case is the largest load of the cycle; at the least one its loads are ``ratio`` times
    as large.
    """

    called: ClassVar[Mapping[str, str]] = {
        "n": "cycles",
        "life": "cycles",
        "r": "ratio",
        "stress_ratio": "ratio",
        "load_ratio": "ratio",
        "surface_condition": "surface",
        "factor_of_safety": "safety_factor",
    }
    allowing: ClassVar[tuple[str, ...]] = ("cycles", "ratio", "surface", "safety_factor")

    cycles: Annotated[float, Number(at_least=1.0, at_most=1e12)] = Field(examples=[1e6])
    """Number of cycles."""
    ratio: Annotated[float, Number(at_least=-1.0, below=1.0)] = Field(examples=[0.1])
    """R: least over largest load of the cycle; 0 where it is taken off, -1 where it is reversed."""
    surface: Name = Field(examples=["as-built"])
    """Surface condition of the S-N curve of the material: that of the printed walls and struts."""
    safety_factor: Annotated[float, Number(at_least=1.0, at_most=1000.0)] = Field(examples=[1.5])
    """Stress of the S-N curve over the allowed one; half of all specimens fail below a mean curve,
    which 1 would be."""

    @property
    def words(self) -> str:
        """Cycles, ratio and surface."""
        return f"{self.cycles:g} cycles at R = {self.ratio:g}, {self.surface}"

    def allowed(self, material: Material) -> float:
        """Allowed stress at the largest load of the cycle, MPa.

        Of a material that it does not refuse.
        """
        curve = material.fatigue_curve(self.surface)
        if curve is None:
            return math.nan
        return curve.largest_stress(self.cycles, self.ratio) / self.safety_factor

    def tested(self, material: Material) -> tuple[str, ...]:
        """Sentence on lattices that were tested, where some of them bore less than is allowed."""
        share, (least, most) = self.allowed(material) / material.yield_strength, _TESTED_LATTICES
        if share <= least:
            return ()
        return (
            f"fatigue, {self.words}: {share:.0%} of the yield strength are allowed in the solid of "
            f"the lattice, by the S-N curve of {material.name}; no tests of these cells stand "
            f"behind it: lattices of Ti-6Al-4V bore {least:.0%} to {most:.0%} of their yield "
            f"stress, and a safety_factor of {self.safety_factor * share / least:.2g} would allow "
            f"{least:.0%}",
        )

    def refusal(self, material: Material) -> tuple[str, str] | None:
        """Where the material has no data on such cycles, or bears more than yielding for them."""
        curve = material.fatigue_curve(self.surface)
        if curve is None:
            known = listed(c.words for c in material.fatigue)
            has = f"known: {known}; expected one of them or" if known else "nor any other; expected"
            return "surface", (
                f"found {shown(self.surface)}, of which {material.name} has no S-N curve, {has} "
                f'your own as [material] fatigue = [{{surface = "{self.surface}", ratio = -1, '
                f'cycles = [1e4, 1e7], amplitude = ["... MPa", "... MPa"]}}]'
            )
        if not curve.holds(self.cycles):
            return "cycles", (
                f"found {self.cycles:g}, outside the S-N curve of {material.name}, {curve.words}; "
                f"expected cycles that were tested, or your own curve as [material] fatigue"
            )
        allowed, strength = self.allowed(material), material.yield_strength
        if allowed > strength:
            return "cycles", (
                f"found {self.words}, for which {material.name} bears {allowed:.4g} MPa, above its "
                f"yield strength of {strength:.4g} MPa, where no linear elastic analysis holds; "
                f"expected a safety_factor of at least "
                f"{self.safety_factor * allowed / strength:.3g}, or safety_factor of [limits] in "
                f"place of this limit"
            )
        return None


def _entries(limits: LimitsSpec) -> Sequence[FatigueEntry]:
    """Stated entries, where the case may state any."""
    return getattr(limits, KIND.name, ())


def _make(limits: LimitsSpec, placed: PlacedModel) -> tuple[Sequence[Limit], Sequence[str]]:
    made: list[Limit] = []
    warnings: list[str] = []
    for entry in _entries(limits):
        if placed.cells:
            warnings += entry.tested(placed.material)
        for load in entry.judged(placed.load_cases):
            found, told = stress_limits(
                limits,
                placed,
                entry.allowed(placed.material),
                kind=KIND.name,
                load_case=load.name,
                cycle=entry.words,
            )
            made += found
            warnings += told
    return made, warnings


def _stated(
    limits: LimitsSpec, load_cases: Sequence[LoadCaseSpec], material: Material
) -> Sequence[StatedLimit]:
    return [
        StatedLimit(
            name=f"{KIND.name}, {entry.words}",
            load_case=load.name,
            allowed=f"{entry.allowed(material):.4g} MPa",
        )
        for entry in _entries(limits)
        for load in entry.judged(load_cases)
    ]


#: ``fatigue = [{cycles = 1e6, ratio = 0.1, surface = "as-built", safety_factor = 1.5}]``.
KIND = LimitKind(name="fatigue", make=_make, stated=_stated, entry=FatigueEntry)
