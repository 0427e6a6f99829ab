"""Entries that every result of a run has: law, cells, masses of the solid part, versions."""

from __future__ import annotations

import math
import platform
from importlib import metadata
from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.design.case.schema import CaseName
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.design.resolve.load_balance import load_case_data
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.resolve_law import buckling_basis, stress_basis
from gradedesign.design.resolve.size_effects import why_periodic
from gradedesign.design.resolve.symmetry import symmetry_data
from gradedesign.design.resolve.zoning import Zoning
from gradedesign.geometry.part.file_faces import file_body_data
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.tets.tet_mesh import centroids
from gradedesign.mechanics.limits.verdict import unsure_words
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.sizing.homogenised import solid_held
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel

#: Libraries whose versions the report names.
_LIBRARIES = ("numpy", "scipy", "scikit-fem", "pyamg", "numba", "pytetwild", "meshio")


def latticed_mass(part: HomogenisedModel) -> float:
    """Mass of the lattice's region if it were solid, g."""
    return float(part.lattice_volumes.sum()) * part.material.density * 1e6


def solid_mass(part: HomogenisedModel) -> float:
    """Mass of the fully solid part, g."""
    return float(part.volumes.sum()) * part.material.density * 1e6


def case_entries(
    case: CaseName, part: Part, material: Material | None, registry: Registry
) -> dict[str, Any]:
    """Entries of a `RunResult` on the case, its part and what read it."""
    return {
        "repairs": part.report.changes,
        "file_bodies": file_body_data(part.file_bodies),
        "plugins": tuple(str(p) for p in registry.plugins),
        "versions": library_versions(),
        "case_hash": case.hash,
        "case_name": case.name,
        "material": {} if material is None else material_data(material),
    }


def common_entries(model: DesignModel, registry: Registry) -> dict[str, Any]:
    """Entries of a `RunResult` that follow from the case alone."""
    plan, cells, case = model.plan, model.cells, model.plan.case
    law, mass = cells.law, solid_mass(model.homogenised)
    return {
        "solid_mass_g": mass,
        "solid": model.solid,
        **case_entries(case.named, plan.part, plan.material, registry),
        "symmetry": symmetry_data(plan.symmetry, mass),
        "yields": model.solid_yields,
        "warnings": (
            *model.solid_yields,
            *unsure_words(model.solid),
            *model.warnings,
            *registry.notes,
        ),
        "load_cases": load_case_data(case.load_case, plan.balances),
        "budget": {
            "time_s": case.run.time,
            "max_iterations": case.run.max_iterations,
        },
        "law": {
            "name": law.name,
            "source": law.source,
            "test": law.test,
            "kind": law.kind,
            "local_stress": stress_basis(law),
            "buckling": buckling_basis(law),
            **{name: value for limit in model.limits for name, value in limit.basis().items()},
            "size_effects": _size_effects_data(model),
            "window": list(law.window),
            "coefficients": {name: value for name, value in law.coefficients},
            "method": case.lattice.method,
            "cell": cells.cell.name,
            "cell_source": cells.cell.family.source,
            "cell_window": list(cells.cell.window),
            "density_bounds": list(cells.bounds),
            **zone_data(cells.zoning),
        },
    }


def _size_effects_data(model: DesignModel) -> dict[str, Any]:
    """Plain data on size effects: the share of the lattice that has them, or why none has."""
    part, walls = model.homogenised, model.homogenised.walls
    if walls is None:
        plan, cells = model.plan, model.cells
        reason = why_periodic(
            plan.case,
            cells.law.kind,
            cells.cell,
            cells.bounds[0],
            plan.part,
            plan.domain,
            cells.layout,
        )
        return {"mode": "periodic", **({"reason": reason} if reason else {})}
    weight = part.volumes * (part.solid_fraction < 1)
    return {
        "mode": "walls",
        "wall_kinds": len(walls.classes),
        "share_of_lattice_in_walls_across": {
            axis: round(float(weight @ (kind >= 0) / weight.sum()), 3)
            for axis, kind in zip("xyz", walls.kind, strict=True)
        },
        "densities": [float(walls.density[0]), float(walls.density[-1])],
    }


def library_versions() -> dict[str, str]:
    """Versions of Python, gradedesign and what it computes with."""
    versions = {"python": platform.python_version(), "gradedesign": metadata.version("gradedesign")}
    for name in _LIBRARIES:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            versions[name] = "not installed"
    return versions


def material_data(material: Material) -> dict[str, Any]:
    """Numbers of the material, with their units, and their source."""
    return {
        "name": material.name,
        "youngs_modulus_MPa": material.youngs_modulus,
        "poissons_ratio": material.poissons_ratio,
        # Rounded: 4.41 as stated, not 4.410000000000001.
        "density_g_cm3": float(f"{1e9 * material.density:.12g}"),
        # A case that limits no stress may leave it out.
        "yield_strength_MPa": (
            None if math.isnan(material.yield_strength) else material.yield_strength
        ),
        "thermal_expansion_per_K": material.thermal_expansion,
        "source": material.source,
        "fatigue": [curve.data() for curve in material.fatigue],
    }


def zone_data(zoning: Zoning | None) -> dict[str, Any]:
    """Cell and law of every zone, and the factors of the transitions; empty without zones."""
    if zoning is None:
        return {}
    return {
        "zones": {
            zone.name: {
                "cell": zoning.cells.members[zone.cell].name,
                "parameters": dict(zoning.cells.members[zone.cell].parameters),
                "law": zoning.laws[zone.cell].name,
                "density_bounds": list(zone.bounds),
                "solid_members": zone.members,
            }
            for zone in zoning.zones
        },
        **_transitions(zoning),
    }


def zone_measures(
    model: HomogenisedModel, zoning: Zoning | None, rho: FloatArray
) -> dict[str, Any]:
    """Volume, mass and mean density of the lattice of every zone of a design; empty without zones.

    By the densities that sizing found, which the printed file follows. Where two zones pass into
    each other, each has its weight.

    ``rho (M,)``.
    """
    if zoning is None:
        return {}
    weights = zoning.weights(centroids(model.space.mesh)) * model.lattice_volumes
    solid = weights @ solid_held(model, rho)
    volume, whole = weights.sum(axis=1), weights.sum()
    return {
        "zones": {
            zone.name: {
                "volume_mm3": float(volume[k]),
                "share_of_lattice": float(volume[k] / whole),
                "mass_g": float(solid[k] * model.material.density * 1e6),
                "density": float(solid[k] / volume[k]) if volume[k] > 0 else None,
            }
            for k, zone in enumerate(zoning.zones)
        }
    }


def _transitions(zoning: Zoning) -> dict[str, Any]:
    """Factors on stiffness and strength of the mixes between the cells that meet."""
    if not zoning.factors:
        return {}
    return {
        "transitions": [
            {
                "cells": [zoning.cells.members[i].name, zoning.cells.members[j].name],
                "share_of_second": np.asarray(mix.share).tolist(),
                "stiffness_factor": np.round(mix.stiffness, 4).tolist(),
                "strength_factor": np.round(mix.strength, 4).tolist(),
                "least_density": np.round(mix.low, 4).tolist(),
            }
            for (i, j), mix in zoning.factors.items()
        ]
    }
