"""A first answer without any explicit analysis: one density for the whole part, and one sizing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from gradedesign.common.system.progress import report_step
from gradedesign.design.check.price import (
    SIZING_ITERATIONS,
    PricedBody,
    price_of_lattice,
    why_lattice,
)
from gradedesign.design.loop.designed import with_design
from gradedesign.design.loop.iteration_steps import SizingPlan, design_filter, size_design
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.design.resolve.oriented import oriented
from gradedesign.design.resolve.size_effects import with_size_effects
from gradedesign.errors import DensityError
from gradedesign.mechanics.explicit.correction import Correction
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.verdict import solid_breaks
from gradedesign.mechanics.material.constant_density import (
    density_for_stiffness,
    density_for_strength,
)
from gradedesign.mechanics.sizing.homogenised import total_mass
from gradedesign.mechanics.sizing.homogenised_model import built_density


@dataclass(frozen=True, slots=True, kw_only=True)
class ConstantDensity:
    """One density for the whole lattice at which one limit holds, from the solid part alone."""

    row: LimitRow  #: The limit with its value on the fully solid part.
    #: Least density in the bounds of the case; None where none of them is enough.
    density: float | None
    mass_g: float | None  #: Of the part with that lattice, its skin and passive regions included.
    reason: str = ""  #: Why there is no density; empty where there is one.


@dataclass(frozen=True, slots=True, kw_only=True)
class FirstAnswer:
    """Constant densities beside the outcome of one sizing."""

    constant: tuple[ConstantDensity, ...]  #: One per limit.
    #: Predicted mass of the graded design; None where the solid part breaks a limit already.
    sized_mass_g: float | None = None
    sized_density: float | None = None  #: Its mean over the lattice.
    sized_utilisation: float | None = None  #: Largest predicted utilisation of a limit.
    yields: tuple[str, ...] = ()  #: Warning that the fully solid part yields away from supports.
    #: Other bodies that hold the same limits, and the one that the case asks for.
    bodies: tuple[PricedBody, ...] = ()
    run_s: Mapping[str, float] = field(default_factory=dict)  #: s, that a run takes, by body.

    @property
    def feasible(self) -> bool:
        """Whether the fully solid part may hold every limit; a run ends infeasible where not."""
        return not solid_breaks([answer.row for answer in self.constant])

    @property
    def why_lattice(self) -> str:
        """One sentence on the body that the case asks for beside the others."""
        return why_lattice(self.bodies)

    @property
    def governing(self) -> ConstantDensity | None:
        """The limit that needs the greatest density; None where one cannot be met."""
        if not self.constant or any(answer.density is None for answer in self.constant):
            return None
        return max(self.constant, key=lambda answer: answer.density or 0.0)


def first_answer(model: DesignModel) -> FirstAnswer:
    """Constant densities that meet the limits, and one sizing of the homogenised part.

    ``model``: its solid part analysed, see `solid.with_solid`.

    Notes
    -----
    A constant density scales displacements of the solid part by ``1 / E*`` along the softest cell
    axis and its stress by one over the law's strength, which is exact for a homogeneous isotropic
    copy of the part (Ramirez Salazar 2022, eqs. 1.8 to 1.11). Skin and passive regions count in
    the mass alone. Buckling and size effects count in the sizing, where the case has them.
    """
    constant = tuple(_constant(model, row) for row in model.solid)
    answer = FirstAnswer(constant=constant, yields=model.solid_yields)
    if not answer.feasible:
        return answer
    model = with_size_effects(oriented(model))
    report_step("sizing")
    settings = SizingPlan(most_iterations=SIZING_ITERATIONS)
    sized = size_design(model, Correction(), {}, design_filter(model), settings)
    part = with_design(model, sized.rho, sized.members).homogenised
    weights = part.lattice_volumes
    return replace(
        answer,
        sized_mass_g=total_mass(part, sized.rho) * 1e6,
        sized_density=float(weights @ built_density(part, sized.rho) / weights.sum()),
        sized_utilisation=sized.history[-1].utilisation,
        bodies=price_of_lattice(model),
    )


def _constant(model: DesignModel, row: LimitRow) -> ConstantDensity:
    """The constant density of one limit."""
    if row.unfavourable == "low":
        reason = "no rule gives the density at which a least value holds; sizing finds it"
        return ConstantDensity(row=row, density=None, mass_g=None, reason=reason)
    if row.broken:
        return ConstantDensity(row=row, density=None, mass_g=None, reason="broken when solid")
    stiff = {limit.key.kind for limit in model.limits if limit.follows_stiffness}
    least = density_for_stiffness if row.key.kind in stiff else density_for_strength
    try:
        needed = [least(law, row.utilisation) for law in model.homogenised.law.laws]
        density = max(*needed, model.cells.bounds[0])
    except DensityError as error:
        return ConstantDensity(row=row, density=None, mass_g=None, reason=str(error))
    if density > model.cells.bounds[1]:
        reason = f"needs density {density:.3g}, at most {model.cells.bounds[1]:.3g} is allowed"
        return ConstantDensity(row=row, density=None, mass_g=None, reason=reason)
    part = model.homogenised
    mass = total_mass(part, np.full(part.volumes.size, density))
    return ConstantDensity(row=row, density=density, mass_g=mass * 1e6)
