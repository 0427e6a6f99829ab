"""The zones of a case: their cells, laws and densities, and the transitions between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.values.locate import Where, locating
from gradedesign.design.case.schema import Case
from gradedesign.design.resolve.planned_law import PlannedLaw
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.resolve import planned_densities, stated_family
from gradedesign.design.resolve.zoning import weights_of_cells
from gradedesign.errors import CaseError, LatticeError
from gradedesign.geometry.cell.blend import Scale
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.cells import Cells, cell_pair, largest_two, single
from gradedesign.geometry.cell.neck import joining_shift, measure_neck
from gradedesign.geometry.lattice.by_place_schema import TransitionSpec
from gradedesign.geometry.lattice.cell_layout import CellLayout
from gradedesign.geometry.lattice.components.zone import Zones, require_zones_used
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.geometry.lattice.zone_schema import ZoneSpec
from gradedesign.mechanics.material.scaling_law import has_strength


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResolvedZone:
    """One zone of a case: its cell, law and densities."""

    name: str
    lattice: LatticeSpec  #: ``[lattice]`` with what the zone states in its place.
    where: Where  #: Where the keys of `lattice` stand.
    cell: Cell
    law: PlannedLaw
    bounds: tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResolvedZones:
    """The zones of a case, their weights, and how their cells join."""

    zones: tuple[ResolvedZone, ...]  #: The first is what lies in no other.
    weights: Field  #: Points ``(3, ...)`` mm to ``(Z, ...)``.
    volume_share: tuple[float, ...]  #: Of every zone in the lattice.
    cells: Cells  #: Different ones, with their weights.
    narrowed: tuple[str, ...]  #: Which windows narrowed the user's.

    def number_of(self, zone: ResolvedZone) -> int:
        """Number of a zone's cell."""
        return next(n for n, cell in enumerate(self.cells.members) if cell is zone.cell)


def zone_lattice(
    lattice: LatticeSpec, zone: ZoneSpec, number: int, where: Where
) -> tuple[LatticeSpec, Where]:
    """``[lattice]`` with the keys of one zone in their place, and where these stand."""
    same = zone.cell in (None, lattice.cell)
    parameters = zone.parameters
    if parameters is None:
        parameters = lattice.parameters if same else {}
    changed = not same or parameters != lattice.parameters
    stated = {
        "cell": lattice.cell if zone.cell is None else zone.cell,
        "parameters": parameters,
        "law": zone.law or ("auto" if changed else lattice.law),
        "density": lattice.density if zone.density is None else zone.density,
        "phases": zone.phases or lattice.phases,
    }
    places = {key: f"{zone.key(number)}.{key}" for key in stated}
    written = {f"lattice.{key}": at for key, at in places.items() if at in where.lines}
    return lattice.model_copy(update=stated), replace(where, aliases=written)


def resolve_zones(
    case: Case,
    registry: Registry,
    first: ResolvedZone,
    stated: Sequence[Zones],
    layout: CellLayout,
    poissons_ratio: float,
) -> ResolvedZones | None:
    """Zones of a case; None where it has none.

    ``first``: the lattice outside every zone. ``stated``: of its domain: one, or none.
    ``poissons_ratio``: of the base material. Raises `CaseError`, `DensityError`, `LatticeError`,
    `PluginError` as for the cells of ``[lattice]``; if a zone is empty, three of them mix
    somewhere, or two cells do not join.
    """
    if not stated:
        return None
    (borders,) = stated
    names, at_points = borders.names, require_zones_used(case.where, borders, layout.points)
    zones, narrowed = [first], []
    for k, name in enumerate(names[1:]):
        with locating(case.where, borders.keys[k]):
            own = zone_lattice(case.lattice, case.zone[k], k, case.where)
            zone, remarks = _resolved_zone(case, own, name, registry, layout.least, poissons_ratio)
        zones.append(zone)
        narrowed += [f"zone {name!r}: {remark}" for remark in remarks]
    _require_one_law(zones, case.where)
    members = tuple(dict.fromkeys(zone.cell for zone in zones))
    cells = single(first.cell)
    if len(members) > 1:
        _require_strengths(zones)
        with locating(case.where, borders.keys[0].partition("[")[0]):
            length = min(borders.widths) / case.lattice.cell_size
            mix = case.lattice.transition
            cells = _joined(length, zones, members, borders.weights, at_points, mix)
    return ResolvedZones(
        zones=tuple(zones),
        weights=borders.weights,
        volume_share=tuple(float(w) for w in at_points.mean(axis=1)),
        cells=cells,
        narrowed=tuple(narrowed),
    )


