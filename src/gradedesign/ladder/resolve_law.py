"""The law of a case's cell: registered for it, or computed for its very parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gradedesign.case.schema import Case
from gradedesign.cell.family import CellFamily
from gradedesign.homogenise.cached_table import (
    ON_DEMAND_RESOLUTION,
    computed_law,
    on_demand_resolution,
)
from gradedesign.homogenise.cell_properties import CellProperties
from gradedesign.material.scaling_law import ScalingLaw
from gradedesign.plugin.choose_law import choose_law, usable_laws
from gradedesign.plugin.registry import Registry
from gradedesign.workspace.progress import Event, Listener, ignore

#: Difference of Poisson's ratios from which a warning says so. Per 0.05, measured on four cells at
#: density 0.3: up to 2.5 % in E, G and strength, 9 % in bulk modulus.
RATIO_TOLERANCE = 0.05


def resolve_law(
    case: Case,
    registry: Registry,
    family: CellFamily,
    parameters: Mapping[str, float],
    on_event: Listener = ignore,
    *,
    poissons_ratio: float,
) -> tuple[ScalingLaw, tuple[str, ...]]:
    """Law of the cell, and warnings about it.

    ``auto`` takes a registered law only for the family's default parameters in cells of equal
    edges, which are what laws describe; otherwise, and for a family without a law, it is computed
    by homogenisation, with the material's Poisson's ratio, and kept in the user's cache;
    ``on_event`` hears of it first, since that takes a minute. A law that the case names is taken as
    it is, with a warning where parameters or edges are not those it describes; so is any registered
    law for a material of another Poisson's ratio.

    Raises
    ------
    CaseError
        As `choose_law`.
    DensityError, LatticeError, SolverError
        As `computed_law`.
    """
    edges = case.lattice.edges
    unequal = min(edges) < max(edges)
    changed = [k for k, value in parameters.items() if value != family.parameters[k]]
    asked = case.lattice.law
    if asked == "auto" and (changed or unequal or not usable_laws(registry, family.name)):
        why = f"with {_values(changed, parameters)}" if changed else "of this cell"
        if unequal:
            why += f" with edges in proportion {_proportion(edges)}"
        voxels = on_demand_resolution(family, parameters, edges)
        minutes = (voxels / ON_DEMAND_RESOLUTION) ** 3
        on_event(
            Event(
                stage="law",
                message=f"no law {why} is installed: taking it from the cache, or computing it on "
                f"{voxels}^3 voxels, which takes {minutes:.0f} to {2 * minutes:.0f} minutes",
            )
        )

        def tell(row: CellProperties, number: int, count: int) -> None:
            on_event(
                Event(
                    stage="law",
                    message=f"law of {family.name}: density {row.density:g} is computed "
                    f"({number} of {count})",
                    values={"fraction": number / count},
                )
            )

        law = computed_law(
            family, parameters, poissons_ratio, voxels, edges, case.lattice.density, tell
        )
        told = f"no law {why} is installed, so it was computed on {voxels}^3 voxels"
        if case.lattice.own_cell is None:
            told += f"; 'gradedesign homogenise {family.name}' says more"
        return law, (told,)
    law = choose_law(registry, family.name, asked, case.lattice.density)
    said = _ratio_warnings(law, poissons_ratio)
    if unequal:
        said += (
            f"law '{law.name}' describes cells of equal edges, not in proportion "
            f'{_proportion(edges)}; law = "auto" computes one for these',
        )
    if not changed:
        return law, said
    return law, (
        *said,
        f"law '{law.name}' describes cell '{family.name}' with its default parameters, not with "
        f'{_values(changed, parameters)}; law = "auto" computes one for these',
    )


def _ratio_warnings(law: ScalingLaw, poissons_ratio: float) -> tuple[str, ...]:
    """Say that a law was made for another base material."""
    if abs(law.poissons_ratio - poissons_ratio) <= RATIO_TOLERANCE:
        return ()
    return (
        f"law '{law.name}' was made for Poisson's ratio {law.poissons_ratio:g}, the material has "
        f"{poissons_ratio:g}: for a tenth more cells differ by up to 5 % in E, G and strength and "
        f"20 % in bulk modulus; the first prediction is off by that, later ones are corrected",
    )


def stress_basis(law: ScalingLaw) -> str:
    """How local stress is predicted with a law, for the report."""
    if law.local_stress is None:
        return "macroscopic von Mises stress over the strength at the density"
    surfaces = law.local_stress.surfaces
    return (
        f"strength surfaces at {len(surfaces)} densities, each the "
        f"{law.local_stress.percentile:g}th volume percentile in a cell under the whole "
        f"macroscopic stress in its axes; fitted within {max(s.rms_error for s in surfaces):.1%} "
        f"rms and {max(s.max_error for s in surfaces):.0%} at most"
    )


def stress_warnings(law: ScalingLaw, percentile: float) -> tuple[str, ...]:
    """What of a predicted stress is not what will be judged."""
    known = law.local_stress
    if known is None or known.has_distribution or known.percentile == percentile:
        return ()
    return (
        f"stress is judged at the {percentile:g}th percentile by volume, but the strength surfaces "
        f"of law '{law.name}' stand for the {known.percentile:g}th: the first prediction "
        f"is off by that, later ones are corrected",
    )


def buckling_warnings(law: ScalingLaw) -> tuple[str, ...]:
    """Say that buckling of the cells is not judged where the law does not know it."""
    if law.buckling is not None:
        return ()
    return (
        f"buckling of the cells is not judged: law '{law.name}' has no critical stresses "
        f"('gradedesign tabulate --buckling' computes them); [limits] buckling = \"off\" says "
        f"that this is meant",
    )


def _proportion(edges: Sequence[float]) -> str:
    return " : ".join(f"{edge / min(edges):.4g}" for edge in edges)


def _values(names: list[str], parameters: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {parameters[name]:g}" for name in names)
