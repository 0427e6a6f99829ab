"""Weights of the zones of a case at a point, from the places that the case states."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.values.formula import parse_formula
from gradedesign.common.values.locate import locating
from gradedesign.design.case.schema import Case, ZoneSpec
from gradedesign.errors import CaseError
from gradedesign.geometry.fields.algebra import gradient
from gradedesign.geometry.lattice.formula_density import formula_field
from gradedesign.geometry.lattice.place import place_distance
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.signed_distance import region_distance

#: Width of a transition that the case does not state, cells; its least one. Chosen, not measured.
USUAL_WIDTH, LEAST_WIDTH = 2.0, 0.5
#: Step of the differences that make a distance of a formula, in cells. Chosen, not measured.
_STEP = 1e-3


def zone_names(case: Case) -> tuple[str, ...]:
    """Names of the zones, ``(Z,)``; the first stands for the lattice outside every zone."""
    numbers = range(1, len(case.zone) + 1)
    return (
        "lattice",
        *(zone.name or f"zone {k}" for k, zone in zip(numbers, case.zone, strict=True)),
    )


def zone_widths(case: Case) -> tuple[float, ...]:
    """Width of every zone's transition, mm.

    Raises
    ------
    CaseError
        If a transition is shorter than `LEAST_WIDTH` cells.
    """
    size, widths = case.lattice.cell_size, []
    for k, zone in enumerate(case.zone):
        width = USUAL_WIDTH * size if zone.transition is None else zone.transition
        if width < LEAST_WIDTH * size:
            raise CaseError(
                f"{case.where(f'zone[{k}].transition')}: found {width:g} mm, less than half a "
                f"cell: cells cannot pass into each other in it; expected "
                f"{LEAST_WIDTH * size:g} mm at least, better {USUAL_WIDTH * size:g} mm"
            )
        widths.append(width)
    return tuple(widths)


def zone_weights(case: Case, part: Part, distance: Field) -> Field:
    """Weights of the zones, the first of them the lattice outside every zone.

    Over a transition, which lies to equal parts on both sides of a zone's border, its weight rises
    by ``3 s^2 - 2 s^3``. A zone takes its weight from those before it.

    Parameters
    ----------
    case : Case
    part : Part
    distance : callable
        Signed distance of the part.

    Returns
    -------
    callable
        Points ``(3, ...)`` mm to weights ``(Z, ...)``, each from 0 to 1, together 1.

    Raises
    ------
    CaseError
        If a transition is too short.
    """
    widths = zone_widths(case)
    borders = [_border(case, zone, part, distance) for zone in case.zone]

    def weights(points: FloatArray) -> FloatArray:
        points = np.asarray(points, dtype=np.float64)
        values = np.zeros((1 + len(borders), *points.shape[1:]))
        values[0] = 1.0
        for k, (border, width) in enumerate(zip(borders, widths, strict=True), start=1):
            s = np.clip(0.5 - border(points) / width, 0.0, 1.0)
            share = s * s * (3 - 2 * s)
            values[:k] *= 1 - share
            values[k] = share
        return values

    return weights


def require_zones_used(case: Case, names: Sequence[str], weights: FloatArray) -> None:
    """Refuse a zone that no place of the lattice lies in, and places where three would mix.

    Parameters
    ----------
    case : Case
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
                f"{case.where(f'zone[{k - 1}]')}: no place of the lattice lies in it; expected one "
                f"that covers some cells: is its place in mm, and not covered by a later zone?"
            )
    mixed = (weights > 0).sum(axis=0) > 2
    if mixed.any():
        at = int(np.argmax(mixed))
        present = [name for name, w in zip(names, weights[:, at], strict=True) if w > 0]
        raise CaseError(
            f"{case.where('zone')}: the transitions of {', '.join(present)} overlap in "
            f"{mixed.mean():.1%} of the lattice, and only two cells can mix; move the zones apart "
            f"or make their transitions shorter"
        )


def _border(case: Case, zone: ZoneSpec, part: Part, distance: Field) -> Field:
    """Distance from the border of a zone, negative inside, mm."""
    if zone.volume_key is not None:
        return place_distance(part, zone)
    if zone.region is not None and zone.within is not None:
        away, within = region_distance(part.regions[zone.region].corners), zone.within
        return lambda points: np.asarray(away(points) - within)
    return _formula_border(case, zone, distance)


def _formula_border(case: Case, zone: ZoneSpec, distance: Field) -> Field:
    """Value of a formula over the length of its gradient: a distance to first order, mm."""
    number = next(k for k, entry in enumerate(case.zone) if entry is zone)
    with locating(case.where, f"zone[{number}].formula"):
        value = formula_field(parse_formula(zone.formula or ""), distance)
    step = _STEP * case.lattice.cell_size

    def border(points: FloatArray) -> FloatArray:
        flat = points.reshape(3, -1)
        slope = np.linalg.norm(gradient(value, flat, step), axis=0)
        there = np.asarray(value(flat), dtype=np.float64)
        if not np.isfinite(there).all():
            raise CaseError(
                f"{case.where(f'zone[{number}].formula')}: is not finite everywhere in the part"
            )
        # Where a formula is flat, no border is near.
        far = np.where(there < 0, -np.inf, np.inf)
        near = np.divide(there, slope, out=far, where=slope > 0)
        return near.reshape(points.shape[1:])

    return border
