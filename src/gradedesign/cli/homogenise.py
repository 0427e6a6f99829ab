"""``gradedesign homogenise``: the effective stiffness and strength of a cell."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.cell.calibration import calibrate
from gradedesign.cell.cell import Cell
from gradedesign.cli.plugins import registry_for
from gradedesign.cli.progress_lines import ProgressLines
from gradedesign.cli.show import print_json
from gradedesign.cli.show_properties import print_properties
from gradedesign.errors import CaseError
from gradedesign.homogenise.bounds import check_bounds
from gradedesign.homogenise.cell_properties import CellProperties, cell_properties
from gradedesign.homogenise.conductivity import conductivity_bound, extrapolated_conductivity
from gradedesign.homogenise.constants import (
    engineering_constants,
    isotropic_averages,
    youngs_along,
    zener_ratio,
)
from gradedesign.homogenise.critical_stress import CriticalStress, critical_stress
from gradedesign.homogenise.directional import youngs_extremes
from gradedesign.ladder.summary import library_versions
from gradedesign.material.scaling_law import ScalingLaw
from gradedesign.material.stiffness_constants import relative_errors
from gradedesign.output.property_plots import (
    plot_laws,
    plot_stiffness,
    plot_strength_surface,
)
from gradedesign.plugin.registry import lookup
from gradedesign.workspace.atomic import write_text
from gradedesign.workspace.progress import report_step

#: Components of stress in the order of the stiffness.
VOIGT = ("xx", "yy", "zz", "yz", "xz", "xy")


def homogenise(
    cell: str,
    density: float,
    *,
    resolution: int | None,
    parameters: Sequence[str],
    poissons_ratio: float,
    output: Path | None,
    conductivity: bool,
    buckling: bool,
    strict_plugins: bool,
    as_json: bool,
) -> None:
    """Compute the properties of a cell, print them, and with an output folder draw them.

    Raises
    ------
    CaseError
        For an unknown cell or parameter, or a folder that cannot be made.
    DensityError, LatticeError, SolverError
        As `cell_properties`, and `critical_stress` with ``buckling``.
    """
    registry = registry_for(strict_plugins=strict_plugins)
    family = lookup(registry, "cell_families", cell)
    values = parsed_parameters(parameters)
    with ProgressLines("homogenise", err=True):
        chosen = calibrate(family, values)
        found = cell_properties(
            chosen,
            density,
            poissons_ratio=poissons_ratio,
            resolution=resolution,
            with_surface=output is not None,
        )
        data = properties_data(chosen, found, poissons_ratio)
        laws = [law for law in registry.scaling_laws.values() if cell in law.families]
        data["laws"] = law_values(laws, density)
        if conductivity:
            report_step("conductivity")
            data["conductivity"] = _conductivity_data(chosen, found)
        if buckling:
            critical = critical_stress(chosen, density, poissons_ratio=poissons_ratio)
            data["buckling"] = _buckling_data(critical)
        if output is not None:
            report_step("drawing")
            data["files"] = [str(p) for p in write_files(output, data, found, laws, poissons_ratio)]
    if as_json:
        print_json(data)
    else:
        print_properties(data)


def parsed_parameters(texts: Sequence[str]) -> dict[str, float]:
    """Values of ``name=number`` texts.

    Raises
    ------
    CaseError
        For a text of another form, or a name given twice.
    """
    found: dict[str, float] = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            number = float(value)
        except ValueError as error:
            raise CaseError(
                f"--parameter {text} is not understood; expected name=number, such as strut=0.2"
            ) from error
        if name.strip() in found:
            raise CaseError(f"--parameter {name.strip()} is given twice; give it once")
        found[name.strip()] = number
    return found


def properties_data(
    cell: Cell,
    found: CellProperties,
    poissons_ratio: float,
) -> dict[str, Any]:
    """Plain data of computed properties; moduli are relative to the base material's E."""
    c = found.stiffness
    constants, means = engineering_constants(c), isotropic_averages(c)
    least, softest, greatest, stiffest = youngs_extremes(c)
    diagonals = youngs_along(c, np.array([[1.0, 1, 1], [0, 1, 1], [0, 0, 1]]))
    data: dict[str, Any] = {
        "cell": cell.name,
        "parameters": dict(cell.parameters),
        "density": found.density,
        "poissons_ratio": poissons_ratio,
        "resolution": found.resolution,
        "symmetry": cell.family.symmetry,
        "relative_to": "Young's modulus of the base material",
        "voigt_order": list(VOIGT),
        "shear": "engineering",
        "C": _rounded(c),
        "C_uncertainty": _rounded(found.uncertainty, 2),
        "stiffness_error": _digits(found.stiffness_error, 2),
        "energy_error": _digits(found.energy_error, 2),
        "constant_errors": {
            name: _digits(float(error[0]), 2)
            for name, error in relative_errors(
                found.stiffness[None], found.uncertainty[None], cell.family.symmetry
            ).items()
        },
        "engineering": {
            "E": dict(zip("xyz", map(_digits, constants.youngs), strict=True)),
            "G": dict(zip(("yz", "xz", "xy"), map(_digits, constants.shear), strict=True)),
            "nu": dict(zip(("yz", "xz", "xy"), map(_digits, constants.poisson), strict=True)),
        },
        "youngs": {
            "100": _digits(float(diagonals[0])),
            "110": _digits(float(diagonals[1])),
            "111": _digits(float(diagonals[2])),
            "least": _digits(least),
            "least_along": _direction(softest),
            "greatest": _digits(greatest),
            "greatest_along": _direction(stiffest),
        },
        "averages": {
            "bulk": _averages(means.bulk_voigt, means.bulk_reuss),
            "shear": _averages(means.shear_voigt, means.shear_reuss),
            "hill_youngs": _digits(means.youngs),
            "hill_poisson": _digits(means.poisson),
        },
        "zener": _digits(zener_ratio(c)),
        "bounds": [
            {
                "name": bound.name,
                "value": _digits(bound.value),
                "lower": bound.lower,
                "upper": None if np.isinf(bound.upper) else _digits(bound.upper),
                "holds": bound.holds,
            }
            for bound in check_bounds(c, found.density, poissons_ratio)
        ],
        "strength": _strength_data(found),
        "versions": library_versions(),
    }
    return data


