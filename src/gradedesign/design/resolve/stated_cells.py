"""The cells that a case states: one family, or two with a transition between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial
from typing import Any, Literal

import numpy as np

from gradedesign.arrays import Field
from gradedesign.common.values.formula import parse_formula
from gradedesign.common.values.locate import Where, locating
from gradedesign.design.case.schema import Case
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.resolve import stated_family
from gradedesign.design.resolve.zones import zone_lattice
from gradedesign.design.resolve.zoning import weights_of_cells
from gradedesign.errors import CaseError
from gradedesign.geometry.cell.blend import Scale
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.cells import Cells, cell_increments, cell_pair, row_weights, single
from gradedesign.geometry.cell.neck import joining_shift, measure_neck
from gradedesign.geometry.cell.shape import complete_parameters
from gradedesign.geometry.cell.wall_size import density_for_wall, wall_mm
from gradedesign.geometry.contour.sample import grid_points
from gradedesign.geometry.lattice.by_place_schema import ParameterMapSpec, TransitionSpec
from gradedesign.geometry.lattice.components.zone import Zones
from gradedesign.geometry.lattice.density_grid import DensityGrid, evaluate
from gradedesign.geometry.lattice.density_source import sample_density
from gradedesign.geometry.lattice.density_value import formula_field
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.geometry.lattice.local_level import local_level
from gradedesign.geometry.lattice.zone_schema import ZoneSpec

#: The weight of a second family is kept on a grid with this many nodes per cell. Chosen, not
#: measured.
_WEIGHT_NODES_PER_CELL = 8
#: Places along a cell at which a mix looks up its share: one in every block of `local_level`.
_PLACES_PER_CELL = 12


def stated_cells(case: Case, registry: Registry) -> Cells:
    """Look up and calibrate the families of a case; their window is of walls that can be printed.

    Raises CaseError for an unknown family or parameter, or more than two different cells in zones.
    Raises DensityError if two families have no density in common, or no density gives walls thick
    enough.
    """
    spec = case.lattice
    least = None if case.print is None else case.print.min_wall
    if spec.parameter_map is not None:
        return _with_floor(
            least,
            spec.cell_size,
            case.where,
            _incremented(spec, spec.parameter_map, registry, case.where),
        )
    first = _calibrated(case.where, registry, "lattice", spec.cell, spec.parameters)
    if case.zone:
        zoned = _in_zones(spec, case.zone, registry, case.where, first)
        return _with_floor(least, spec.cell_size, case.where, zoned)
    if spec.transition is None:
        return _with_floor(least, spec.cell_size, case.where, single(first))
    second = spec.transition
    key = "lattice.transition"
    other = _calibrated(case.where, registry, key, second.cell, second.parameters)
    with locating(case.where, key):
        return _with_floor(
            least, spec.cell_size, case.where, cell_pair(first, other, scale=_scale(second))
        )


def _in_zones(
    lattice: LatticeSpec,
    zones: Sequence[ZoneSpec],
    registry: Registry,
    where: Where,
    first: Cell,
) -> Cells:
    """The cell of the lattice and, if zones have one, another."""
    cells = [first]
    for k, zone in enumerate(zones):
        own, _ = zone_lattice(lattice, zone, k, where)
        cells.append(_calibrated(where, registry, f"zone[{k}]", own.cell, own.parameters))
    members = tuple(dict.fromkeys(cells))
    if len(members) > 2:
        raise CaseError(
            f"{where('zone')}: found {len(members)} different cells; where the density is "
            f"stated two can pass into each other; take one cell in all zones, or density = "
            f"[lowest, highest]"
        )
    if len(members) == 1:
        return single(first)
    with locating(where, "zone"):
        return cell_pair(*members)


def _share_of_second(stated: Sequence[LatticeSpec], first: Cell, zones: Zones) -> Field:
    """Weight of the second of two cells, at points ``(3, ...)`` mm.

    ``stated`` is what holds outside every zone, and in each of them.
    """
    number = [
        int(
            own.cell != first.name
            or complete_parameters(first.family, own.parameters) != first.parameters
        )
        for own in stated
    ]
    return lambda points: weights_of_cells(number, zones.weights(points))[1]


def _with_floor(least: float | None, size: float, where: Where, cells: Cells) -> Cells:
    """The cells above the density whose walls can be printed, ``least`` mm thick."""
    if least is None:
        return cells
    with locating(where, "print.min_wall"):
        floors = [density_for_wall(c, least, size) for c in cells.members]
    return replace(cells, window=(max(cells.window[0], *floors), cells.window[1]))


def _incremented(
    lattice: LatticeSpec, spec: ParameterMapSpec, registry: Registry, where: Where
) -> Cells:
    """One family at the increments of a parameter."""
    family, _ = stated_family(registry, where, "lattice", lattice.cell, lattice.parameters)
    with locating(where, "lattice.parameter_map.parameter"):
        return cell_increments(
            family, lattice.parameters, spec.parameter, spec.values, spec.increments
        )


def placed_cells(
    case: Case,
    cells: Cells,
    cell_map: Field,
    *,
    density: DensityGrid | float,
    domain: DesignDomain,
) -> tuple[Cells, dict[str, Any]]:
    """Cells with their weights, shifts and levels from place to place, and measures of these.

    Raises DensityError if the weight leaves 0 to 1 inside the part. Raises LatticeError if the
    transition falls apart.

    ``cell_map``: points ``(3, ...)`` mm to ``(3, ...)`` cell coordinates. ``density``: a transition
    must be connected at its least value; a parameter may follow it.
    """
    spec, measures = case.lattice, dict[str, Any]()
    if spec.parameter_map is not None:
        name = spec.parameter_map.parameter
        share = _parameter_share(
            case.where,
            spec.parameter_map,
            density,
            domain,
            spec.cell_size / _WEIGHT_NODES_PER_CELL,
            case.run.memory,
        )
        measures = {"parameter": name, "values": [c.parameters[name] for c in cells.members]}
    elif spec.transition is not None:
        with locating(case.where, "lattice.transition.weight"):
            share = partial(
                evaluate, _weight_grid(spec.transition, domain, spec.cell_size, case.run.memory)
            )
        with locating(case.where, "lattice.transition"):
            cells, measures = _joined(cells, spec.transition, least_density(density))
    elif len(cells.members) > 1:
        (zones,) = domain.of(Zones)
        share = _share_of_second(
            [spec, *(zone_lattice(spec, z, k, case.where)[0] for k, z in enumerate(case.zone))],
            cells.members[0],
            zones,
        )
        with locating(case.where, "zone"):
            cells, measures = _joined(cells, None, least_density(density))
    else:
        return cells, measures
    cells, errors = _levelled(
        cells,
        share,
        cell_map,
        density,
        domain,
        cell_size=case.lattice.cell_size,
        memory=case.run.memory,
    )
    return cells, measures | errors


def _joined(
    cells: Cells, spec: TransitionSpec | None, least: float
) -> tuple[Cells, dict[str, Any]]:
    """The cells of a transition, the second moved so that they join at a least density."""
    first, second = cells.members
    scale: Scale = "rank" if spec is None else _scale(spec)
    shift = None if spec is None else spec.shift
    if shift is None:
        shift = joining_shift(first, second, least, scale=scale)
    pair = cell_pair(first, second, scale=scale, shift=shift)
    return replace(pair, window=cells.window), {
        "cell": second.name,
        "parameters": dict(second.parameters),
        "scale": scale,
        "shift_cells": list(shift),
        "density": least,
        "neck_over_two_cells": asdict(measure_neck(pair, least)),
    }


def _levelled(
    cells: Cells,
    share: Field,
    cell_map: Field,
    density: DensityGrid | float,
    domain: DesignDomain,
    *,
    cell_size: float,
    memory: int,
) -> tuple[Cells, dict[str, float]]:
    """Cells with the level that gives every cell its density, and their errors of density.

    ``share`` gives the place along the row of cells, 0 to 1, at points ``(3, ...)`` mm.
    """
    spacing, count = cell_size / _PLACES_PER_CELL, len(cells.members)
    x, y, z = (int(n) for n in np.ceil((domain.upper - domain.lower) / spacing))
    middles = domain.lower + 0.5 * spacing
    points = grid_points(middles, (0, 0, 0), (x, y, z), spacing).reshape(3, -1)
    points = np.minimum(points, domain.upper[:, None])
    rho = evaluate(density, points) if isinstance(density, DensityGrid) else density
    found = local_level(
        lambda u, share: cells.shape(np.concatenate([u, row_weights(share, count)])),
        cells.period,
        (cell_map(points), share(points), np.broadcast_to(rho, points.shape[1:])),
        memory_limit_bytes=memory,
    )
    placed = replace(cells, weights=lambda p: row_weights(share(p), count), excess=found.at)
    return placed, {
        "cell_density_error_before": found.before,
        "cell_density_error": found.error,
    }


def _weight_grid(
    spec: TransitionSpec, domain: DesignDomain, size: float, memory: int
) -> DensityGrid:
    """Weight of the second cell of a transition."""
    return sample_density(
        formula_field(parse_formula(spec.weight), domain.distance),
        domain.distance,
        domain.lower,
        domain.upper,
        spacing=size / _WEIGHT_NODES_PER_CELL,
        window=(0.0, 1.0),
        quantity="weight of the transition",
        memory_limit_bytes=memory,
    )


def least_density(density: DensityGrid | float) -> float:
    """Smallest density of a lattice."""
    return float(density.values.min()) if isinstance(density, DensityGrid) else density


def _parameter_share(
    where: Where,
    spec: ParameterMapSpec,
    density: DensityGrid | float,
    domain: DesignDomain,
    spacing: float,
    memory: int,
) -> Field:
    """Place between the first and last increment, 0 to 1, at points ``(3, ...)`` mm.

    ``spacing``, mm, and ``memory``, bytes: of the grid on which a formula is sampled.

    Raises CaseError if the parameter is to follow a density that is the same everywhere. Raises
    DensityError if the formula leaves the values of the increments inside the part.
    """
    first, last = spec.values
    with locating(where, "lattice.parameter_map"):
        if spec.formula is None:
            if not isinstance(density, DensityGrid) or np.ptp(density.values) == 0:
                raise CaseError(
                    "the parameter is to follow the density, which is the same everywhere; add a "
                    "formula"
                )
            low, span = float(density.values.min()), float(np.ptp(density.values))
            grid = density
            return lambda points: (evaluate(grid, points) - low) / span
        value = formula_field(parse_formula(spec.formula), domain.distance)
        shares = sample_density(
            lambda points: (value(points) - first) / (last - first),
            domain.distance,
            domain.lower,
            domain.upper,
            spacing=spacing,
            window=(0.0, 1.0),
            quantity=f"formula of {spec.parameter}, with {first:g} as 0 and {last:g} as 1,",
            memory_limit_bytes=memory,
        )
    return lambda points: evaluate(shares, points)


def thinnest_wall(cells: Cells, density: float, size: float) -> float:
    """Thinnest wall or strut of the families at a density, mm."""
    return min(float(wall_mm(c, density, size)) for c in cells.members)


def _calibrated(
    where: Where, registry: Registry, key: str, name: str, stated: Mapping[str, float]
) -> Cell:
    family, parameters = stated_family(registry, where, key, name, stated)
    with locating(where, f"{key}.cell"):
        return calibrate(family, parameters)


def _scale(spec: TransitionSpec) -> Scale:
    scale: Literal["rank", "distance"] = "distance" if spec.scale == "distance" else "rank"
    return scale