def _resolved_zone(
    case: Case,
    own: tuple[LatticeSpec, Where],
    name: str,
    registry: Registry,
    least: float,
    poissons_ratio: float,
) -> tuple[ResolvedZone, list[str]]:
    """Cell, planned law and densities of a zone's own lattice."""
    lattice, where = own
    family, parameters = stated_family(registry, where, "lattice", lattice.cell, lattice.parameters)
    with locating(where, "lattice.cell"):
        cell = calibrate(family, parameters)
    law, bounds, narrowed = planned_densities(
        lattice, case.limits, case.print, registry, cell, least, where,
        poissons_ratio=poissons_ratio,
    )  # fmt: skip
    zone = ResolvedZone(name=name, lattice=lattice, where=where, cell=cell, law=law, bounds=bounds)
    return zone, narrowed


def _require_one_law(zones: Sequence[ResolvedZone], where: Where) -> None:
    """Refuse two laws of one cell."""
    for first, second in pairwise(sorted(zones, key=lambda zone: id(zone.cell))):
        if first.cell is second.cell and first.law.name != second.law.name:
            raise CaseError(
                f"{where('zone')}: zones {first.name!r} and {second.name!r} have the same "
                f"cell, but the laws '{first.law.name}' and '{second.law.name}'; name one law for "
                f"both"
            )


def _require_strengths(zones: Sequence[ResolvedZone]) -> None:
    """Refuse laws of stiffness alone beside other cells: mixes are compared with both in both."""
    for zone in zones:
        law = zone.law.known
        if law is not None and not has_strength(law):
            raise CaseError(
                f"{zone.where('lattice.law')}: law '{law.name}' has no strength, which cells "
                f"that pass into others need; take a law with strength"
            )


def _meeting_cells(weights: FloatArray) -> list[tuple[int, int]]:
    """Pairs of cells, the lower number first, that mix anywhere; weights are ``(n, m)``."""
    first, second, share = largest_two(weights)
    at = (share > 0) & (share < 1)
    return sorted({*zip(first[at].tolist(), second[at].tolist(), strict=True)})


def _joined(
    length: float,
    zones: Sequence[ResolvedZone],
    members: tuple[Cell, ...],
    weights: Field,
    at_points: FloatArray,
    own: TransitionSpec | None,
) -> Cells:
    """Cells of zones, moved so that those that meet join in transitions ``length`` cells long.

    Raises LatticeError if a transition falls apart.

    - ``zones``: Z of them
    - ``members``: n different ones
    - ``weights``: points to weights of the zones ``(Z, ...)``
    - ``at_points (Z, m)``: weights at points that fill the lattice
    - ``own``: that states the scale of the mix and how the second cell is moved
    """
    number = [members.index(zone.cell) for zone in zones]
    scale: Scale = "distance" if own is not None and own.scale == "distance" else "rank"
    shifts: dict[int, tuple[float, float, float]] = {0: (0.0, 0.0, 0.0)}
    blends = {}
    for i, j in _meeting_cells(weights_of_cells(number, at_points)):
        first, second = members[i], members[j]
        low = max(first.window[0], second.window[0])
        least = max(
            low, min(z.bounds[0] for z, n in zip(zones, number, strict=True) if n in (i, j))
        )
        start = shifts.setdefault(i, (0.0, 0.0, 0.0))
        if j not in shifts:
            moved = None if own is None else own.shift
            if moved is None:
                moved = joining_shift(first, second, least, scale=scale, length=length)
            shifts[j] = _plus(start, moved, 1.0)
        pair = cell_pair(first, second, scale=scale, shift=_plus(shifts[j], start, -1.0))
        neck = measure_neck(pair, least, length=length, resolution=24)
        if neck.components > 1 or neck.width == 0:
            raise LatticeError(
                f"a transition of {length:.3g} cells from '{first.name}' to '{second.name}' at "
                f"density {least:.3g} falls apart; use a higher density, a longer transition, "
                f"other cells, or zones that do not touch"
            )
        blends[i, j] = pair.blends[0, 1]
    return Cells(
        members=members,
        window=(min(c.window[0] for c in members), max(c.window[1] for c in members)),
        exist=f"the cells {', '.join(cell.name for cell in members)} exist for",
        shifts=tuple(shifts.get(n, (0.0, 0.0, 0.0)) for n in range(len(members))),
        blends=blends,
        weights=lambda points: weights_of_cells(number, weights(points)),
    )


def _plus(
    a: tuple[float, float, float], b: tuple[float, float, float], sign: float
) -> tuple[float, float, float]:
    x, y, z = (p + sign * q for p, q in zip(a, b, strict=True))
    return x, y, z
