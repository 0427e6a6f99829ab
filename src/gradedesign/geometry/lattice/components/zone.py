"""Zones: places of the part whose cells differ, and their weights at a point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.values.formula import parse_formula
from gradedesign.common.values.locate import Where, locating
from gradedesign.errors import CaseError, DensityError
from gradedesign.geometry.fields.algebra import gradient
from gradedesign.geometry.lattice.component import Component
from gradedesign.geometry.lattice.component_kind import ComponentKind, ComponentPlace, Made
from gradedesign.geometry.lattice.density_value import formula_field
from gradedesign.geometry.lattice.zone_schema import WeightedZone, ZoneSpec
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.place import place_distance
from gradedesign.geometry.part.signed_distance import region_distance

#: Width of a transition that the case does not state, cells; its least one. Chosen, not measured.
USUAL_WIDTH, LEAST_WIDTH = 2.0, 0.5
#: Step of the differences that make a distance of a formula, in cells. Chosen, not measured.
_STEP = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Zones(Component):
    """Zones of the cells, the first of them the lattice outside every other."""

    names: tuple[str, ...]  #: ``(Z,)``.
    keys: tuple[str, ...]  #: In the case file, of every zone but the first.
    widths: tuple[float, ...]  #: mm. Of the transition of every zone but the first.
    #: Weight that every zone but the first takes from those before it, 0 to 1, at points
    #: ``(3, ...)`` mm.
    shares: tuple[Field, ...]
    #: Formulas that weights follow, points to ``(...)``, and their zones.
    formulas: tuple[tuple[Field, WeightedZone], ...] = ()

    def weights(self, points: FloatArray) -> FloatArray:
        """Weights at points ``(3, ...)`` mm, ``(Z, ...)``, each from 0 to 1, together 1.

        Over a transition, which lies to equal parts on both sides of a zone's border, its weight
        rises by ``3 s^2 - 2 s^3``, or follows a formula.
        """
        points = np.asarray(points, dtype=np.float64)
        values = np.zeros((len(self.names), *points.shape[1:]))
        values[0] = 1.0
        for k, share_of in enumerate(self.shares, start=1):
            share = share_of(points)
            values[:k] *= 1 - share
            values[k] = share
        return values


def require_zones_used(where: Where, zones: Zones, points: FloatArray) -> FloatArray:
    """Refuse an empty zone, places where three would mix, and weights beyond what they may be.

    A row of zones for the values of a parameter may be wider than what the lattice has of them.

    Returns (Z, n) array: weights there. Raises `CaseError`, `DensityError`.

    ``points (3, n)``, mm: that fill the lattice.
    """
    for formula, zone in zones.formulas:
        _require_values(where(zone.stated_by), formula, zone, points)
    names, weights = zones.names, zones.weights(points)
    for k in range(1, len(names)):
        # A weight that a formula gives may be small everywhere.
        least = 0.0 if zones.formulas else 0.5
        if not (len(zones.formulas) > 1 or (weights[k] > least).any()):
            raise CaseError(
                f"{where(zones.keys[k - 1])}: no place of the lattice lies in it; expected one "
                f"that covers some cells: is its place in mm, and not covered by a later zone?"
            )
    mixed = (weights > 0).sum(axis=0) > 2
    if mixed.any():
        at = int(np.argmax(mixed))
        present = [name for name, w in zip(names, weights[:, at], strict=True) if w > 0]
        raise CaseError(
            f"{where('zone')}: the transitions of {', '.join(present)} overlap in "
            f"{mixed.mean():.1%} of the lattice, and only two cells can mix; move the zones apart "
            f"or make their transitions shorter"
        )
    return weights


def _require_values(key: str, formula: Field, zone: WeightedZone, points: FloatArray) -> None:
    """Refuse a formula that leaves its values in the lattice."""
    values = np.broadcast_to(formula(points), points.shape[1:])
    low, high = zone.within_values
    slack = 1e-9 * (high - low)
    wrong = ~((values >= low - slack) & (values <= high + slack))
    if wrong.any():
        off = np.nan_to_num(np.maximum(values - high, low - values), nan=np.inf)
        at = int(np.argmax(off))
        x, y, z = points[:, at]
        raise DensityError(
            f"{key}: the {zone.quantity} is {values[at]:.4g} at ({x:.4g}, {y:.4g}, {z:.4g}) mm; "
            f"expected {low:g} to {high:g} everywhere in the lattice; change the formula"
        )


def _make(place: ComponentPlace) -> Made:
    """The zones of a case.

    Raises CaseError if a transition is shorter than `LEAST_WIDTH` cells.
    """
    if not place.zone:
        return (), ()
    size = place.lattice.cell_size
    widths = tuple(_width(place.where, z, k, size) for k, z in enumerate(place.zone))
    formulas = {
        k: (_formula(place, z.share, z.stated_by), z)
        for k, z in enumerate(place.zone)
        if isinstance(z, WeightedZone)
    }
    zones = Zones(
        names=("lattice", *(z.name or f"zone {k}" for k, z in enumerate(place.zone, start=1))),
        keys=tuple(z.key(k) for k, z in enumerate(place.zone)),
        widths=widths,
        shares=tuple(
            _clipped(*formulas[k]) if k in formulas else _rising(_border(place, z, k), width)
            for k, (z, width) in enumerate(zip(place.zone, widths, strict=True))
        ),
        formulas=tuple(formulas.values()),
    )
    return (zones,), ()


def _formula(place: ComponentPlace, text: str, key: str) -> Field:
    with locating(place.where, key):
        return formula_field(parse_formula(text), place.distance)


def _rising(border: Field, width: float) -> Field:
    """Weight that rises over a width, mm, about the border of a zone."""

    def share(points: FloatArray) -> FloatArray:
        s = np.clip(0.5 - border(points) / width, 0.0, 1.0)
        return np.asarray(s * s * (3 - 2 * s))

    return share


def _clipped(formula: Field, zone: WeightedZone) -> Field:
    """Weight from a formula; what it has outside the part is cut off at 0 and 1."""
    none, whole = zone.between
    return lambda points: np.clip((formula(points) - none) / (whole - none), 0.0, 1.0)


def _width(where: Where, zone: ZoneSpec, number: int, size: float) -> float:
    """Width of a zone's transition, mm."""
    width = USUAL_WIDTH * size if zone.transition is None else zone.transition
    if width < LEAST_WIDTH * size:
        raise CaseError(
            f"{where(f'zone[{number}].transition')}: found {width:g} mm, less than half a cell: "
            f"cells cannot pass into each other in it; expected {LEAST_WIDTH * size:g} mm at "
            f"least, better {USUAL_WIDTH * size:g} mm"
        )
    return width


