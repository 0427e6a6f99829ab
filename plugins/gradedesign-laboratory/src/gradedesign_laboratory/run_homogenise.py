"""``gradedesign homogenise``: the effective stiffness and strength of a cell."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

import numpy as np

from gradedesign import (
    CaseError,
    CellFamily,
    EigenProblem,
    EigenSolver,
    ExtremeValue,
    ScalingLaw,
    report_step,
)
from gradedesign.commands import (
    ProgressLines,
    Registry,
    blaming,
    library_versions,
    lookup,
    named_cell,
    print_json,
    registry_for,
    write_text,
)
from gradedesign.properties import (
    Cell,
    CellProperties,
    calibrate,
    cell_properties,
    check_bounds,
    critical_long_waves,
    relative_errors,
)
from gradedesign_laboratory.apparent import (
    BOUNDARIES,
    Boundary,
    apparent_stiffness,
)
from gradedesign_laboratory.conductivity import conductivity_bound, extrapolated_conductivity
from gradedesign_laboratory.critical_stress import CriticalStress, critical_stress
from gradedesign_laboratory.homogenise_block import PERIODIC, block_data, require_boundary
from gradedesign_laboratory.moduli_data import VOIGT, cell_header, digits, moduli_data, rounded
from gradedesign_laboratory.property_plots import (
    plot_laws,
    plot_stiffness,
    plot_strength_surface,
)
from gradedesign_laboratory.show_properties import print_block, print_properties


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """Options of ``homogenise``.

    Attributes
    ----------
    cell : str
        A name, or a case whose cell is meant, see `named_cell`.
    density : float
        Relative density.
    cells : int or None
        Along the edge of a finite block.
    resolution : int or None
        Voxels along a cell; None: what its wall needs.
    parameters : sequence of str
        ``name=number``.
    output : Path or None
        Folder for data and plots.
    buckling : str or None
        Eigenvalue solver of critical stresses; None: there are none.
    """

    cell: str
    density: float
    boundary: str
    cells: int | None
    resolution: int | None
    parameters: Sequence[str]
    poissons_ratio: float
    output: Path | None
    conductivity: bool
    buckling: str | None
    strict_plugins: bool
    as_json: bool


def homogenise(asked: Asked) -> None:
    """Compute the properties of a cell, print them, and with an output folder draw them.

    Raises
    ------
    CaseError
        For an unknown cell, parameter or boundary, or a folder that cannot be made.
    DensityError, LatticeError, ResourceError, SolverError
        As `cell_properties`, `apparent_stiffness` with another boundary than the periodic one,
        and `critical_stress` with ``buckling``.
    """
    registry = registry_for(strict_plugins=asked.strict_plugins)
    named = named_cell(registry, asked.cell)
    family, values = named.family, {**named.parameters, **_parsed_parameters(asked.parameters)}
    solver = None if asked.buckling is None else blamed_eigen_solver(registry, asked.buckling)
    if asked.boundary != PERIODIC:
        data = _of_block(asked, family, values)
    elif asked.cells is not None:
        raise CaseError(
            f"--cells {asked.cells} does not go with --boundary {PERIODIC}, whose lattice has no "
            f"end; leave it out or choose one of {', '.join(BOUNDARIES)}"
        )
    else:
        laws = [law for law in registry.scaling_laws.values() if family.name in law.families]
        with ProgressLines("homogenise", err=True):
            data = _of_cell(asked, calibrate(family, values), solver, laws)
    if asked.as_json:
        print_json(data)
    elif asked.boundary == PERIODIC:
        print_properties(data)
    else:
        print_block(data)


def _of_block(asked: Asked, family: CellFamily, values: Mapping[str, float]) -> dict[str, Any]:
    """Apparent stiffness of a finite block, plain data."""
    unused = {
        "-o": asked.output is not None,
        "--conductivity": asked.conductivity,
        "--buckling": asked.buckling is not None,
    }
    require_boundary(asked.boundary, [option for option, is_set in unused.items() if is_set])
    with ProgressLines("homogenise", err=True):
        block = apparent_stiffness(
            calibrate(family, values),
            asked.density,
            boundary=cast("Boundary", asked.boundary),
            cells=1 if asked.cells is None else asked.cells,
            resolution=asked.resolution,
            poissons_ratio=asked.poissons_ratio,
        )
    return block_data(family, values, asked.density, block, asked.poissons_ratio)


def _of_cell(
    asked: Asked, cell: Cell, solver: EigenSolver | None, laws: Sequence[ScalingLaw]
) -> dict[str, Any]:
    """Effective properties of the periodic lattice, plain data; files of them if asked for."""
    properties = cell_properties(
        cell,
        asked.density,
        poissons_ratio=asked.poissons_ratio,
        resolution=asked.resolution,
        with_surface=asked.output is not None,
    )
    data = _properties_data(cell, properties, asked.poissons_ratio)
    data["laws"] = _law_values(laws, asked.density)
    if asked.conductivity:
        report_step("conductivity")
        data["conductivity"] = _conductivity_data(cell, properties)
    if solver is not None:
        critical = critical_stress(
            cell, asked.density, poissons_ratio=asked.poissons_ratio, solver=solver
        )
        data["buckling"] = _buckling_data(critical, properties)
    if asked.output is not None:
        report_step("drawing")
        files = _write_files(asked.output, data, properties, laws, asked.poissons_ratio)
        data["files"] = [str(path) for path in files]
    return data


def blamed_eigen_solver(registry: Registry, name: str) -> EigenSolver:
    """An eigenvalue solver whose failures name the distribution that supplies it.

    Raises
    ------
    CaseError, PluginError
        With the nearest name, if nothing installed supplies it.
    """
    solver: EigenSolver = lookup(registry, "eigen_solvers", name)
    who = f"eigenvalue solver '{name}' of {registry.sources['eigen_solvers'][name]}"

    def solve(problem: EigenProblem) -> tuple[ExtremeValue, ExtremeValue | None]:
        with blaming(who, always=False):
            return solver.solve(problem)

    return replace(solver, solve=solve)


def _parsed_parameters(texts: Sequence[str]) -> dict[str, float]:
    """Values of ``name=number`` texts.

    Raises
    ------
    CaseError
        For a text of another form, or a name given twice.
    """
    parameters: dict[str, float] = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            number = float(value)
        except ValueError as error:
            raise CaseError(
                f"--parameter {text} is not understood; expected name=number, such as strut=0.2"
            ) from error
        if name.strip() in parameters:
            raise CaseError(f"--parameter {name.strip()} is given twice; give it once")
        parameters[name.strip()] = number
    return parameters


def _properties_data(
    cell: Cell,
    properties: CellProperties,
    poissons_ratio: float,
) -> dict[str, Any]:
    """Plain data of computed properties; moduli are relative to the base material's E."""
    c = properties.stiffness
    data: dict[str, Any] = {
        **cell_header(
            cell.family, cell.parameters, properties.density, poissons_ratio, properties.resolution
        ),
        "C": rounded(c),
        "C_uncertainty": rounded(properties.uncertainty, 2),
        "stiffness_error": digits(properties.stiffness_error, 2),
        "energy_error": digits(properties.energy_error, 2),
        "constant_errors": {
            name: digits(float(error[0]), 2)
            for name, error in relative_errors(
                properties.stiffness[None], properties.uncertainty[None], cell.family.symmetry
            ).items()
        },
        **moduli_data(c),
        "bounds": [
            {
                "name": bound.name,
                "value": digits(bound.value),
                "lower": bound.lower,
                "upper": None if np.isinf(bound.upper) else digits(bound.upper),
                "holds": bound.holds,
            }
            for bound in check_bounds(c, properties.density, poissons_ratio)
        ],
        "strength": _strength_data(properties),
        "versions": library_versions(),
    }
    return data


