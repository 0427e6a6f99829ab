"""Zones: places of the part whose cells differ, and their weights at a point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.values.formula import parse_formula
from gradedesign.common.values.locate import Where, locating
from gradedesign.errors import CaseError
from gradedesign.geometry.fields.algebra import gradient
from gradedesign.geometry.lattice.component import Component
from gradedesign.geometry.lattice.component_kind import ComponentKind, ComponentPlace, Made
from gradedesign.geometry.lattice.formula_density import formula_field
from gradedesign.geometry.lattice.zone_schema import ZoneSpec
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.place import place_distance
from gradedesign.geometry.part.signed_distance import region_distance

#: Width of a transition that the case does not state, cells; its least one. Chosen, not measured.
USUAL_WIDTH, LEAST_WIDTH = 2.0, 0.5
#: Step of the differences that make a distance of a formula, in cells. Chosen, not measured.
_STEP = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Zones(Component):
    """Zones of the cells, the first of them the lattice outside every other.

    Attributes
    ----------
    names : tuple of str
        ``(Z,)``.
    widths : tuple of float, mm
        Of the transition of every zone but the first.
    borders : tuple of callable
        Distance from the border of every zone but the first, points ``(3, ...)`` mm to ``(...)``
        mm, negative inside.
    """

    names: tuple[str, ...]
    widths: tuple[float, ...]
    borders: tuple[Field, ...]

    def weights(self, points: FloatArray) -> FloatArray:
        """Weights at points ``(3, ...)`` mm, ``(Z, ...)``, each from 0 to 1, together 1.

        Over a transition, which lies to equal parts on both sides of a zone's border, its weight
        rises by ``3 s^2 - 2 s^3``. A zone takes its weight from those before it.
        """
        points = np.asarray(points, dtype=np.float64)
        values = np.zeros((len(self.names), *points.shape[1:]))
        values[0] = 1.0
        for k, (border, width) in enumerate(zip(self.borders, self.widths, strict=True), start=1):
            s = np.clip(0.5 - border(points) / width, 0.0, 1.0)
            share = s * s * (3 - 2 * s)
            values[:k] *= 1 - share
            values[k] = share
        return values


def require_zones_used(where: Where, names: Sequence[str], weights: FloatArray) -> None:
    """Refuse a zone that no place of the lattice lies in, and places where three would mix.

    Parameters
    ----------
    where : Where
    names : sequence of str
    weights : (Z, n) array
        At points that fill the lattice.

    Raises
    ------
    CaseError
    """
    for k in range(1, len(names)):
        if not (weights[k] > 0.5).any():
            raise CaseError(
                f"{where(f'zone[{k - 1}]')}: no place of the lattice lies in it; expected one that "
                f"covers some cells: is its place in mm, and not covered by a later zone?"
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


def _make(place: ComponentPlace) -> Made:
    """The zones of a case.

    Raises
    ------
    CaseError
        If a transition is shorter than `LEAST_WIDTH` cells.
    """
    if not place.zone:
        return (), ()
    size = place.lattice.cell_size
    zones = Zones(
        names=("lattice", *(z.name or f"zone {k}" for k, z in enumerate(place.zone, start=1))),
        widths=tuple(_width(place.where, z, k, size) for k, z in enumerate(place.zone)),
        borders=tuple(_border(place, z, k) for k, z in enumerate(place.zone)),
    )
    return (zones,), ()


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
    with locating(place.where, key):
        value = formula_field(parse_formula(zone.formula or ""), place.distance)
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