def law_values(laws: Sequence[ScalingLaw], density: float) -> list[dict[str, Any]]:
    """Young's modulus along x by every law whose window holds the density."""
    return [
        {
            "name": law.name,
            "kind": law.kind,
            "E_x": _digits(1 / float(np.linalg.inv(law.stiffness(np.array(density)))[0, 0])),
            "source": law.source,
        }
        for law in laws
        if law.window[0] <= density <= law.window[1]
    ]


def write_files(
    folder: Path,
    data: Mapping[str, Any],
    found: CellProperties,
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
    title = f"{data['cell']} at relative density {found.density:g}"
    plot_stiffness(sphere, found.stiffness, title=title)
    youngs = data["engineering"]["E"]["x"]
    plot_laws(
        curves,
        laws,
        title=title,
        poissons_ratio=poissons_ratio,
        density=found.density,
        youngs=youngs,
        error=youngs * found.energy_error,
    )
    files = [record, sphere, curves]
    if found.surface is not None:
        plot_strength_surface(surface, found.surface, title=title)
        files.append(surface)
    write_text(record, json.dumps(data, indent=2, allow_nan=False) + "\n")
    return files


def _strength_data(found: CellProperties) -> dict[str, Any]:
    """Plain data of a strength."""
    data: dict[str, Any] = {
        "value": _digits(found.strength.strength),
        "error": _digits(found.strength_error, 2),
        "percentile": found.strength.percentile,
        "factors": {
            **{name: _digits(v, 5) for name, v in found.strength.factor.items()},
            "hydrostatic": _digits(found.strength.hydrostatic, 5),
        },
    }
    if found.surface is not None:
        data["surface"] = {
            "exponent": found.surface.exponent,
            "terms": int(found.surface.weights.size),
            "max_error": _digits(found.surface.max_error, 2),
            "rms_error": _digits(found.surface.rms_error, 2),
            "unsafe_error": _digits(found.surface.unsafe_error, 2),
        }
    return data


def _conductivity_data(cell: Cell, found: CellProperties) -> dict[str, Any]:
    """Plain data of the conductivity, relative to the base material's."""
    value, error = extrapolated_conductivity(cell, found.density, found.resolution)
    return {
        "value": [[_digits(float(v)) if abs(v) > 1e-9 else 0.0 for v in row] for row in value],
        "error": _digits(error, 2),
        "isotropic_bound": _digits(conductivity_bound(found.density)),
    }


def _buckling_data(found: CriticalStress) -> dict[str, Any]:
    """Plain data of critical stresses, over the base material's Young's modulus.

    A sense that was not seen to buckle, whose size is only a lower limit, repeats after 0 cells.
    """
    return {
        "resolution": found.resolution,
        "wall_voxels": _digits(found.wall_voxels, 3),
        "error": _digits(found.error, 2),
        "critical": [
            {
                "component": VOIGT[k],
                "negative": _digits(float(found.critical[k, 0]), 4),
                "positive": _digits(float(found.critical[k, 1]), 4),
                "cells": [int(n) for n in found.cells[k]],
            }
            for k in range(6)
        ],
    }


def _averages(voigt: float, reuss: float) -> dict[str, float]:
    """Voigt's, Reuss' and Hill's average."""
    return {
        "voigt": _digits(voigt),
        "reuss": _digits(reuss),
        "hill": _digits(0.5 * (voigt + reuss)),
    }


def _direction(vector: FloatArray) -> list[float]:
    """Components of a unit vector; of the two opposite ones that with the larger sum."""
    turned = vector if vector.sum() >= 0 else -vector
    return [round(float(v), 3) + 0.0 for v in turned]


def _rounded(matrix: FloatArray, digits: int = 7) -> list[list[float]]:
    """Rows of a matrix in significant digits."""
    return [[_digits(float(v), digits) for v in row] for row in matrix]


def _digits(value: float, digits: int = 7) -> float:
    """Round to significant digits."""
    return float(f"{value:.{digits}g}")