def _border(place: ComponentPlace, zone: ZoneSpec, number: int) -> Field:
    """Distance from the border of a zone, negative inside, mm."""
    part: Part = place.part
    if zone.volume_key is not None:
        return place_distance(part, zone)
    if zone.region is not None and zone.within is not None:
        away, within = region_distance(part.regions[zone.region].corners), zone.within
        return lambda points: np.asarray(away(points) - within)
    return _formula_border(place, zone, number)


def _formula_border(place: ComponentPlace, zone: ZoneSpec, number: int) -> Field:
    """Value of a formula over the length of its gradient: a distance to first order, mm."""
    key = f"zone[{number}].formula"
    value = _formula(place, zone.formula or "", key)
    step = _STEP * place.lattice.cell_size

    def border(points: FloatArray) -> FloatArray:
        flat = points.reshape(3, -1)
        slope = np.linalg.norm(gradient(value, flat, step), axis=0)
        there = np.asarray(value(flat), dtype=np.float64)
        if not np.isfinite(there).all():
            raise CaseError(f"{place.where(key)}: is not finite everywhere in the part")
        # Where a formula is flat, no border is near.
        far = np.where(there < 0, -np.inf, np.inf)
        near = np.divide(there, slope, out=far, where=slope > 0)
        return near.reshape(points.shape[1:])

    return border


#: Places with other cells or densities, the tables ``[[zone]]``.
KIND = ComponentKind(name="zone", stage="cells", make=_make)
