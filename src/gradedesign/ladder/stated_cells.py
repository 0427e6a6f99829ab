"""The cells that a case states: one family, or two with a transition between them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.case.formula import parse_formula
from gradedesign.case.generate_schema import GenerateCase, TransitionSpec
from gradedesign.cell.calibration import Calibration, calibrate
from gradedesign.cell.family import CellFamily
from gradedesign.cell.neck import joining_shift, measure_neck
from gradedesign.cell.shape import complete_parameters
from gradedesign.cell.transition import Scale, cell_transition
from gradedesign.cell.wall_size import density_for_wall, wall_mm
from gradedesign.ladder.locate import locating
from gradedesign.lattice.density_grid import evaluate
from gradedesign.lattice.density_source import sample_density
from gradedesign.lattice.formula_density import formula_field
from gradedesign.plugin.registry import Registry, lookup

#: The weight of a second family is kept on a grid with this many nodes per cell.
WEIGHT_NODES_PER_CELL = 8


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StatedCells:
    """One family, or two that pass into each other.

    Attributes
    ----------
    families : tuple of one or two Calibration
    window : (float, float)
        Densities that all families have, with walls that can be printed.
    level_of : callable
        Relative density to level.
    """

    families: tuple[Calibration, ...]
    window: tuple[float, float]
    level_of: Callable[[FloatArray | float], FloatArray]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BuiltCells:
    """What a lattice is built from: shape, its parameters, its coordinates.

    Attributes
    ----------
    shape : callable
    parameters : mapping of str to float
    cell_map : callable
        Points ``(3, ...)`` mm to cell coordinates, with the weight as fourth if there are two
        families.
    transition : mapping
        What was measured of the transition, for the result; empty without one.
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
    families = [_calibrated(case, registry, "lattice", spec.cell, spec.parameters)]
    level_of = families[0].level_of
    window = families[0].window
    if spec.transition is not None:
        second = spec.transition
        key = "lattice.transition"
        families.append(_calibrated(case, registry, key, second.cell, second.parameters))
        with locating(case, key):
            plain = cell_transition(families[0], families[1], scale=_scale(second))
        level_of, window = plain.level_of, plain.window
    if case.print is not None:
        with locating(case, "print.min_wall"):
            floors = [
                density_for_wall(c.family, c.parameters, case.print.min_wall, spec.cell_size)
                for c in families
            ]
        window = (max(window[0], *floors), window[1])
    return StatedCells(families=tuple(families), window=window, level_of=level_of)


def build_cells(
    case: GenerateCase,
    cells: StatedCells,
    cell_map: Field,
    *,
    density: float,
    distance: Field,
    lower: FloatArray,
    upper: FloatArray,
) -> BuiltCells:
    """Join families and map.

    Parameters
    ----------
    case : GenerateCase
    cells : StatedCells
    cell_map : callable
        Points ``(3, ...)`` mm to ``(3, ...)`` cell coordinates.
    density : float
        The least; at it a transition must hold together.
    distance : callable
        Signed distance of the part.
    lower, upper : (3,) array, mm
        Its box.

    Raises
    ------
    DensityError
        If the weight leaves 0 to 1 inside the part.
    LatticeError
        If the transition falls apart.
    """
    spec, first = case.lattice.transition, cells.families[0]
    if spec is None:
        return BuiltCells(
            shape=first.family.shape,
            parameters=first.parameters,
            cell_map=cell_map,
            transition={},
        )
    second = cells.families[1]
    with locating(case, "lattice.transition.weight"):
        grid = sample_density(
            formula_field(parse_formula(spec.weight), distance),
            distance,
            lower,
            upper,
            spacing=case.lattice.cell_size / WEIGHT_NODES_PER_CELL,
            window=(0.0, 1.0),
            what="weight of the transition",
        )
    with locating(case, "lattice.transition"):
        shift = spec.shift
        if shift is None:
            shift = joining_shift(first, second, density, scale=_scale(spec))
        mixed = cell_transition(first, second, scale=_scale(spec), shift=shift)
        neck = measure_neck(mixed, density)

    def weighted(points: FloatArray) -> FloatArray:
        return np.concatenate([cell_map(points), evaluate(grid, points)[None]])

    return BuiltCells(
        shape=mixed.shape,
        parameters={},
        cell_map=weighted,
        transition={
            "cell": second.family.name,
            "parameters": dict(second.parameters),
            "scale": spec.scale,
            "shift_cells": list(shift),
            "density": density,
            "neck_over_two_cells": asdict(neck),
        },
    )


def thinnest_wall(cells: StatedCells, density: float, size: float) -> float:
    """Thinnest wall or strut of the families at a density, mm."""
    return min(float(wall_mm(c.family, c.parameters, density, size)) for c in cells.families)


def _calibrated(
    case: GenerateCase, registry: Registry, key: str, name: str, stated: Mapping[str, float]
) -> Calibration:
    with locating(case, f"{key}.cell"):
        family: CellFamily = lookup(registry, "cell_families", name)
    with locating(case, f"{key}.parameters"):
        parameters = complete_parameters(family, stated)
    with locating(case, f"{key}.cell"):
        return calibrate(family, parameters)


def _scale(spec: TransitionSpec) -> Scale:
    scale: Literal["rank", "distance"] = "distance" if spec.scale == "distance" else "rank"
    return scale
