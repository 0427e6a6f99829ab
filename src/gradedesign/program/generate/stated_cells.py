"""The cells that a case states: one family, or two with a transition between them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from math import lcm
from typing import Any, Literal

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.values.formula import parse_formula
from gradedesign.common.values.locate import locating
from gradedesign.design.case.generate_schema import GenerateCase, TransitionSpec
from gradedesign.design.resolve.registry import Registry, lookup
from gradedesign.errors import CaseError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.increments import CellIncrements, cell_increments
from gradedesign.geometry.cell.neck import joining_shift, measure_neck
from gradedesign.geometry.cell.shape import blamed_shape, complete_parameters
from gradedesign.geometry.cell.transition import Scale, cell_transition
from gradedesign.geometry.cell.wall_size import density_for_wall, wall_mm
from gradedesign.geometry.lattice.density_grid import DensityGrid, evaluate
from gradedesign.geometry.lattice.density_source import sample_density
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.formula_density import formula_field
from gradedesign.geometry.lattice.parameter_map_schema import ParameterMapSpec
from gradedesign.program.generate.levelled_mix import levelled_mix

#: The weight of a second family is kept on a grid with this many nodes per cell. Chosen, not
#: measured.
WEIGHT_NODES_PER_CELL = 8


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StatedCells:
    """One family, two that pass into each other, or one whose parameter changes.

    Attributes
    ----------
    families : tuple of Cell
        One, two that pass into each other, or the increments of a parameter.
    window : (float, float)
        Densities that all families have, with walls that can be printed.
    level_of : callable
        Relative density to level.
    increments : CellIncrements or None
    """

    families: tuple[Cell, ...]
    window: tuple[float, float]
    level_of: Callable[[FloatArray | float], FloatArray]
    increments: CellIncrements | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BuiltCells:
    """Cells of a lattice: shape function, its parameters, its coordinates.

    Attributes
    ----------
    shape : callable
    parameters : mapping of str to float
    cell_map : callable
        Points ``(3, ...)`` mm to cell coordinates, with the weight as fourth if there are two
        families.
    transition : mapping
        Measures of the transition, or of the parameter, for the result; else empty.
    """

    shape: Callable[..., FloatArray]
    parameters: Mapping[str, float]
    cell_map: Field
    transition: Mapping[str, Any]


def stated_cells(case: GenerateCase, registry: Registry) -> StatedCells:
    """Look up and calibrate the families of a case.

    Raises
    ------
    CaseError
        For an unknown family or parameter.
    DensityError
        If two families have no density in common, or no density gives walls thick enough.
    """
    spec = case.lattice
    if spec.parameter_map is not None:
        return _with_floor(case, _incremented(case, registry, spec.parameter_map))
    families = [_calibrated(case, registry, "lattice", spec.cell, spec.parameters)]
    level_of = families[0].level_of
    window = families[0].window
    if spec.transition is not None:
        second = spec.transition
        key = "lattice.transition"
        families.append(_calibrated(case, registry, key, second.cell, second.parameters))
        with locating(case.where, key):
            plain = cell_transition(families[0], families[1], scale=_scale(second))
        level_of, window = plain.level_of, plain.window
    cells = StatedCells(families=tuple(families), window=window, level_of=level_of)
    return _with_floor(case, cells)


def _with_floor(case: GenerateCase, cells: StatedCells) -> StatedCells:
    """The cells above the density whose walls can be printed."""
    least = None if case.print is None else case.print.min_wall
    if least is None:
        return cells
    with locating(case.where, "print.min_wall"):
        floors = [density_for_wall(c, least, case.lattice.cell_size) for c in cells.families]
    return replace(cells, window=(max(cells.window[0], *floors), cells.window[1]))


def _incremented(case: GenerateCase, registry: Registry, spec: ParameterMapSpec) -> StatedCells:
    """One family at the increments of a parameter."""
    with locating(case.where, "lattice.cell"):
        family: CellFamily = lookup(registry, "cell_families", case.lattice.cell)
    with locating(case.where, "lattice.parameters"):
        complete_parameters(family, case.lattice.parameters)
    with locating(case.where, "lattice.parameter_map.parameter"):
        increments = cell_increments(
            family, case.lattice.parameters, spec.parameter, spec.values, spec.increments
        )
    return StatedCells(
        families=increments.cells,
        window=increments.window,
        level_of=increments.level_of,
        increments=increments,
    )


def build_cells(
    case: GenerateCase,
    cells: StatedCells,
    cell_map: Field,
    *,
    density: DensityGrid | float,
    domain: DesignDomain,
) -> BuiltCells:
    """Join families and map.

    Parameters
    ----------
    case : GenerateCase
    cells : StatedCells
    cell_map : callable
        Points ``(3, ...)`` mm to ``(3, ...)`` cell coordinates.
    density : DensityGrid or float
        A transition must be connected at its least value; a parameter may follow it.
    domain : DesignDomain

    Raises
    ------
    DensityError
        If the weight leaves 0 to 1 inside the part.
    LatticeError
        If the transition falls apart.
    """
    if cells.increments is not None:
        share = parameter_share(case, cells.increments, density, domain)
        mix, period = cells.increments.shape, cells.families[0].family.period
        shape, mapped, kept = levelled_mix(case, (mix, period, share), cell_map, density, domain)
        return BuiltCells(
            shape=shape,
            parameters={},
            cell_map=mapped,
            transition={
                "parameter": cells.increments.parameter,
                "values": cells.increments.values.tolist(),
                **kept,
            },
        )
    first, *others = cells.families
    spec = case.lattice.transition
    if spec is None:
        return BuiltCells(
            shape=blamed_shape(first.family),
            parameters=first.parameters,
            cell_map=cell_map,
            transition={},
        )
    least, scale = least_density(density), _scale(spec)
    with locating(case.where, "lattice.transition.weight"):
        grid = _weight_grid(case, spec, domain)
    with locating(case.where, "lattice.transition"):
        shift = spec.shift
        if shift is None:
            shift = joining_shift(first, others[0], least, scale=scale)
        mixed = cell_transition(first, others[0], scale=scale, shift=shift)
        neck = measure_neck(mixed, least)
    period = lcm(*(c.family.period for c in cells.families))
    shape, mapped, kept = levelled_mix(
        case, (mixed.shape, period, partial(evaluate, grid)), cell_map, density, domain
    )
    return BuiltCells(
        shape=shape,
        parameters={},
        cell_map=mapped,
        transition={
            "cell": others[0].family.name,
            "parameters": dict(others[0].parameters),
            "scale": spec.scale,
            "shift_cells": list(shift),
            "density": least,
            "neck_over_two_cells": asdict(neck),
            **kept,
        },
    )


def _weight_grid(case: GenerateCase, spec: TransitionSpec, domain: DesignDomain) -> DensityGrid:
    """Weight of the second cell of a transition."""
    return sample_density(
        formula_field(parse_formula(spec.weight), domain.distance),
        domain.distance,
        domain.lower,
        domain.upper,
        spacing=case.lattice.cell_size / WEIGHT_NODES_PER_CELL,
        window=(0.0, 1.0),
        quantity="weight of the transition",
        memory_limit_bytes=case.run.memory,
    )


def least_density(density: DensityGrid | float) -> float:
    """Smallest density of a lattice."""
    return float(density.values.min()) if isinstance(density, DensityGrid) else density


def parameter_share(
    case: GenerateCase,
    increments: CellIncrements,
    density: DensityGrid | float,
    domain: DesignDomain,
) -> Field:
    """Place between the first and last increment, 0 to 1, at points ``(3, ...)`` mm.

    Raises
    ------
    CaseError
        If the parameter is to follow a density that is the same everywhere.
    DensityError
        If the formula leaves the values of the increments inside the part.
    """
    spec = case.lattice.parameter_map
    first, last = float(increments.values[0]), float(increments.values[-1])
    with locating(case.where, "lattice.parameter_map"):
        if spec is None or spec.formula is None:
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
            spacing=case.lattice.cell_size / WEIGHT_NODES_PER_CELL,
            window=(0.0, 1.0),
            quantity=f"formula of {increments.parameter}, with {first:g} as 0 and {last:g} as 1,",
            memory_limit_bytes=case.run.memory,
        )
    return lambda points: evaluate(shares, points)


def thinnest_wall(cells: StatedCells, density: float, size: float) -> float:
    """Thinnest wall or strut of the families at a density, mm."""
    return min(float(wall_mm(c, density, size)) for c in cells.families)


def _calibrated(
    case: GenerateCase, registry: Registry, key: str, name: str, stated: Mapping[str, float]
) -> Cell:
    with locating(case.where, f"{key}.cell"):
        family: CellFamily = lookup(registry, "cell_families", name)
    with locating(case.where, f"{key}.parameters"):
        parameters = complete_parameters(family, stated)
    with locating(case.where, f"{key}.cell"):
        return calibrate(family, parameters)


def _scale(spec: TransitionSpec) -> Scale:
    scale: Literal["rank", "distance"] = "distance" if spec.scale == "distance" else "rank"
    return scale