def _law_values(laws: Sequence[ScalingLaw], density: float) -> list[dict[str, Any]]:
    """Young's modulus along x by every law whose window holds the density."""
    return [
        {
            "name": law.name,
            "kind": law.kind,
            "E_x": digits(1 / float(np.linalg.inv(law.stiffness(np.array(density)))[0, 0])),
            "source": law.source,
        }
        for law in laws
        if law.window[0] <= density <= law.window[1]
    ]


def _write_files(
    folder: Path,
    data: Mapping[str, Any],
    properties: CellProperties,
    laws: Sequence[ScalingLaw],
    poissons_ratio: float,
) -> list[Path]:
    """Write the data and the plots of a result into a folder; earlier ones are replaced.

    Raises
    ------
    CaseError
        If the folder cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CaseError(
            f"cannot make folder {folder}: {error.strerror}; name another one"
        ) from error
    names = ("properties.json", "stiffness.png", "laws.png", "strength.png")
    record, sphere, curves, surface = (folder / name for name in names)
    title = f"{data['cell']} at relative density {properties.density:g}"
    plot_stiffness(sphere, properties.stiffness, title=title)
    youngs = data["engineering"]["E"]["x"]
    plot_laws(
        curves,
        laws,
        title=title,
        poissons_ratio=poissons_ratio,
        density=properties.density,
        youngs=youngs,
        error=youngs * properties.energy_error,
    )
    files = [record, sphere, curves]
    if properties.surface is not None:
        plot_strength_surface(surface, properties.surface, title=title)
        files.append(surface)
    write_text(record, json.dumps(data, indent=2, allow_nan=False) + "\n")
    return files


def _strength_data(properties: CellProperties) -> dict[str, Any]:
    """Plain data of a strength."""
    data: dict[str, Any] = {
        "value": digits(properties.strength.strength),
        "error": digits(properties.strength_error, 2),
        "percentile": properties.strength.percentile,
        "factors": {
            **{name: digits(v, 5) for name, v in properties.strength.factor.items()},
            "hydrostatic": digits(properties.strength.hydrostatic, 5),
        },
    }
    if properties.surface is not None:
        data["surface"] = {
            "exponent": properties.surface.exponent,
            "terms": int(properties.surface.weights.size),
            "max_error": digits(properties.surface.max_error, 2),
            "rms_error": digits(properties.surface.rms_error, 2),
            "unsafe_error": digits(properties.surface.unsafe_error, 2),
        }
    return data


def _conductivity_data(cell: Cell, properties: CellProperties) -> dict[str, Any]:
    """Plain data of the conductivity, relative to the base material's."""
    value, error = extrapolated_conductivity(cell, properties.density, properties.resolution)
    return {
        "value": [[digits(float(v)) if abs(v) > 1e-9 else 0.0 for v in row] for row in value],
        "error": digits(error, 2),
        "isotropic_bound": digits(conductivity_bound(properties.density)),
    }


def _buckling_data(critical: CriticalStress, properties: CellProperties) -> dict[str, Any]:
    """Plain data of critical stresses, over the base material's Young's modulus.

    A sense that was not seen to buckle, whose size is only a lower limit, repeats after 0 cells.
    Beside them those of waves of many cells, none where there is no such wave.
    """
    long = critical_long_waves(properties.stiffness)
    return {
        "resolution": critical.resolution,
        "wall_voxels": digits(critical.wall_voxels, 3),
        "error": digits(critical.error, 2),
        "critical": [
            {
                "component": VOIGT[k],
                "negative": digits(float(critical.critical[k, 0]), 4),
                "positive": digits(float(critical.critical[k, 1]), 4),
                "cells": [int(n) for n in critical.cells[k]],
                "long_waves": [digits(float(v), 4) if np.isfinite(v) else None for v in long[k]],
            }
            for k in range(6)
        ],
    }
