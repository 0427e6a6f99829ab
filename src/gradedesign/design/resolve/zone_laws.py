"""Laws of the zones of a case, and of the mixes between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import Event, Listener
from gradedesign.common.values.locate import locating
from gradedesign.design.resolve.analysable import Analysable
from gradedesign.design.resolve.plan import Plan
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.resolve import density_bounds
from gradedesign.design.resolve.resolve_law import resolve_law
from gradedesign.design.resolve.zones import ResolvedZones
from gradedesign.design.resolve.zoning import Zone, Zoning, require_windows, zone_windows
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.wall_size import density_for_wall
from gradedesign.mechanics.homogenise.mix_factors import MixFactors, mix_factors
from gradedesign.mechanics.material.scaling_law import ScalingLaw

#: Below this factor on stiffness or strength of a mix a warning says so. Chosen, not measured.
POOR_MIX = 0.6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ZoneLaws:
    """Laws of the different cells of a case, and densities of its zones."""

    laws: tuple[ScalingLaw, ...]
    bounds: tuple[tuple[float, float], ...]  #: Of every zone.
    warnings: tuple[str, ...]


def zone_laws(
    plan: Plan, registry: Registry, first: ScalingLaw, on_event: Listener
) -> ZoneLaws | None:
    """Laws of the zones; None for a case without zones.

    ``first`` is the law of what lies in no zone. Raises `CaseError`, `DensityError`,
    `LatticeError`, `SolverError` as `resolve_law`.
    """
    case = plan.case
    zones = plan.zones
    if zones is None:
        return None
    laws = {0: first}
    bounds, warnings = [], []
    for k, zone in enumerate(zones.zones):
        number = zones.number_of(zone)
        key = "lattice.law" if k == 0 else case.zone[k - 1].key(k - 1)
        with locating(case.where, key):
            if number not in laws:
                laws[number], remarks = resolve_law(
                    zone.lattice,
                    case.limits,
                    registry,
                    zone.cell,
                    zone.where,
                    on_event,
                    poissons_ratio=plan.material.poissons_ratio,
                )
                warnings += [f"zone '{zone.name}': {remark}" for remark in remarks]
            zone_bounds, _ = density_bounds(
                zone.lattice,
                case.print,
                zone.cell,
                laws[number],
                plan.layout.least,
                zone.where,
            )
        bounds.append(zone_bounds)
    return ZoneLaws(
        laws=tuple(laws[n] for n in range(len(zones.cells.members))),
        bounds=tuple(bounds),
        warnings=tuple(warnings),
    )


def zoning(
    plan: Plan,
    laws: ZoneLaws,
    able: Analysable,
    centres: FloatArray,
    on_event: Listener,
) -> tuple[Zoning, tuple[str, ...]]:
    """Zones with their laws on the tetrahedra of the part, and warnings on poor mixes.

    Raises DensityError if a mix exists at none of the densities of the zones that meet.

    - ``plan``: with zones
    - ``able``: of every zone
    - ``centres (3, M)``, mm: of the tetrahedra
    - ``on_event``: hears of mixes that are computed
    """
    case = plan.case
    zones = plan.zones
    if zones is None:
        raise ValueError("the case has no zones")
    made = tuple(
        Zone(
            name=zone.name,
            cell=zones.number_of(zone),
            bounds=analysable.bounds,
            elements_per_wall=analysable.elements_per_wall,
            members=zone.lattice.members,
        )
        for zone, analysable in zip(zones.zones, able.zones, strict=True)
    )
    factors = _factors(plan, zones, made, laws.laws, on_event)
    plain = Zoning(
        zones=made,
        cells=zones.cells,
        laws=laws.laws,
        weights=zones.weights,
        factors=factors,
    )
    with locating(case.where, "zone"):
        windows = zone_windows(plain, centres)
        require_windows(plain, centres, windows)
    zoned = _with_windows(plain, windows, uniform=case.lattice.grading == "uniform")
    return zoned, _mix_warnings(zones.cells.members, factors)


def _with_windows(
    plain: Zoning, windows: tuple[FloatArray, FloatArray], *, uniform: bool
) -> Zoning:
    """The zoning with the densities of every tetrahedron, where they differ."""
    same = all(np.ptp(end) <= 1e-12 for end in windows)
    if same or uniform:
        return plain
    return replace(plain, windows=windows)


def _factors(
    plan: Plan,
    zones: ResolvedZones,
    made: Sequence[Zone],
    laws: Sequence[ScalingLaw],
    on_event: Listener,
) -> dict[tuple[int, int], MixFactors]:
    """Factors of every transition."""
    case = plan.case
    factors = {}
    printer, edges = case.print, case.lattice.edges

    def tell(cell: Cell, rho: float) -> None:
        message = f"computing the mix {cell.name} at density {rho:.3g}"
        on_event(Event(stage="law", message=f"{message}; later runs find it in the cache"))

    for i, j in zones.cells.blends:
        meeting = [zone.bounds for zone in made if zone.cell in (i, j)]
        bounds = min(b[0] for b in meeting), max(b[1] for b in meeting)
        with locating(case.where, "zone"):
            mix = mix_factors(
                zones.cells,
                (i, j),
                (laws[i], laws[j]),
                bounds,
                poissons_ratio=plan.material.poissons_ratio,
                edges=edges,
                on_mix=tell,
            )
            if printer is not None and printer.min_wall is not None:
                mix = _printable(mix, printer.min_wall, plan.layout.least)
        factors[i, j] = mix
    return factors


def _printable(factors: MixFactors, min_wall: float, size: float) -> MixFactors:
    """The factors with mixes from the density on at which their walls can be printed."""
    low = np.array(factors.low)
    for n, cell in enumerate(factors.cells, start=1):
        low[n] = max(low[n], density_for_wall(cell, min_wall, size))
    return replace(factors, low=low)


def _mix_warnings(
    cells: Sequence[Cell], factors: dict[tuple[int, int], MixFactors]
) -> tuple[str, ...]:
    """Say where a mix is much softer or weaker than its cells."""
    warnings = []
    for (i, j), mix in factors.items():
        for name, values in (("stiffness", mix.stiffness), ("strength", mix.strength)):
            n = int(np.argmin(values))
            if values[n] < POOR_MIX:
                warnings.append(
                    f"the transition from '{cells[i].name}' to '{cells[j].name}' is a weak spot: "
                    f"with {mix.share[n]:.0%} of the second its {name} is down to "
                    f"{values[n]:.0%} of the mean of both; sizing knows it, but other cells or "
                    f"zones that do not touch may be lighter"
                )
    return tuple(warnings)
