"""Law of void: a solid of hardly any stiffness and mass, so that systems stay well conditioned."""

from __future__ import annotations

from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawOrigin

#: Relative density, and relative stiffness, of void: a hundredth of what light lattice has, so that
#: no load goes through it, and enough for systems to stay well conditioned.
VOID_DENSITY = 1e-4
#: It cannot break: its strength is that of no material.
VOID_LAW = power_law(
    "void", ("void",), youngs=(1.0, 1.0), strength=(1e6, 1.0), window=(0.5 * VOID_DENSITY, 1.0),
    origin=LawOrigin(kind="fe", source="not a lattice", test="none"),
)  # fmt: skip
