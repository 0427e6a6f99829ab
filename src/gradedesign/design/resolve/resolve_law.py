"""The law of a case's cell: a registered one, or one computed for its parameters."""

from __future__ import annotations

import numpy as np

from gradedesign.common.system.progress import Event, Listener, ignore
from gradedesign.common.values.locate import Where
from gradedesign.design.resolve.planned_law import (
    changed_parameters,
    planned_law,
    proportion,
    require_strength,
    values_in_words,
)
from gradedesign.design.resolve.registry import Registry
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.mechanics.homogenise.cached_table import computed_law
from gradedesign.mechanics.homogenise.cell_properties import CellProperties
from gradedesign.mechanics.limits.limits_schema import LimitsSpec
from gradedesign.mechanics.material.long_waves import critical_long_waves
from gradedesign.mechanics.material.power_fit import gibson_ashby
from gradedesign.mechanics.material.scaling_law import ScalingLaw, has_strength

#: Difference of Poisson's ratios from which a warning says so. Per 0.05, measured on four cells at
#: density 0.3: up to 2.5 % in E, G and strength, 9 % in bulk modulus.
_RATIO_TOLERANCE = 0.05


def resolve_law(
    lattice: LatticeSpec,
    limits: LimitsSpec,
    registry: Registry,
    cell: Cell,
    where: Where,
    on_event: Listener = ignore,
    *,
    poissons_ratio: float,
) -> tuple[ScalingLaw, tuple[str, ...]]:
    """Law of the cell, and warnings about it.

    ``auto`` takes a registered law only for the family's default parameters in cells of equal
    edges, which are what laws describe; otherwise, and for a family without a law, it is computed
    by homogenisation, with the material's Poisson's ratio, and kept in the user's cache;
    ``on_event`` hears of it first, since that takes a minute. ``gibson-ashby`` is fitted to the
    computed one. A law that the case names is taken as it is, with a warning where parameters or
    edges are not those it describes; so is any registered law for a material of another Poisson's
    ratio. A law that the case states describes its cell, whatever that is. Raises `CaseError` as
    `planned_law`. Raises `DensityError`, `LatticeError`, `SolverError` as `computed_law` and
    `gibson_ashby`.
    """
    edges = lattice.edges
    plan = planned_law(lattice, limits, registry, cell, where, poissons_ratio=poissons_ratio)
    law = plan.known
    if law is None:
        least, most = plan.minutes
        how = (
            "taking it from the cache"
            if plan.tabulated
            else f"computing it on {plan.voxels}^3 voxels, which takes {least:.0f} to {most:.0f} "
            f"minutes"
        )
        on_event(Event(stage="law", message=f"{plan.why}: {how}"))

        def tell(row: CellProperties, number: int, count: int) -> None:
            on_event(
                Event(
                    stage="law",
                    message=f"law of {cell.name}: density {row.density:g} is computed "
                    f"({number} of {count})",
                    fraction=number / count,
                )
            )

        law = computed_law(cell, poissons_ratio, plan.voxels, edges, lattice.densities, tell)
        remark = f"{plan.why}, so it was computed on {plan.voxels}^3 voxels"
        if lattice.own_cell is None:
            remark += f"; 'gradedesign homogenise {cell.name}' says more"
        if plan.fitted:
            law = gibson_ashby(law, lattice.densities)
            require_strength(lattice, limits, law, where)
        return law, (remark,)
    if law.kind == "stated":
        return law, ()
    unequal, changed = min(edges) < max(edges), changed_parameters(cell.family, cell.parameters)
    warnings = _ratio_warnings(law, poissons_ratio)
    if unequal:
        warnings += (
            f"law '{law.name}' describes cells of equal edges, not in proportion "
            f'{proportion(edges)}; law = "auto" computes one for these',
        )
    if not changed:
        return law, warnings
    return law, (
        *warnings,
        f"law '{law.name}' describes cell '{cell.name}' with its default parameters, not with "
        f'{values_in_words(changed, cell.parameters)}; law = "auto" computes one for these',
    )


def _ratio_warnings(law: ScalingLaw, poissons_ratio: float) -> tuple[str, ...]:
    """Say that a law was made for another base material."""
    if abs(law.poissons_ratio - poissons_ratio) <= _RATIO_TOLERANCE:
        return ()
    return (
        f"law '{law.name}' was made for Poisson's ratio {law.poissons_ratio:g}, the material has "
        f"{poissons_ratio:g}: for a tenth more cells differ by up to 5 % in E, G and strength and "
        f"20 % in bulk modulus; the first prediction is off by that, later ones are corrected",
    )


def stress_basis(law: ScalingLaw) -> str:
    """Basis of the prediction of local stress with a law, for the report."""
    if not has_strength(law):
        return "none: the law has no strength"
    if law.local_stress is None:
        return "macroscopic von Mises stress over the strength at the density"
    surfaces = law.local_stress.surfaces
    return (
        f"strength surfaces at {len(surfaces)} densities, each the "
        f"{law.local_stress.percentile:g}th volume percentile in a cell under the whole "
        f"macroscopic stress in its axes; fitted within {max(s.rms_error for s in surfaces):.1%} "
        f"rms and {max(s.max_error for s in surfaces):.0%} at most"
    )


def buckling_basis(law: ScalingLaw) -> str:
    """Basis of the prediction of cell buckling with a law, for the report."""
    ends = [
        critical_long_waves(law.stiffness(np.array([rho]))[:, :, 0])[0, 0] for rho in law.window
    ]
    long = (
        f"waves of many cells, from the law's stiffness: compression along x {ends[0]:.3g} E at "
        f"density {law.window[0]:g}, {ends[1]:.3g} E at {law.window[1]:g}"
    )
    buckling = law.buckling
    if buckling is None:
        return f"{long}; no modes of one or two cells were computed"
    c, n, residual = buckling.power_fit(0, 0)
    return (
        f"the lesser of {long}; and of modes that repeat after one or two cells, densities "
        f"{buckling.window[0]:g} to {buckling.window[1]:g}, {buckling.table.version}, "
        f"{buckling.table.date}: compression along x {c:.3g} rho^{n:.3g} E within {residual:.0%}, "
        f"extrapolation added up to {float(np.max(buckling.table.error)):.0%}"
    )
