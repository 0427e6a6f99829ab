"""Plain data of a checked case, as ``gradedesign check --json`` prints it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray, plain_vector
from gradedesign.design.check.check_case import CaseCheck
from gradedesign.design.resolve.load_balance import load_case_data
from gradedesign.geometry.lattice.component import KEPT, SolidComponent
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.placed_map import REPORT_POINTS
from gradedesign.geometry.maps.map_report import volume_points
from gradedesign.geometry.part.file_faces import file_body_data
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.regions import Region
from gradedesign.geometry.part.round_shapes import RoundShapes
from gradedesign.mechanics.material.material import Material


def check_data(checked: CaseCheck, picture: Path | None, warnings: Sequence[str]) -> dict[str, Any]:
    """Plain data of a checked case; lengths in mm, forces in N, moments in N mm."""
    plan = checked.plan
    return {
        "case": plan.case.name,
        "part": part_data(plan.part, plan.material),
        "regions": region_data(plan.part.regions),
        "passive_solids": kept_solids(checked),
        "holes": hole_data(checked.holes),
        "load_cases": list(load_case_data(plan.case.load_case, plan.balances)),
        "limits": [
            {"name": name, "load_case": load_case, "allowed": allowed}
            for name, load_case, allowed in stated_limits(checked)
        ],
        "symmetry": dict(checked.symmetry),
        "unjudged_stress": asdict(checked.unjudged),
        "free_rigid_motions": [],
        "cell": plan.cell.name,
        "law": plan.law.name,
        "lattice": _lattice(checked),
        "prediction": _prediction(checked),
        "picture": None if picture is None else str(picture),
        "warnings": list(warnings),
    }


def kept_solids(checked: CaseCheck) -> list[dict[str, Any]]:
    """Names of the passive solids, how thick they are in the part, and their volumes in it."""
    domain = checked.plan.domain
    return [
        {
            "name": solid.name,
            "thickness_mm": solid.least,
            "volume_mm3": solid.facts.get("volume_mm3", _volume(domain, solid, *solid.box)),
        }
        for solid in domain.solids
        if solid.phase == KEPT and solid.box is not None
    ]


def _volume(
    domain: DesignDomain, solid: SolidComponent, lower: FloatArray, upper: FloatArray
) -> float:
    """Volume that a solid holds of the part, mm^3.

    From points that fill its box: one that fills its box is exact, a cylinder within about a
    thousandth. Points that fill the whole part would leave too few in a small one.
    """
    points = volume_points(domain.distance, lower, upper, REPORT_POINTS)
    held = np.count_nonzero(solid.distance(points, domain.distance(points)) < 0)
    return float(np.prod(upper - lower)) * held / REPORT_POINTS


def stated_limits(checked: CaseCheck) -> list[tuple[str, str, str]]:
    """Name, load case and value of every limit as the case states it.

    Those relative to the solid part are not in its unit yet.
    """
    return [(limit.name, limit.load_case, limit.allowed) for limit in checked.plan.limits]


def hole_data(groups: Sequence[RoundShapes]) -> list[dict[str, Any]]:
    """Round shapes of a part, with the lines that select them."""
    return [
        {
            "kind": group.kind,
            "diameter_mm": round(group.diameter, 6),
            "axis": plain_vector(group.axis),
            "half_angle_deg": group.half_angle,
            "length_mm": group.length,
            "faces": group.count,
            "area_mm2": group.area,
            "points_mm": [plain_vector(point) for point in group.points],
            "selector": group.selector,
        }
        for group in groups
    ]


def region_data(regions: Mapping[str, Region]) -> list[dict[str, Any]]:
    """Area and place of every region."""
    return [
        {
            "name": name,
            "faces": len(region.faces),
            "area_mm2": region.area,
            "centroid_mm": plain_vector(region.centroid),
        }
        for name, region in sorted(regions.items())
    ]


def part_data(part: Part, material: Material | None) -> dict[str, Any]:
    """The part as read and repaired; its mass where it has a material."""
    return {
        "source": part.source,
        "units": part.units,
        "chord_tolerance_mm": part.chord_tolerance,
        "size_mm": plain_vector(np.ptp(part.surface.vertices, axis=0)),
        "volume_mm3": part.volume,
        "solid_mass_g": None if material is None else material.density * part.volume * 1e6,
        "triangles": len(part.surface.faces),
        "bodies": part.report.bodies,
        "common_area_mm2": part.report.common_area,
        "repairs": part.report.changes,
        "file_bodies": file_body_data(part.file_bodies),
        "file_faces": file_faces(part),
    }


def file_faces(part: Part) -> list[dict[str, Any]]:
    """Faces that the part's file tells apart, as regions select them; none for a box."""
    faces = part.file_faces
    if faces is None:
        return []
    return [
        {
            "face": number,
            "name": faces.names.get(number),
            "color": faces.colors.get(number),
            "area_mm2": area,
            "centroid_mm": plain_vector(centroid),
            "surface": None if number not in faces.surfaces else faces.surfaces[number].kind,
            "diameter_mm": None
            if number not in faces.surfaces
            else faces.surfaces[number].diameter,
        }
        for number, (area, centroid) in faces.places(part.surface).items()
    ]


def zone_data(checked: CaseCheck) -> dict[str, dict[str, Any]]:
    """Every zone of the case by its name; none without zones."""
    zones = checked.plan.zones
    if zones is None:
        return {}
    return {
        zone.name: {
            "cell": zone.cell.name,
            "law": zone.law.name,
            "to_be_computed": not zone.law.tabulated,
            "density_window": list(zone.bounds),
            "share_of_lattice": share,
            "phases": list(zone.lattice.made),
        }
        for zone, share in zip(zones.zones, zones.volume_share, strict=True)
    }


def _lattice(checked: CaseCheck) -> dict[str, Any]:
    plan, law, spec = checked.plan, checked.plan.law, checked.plan.case.lattice
    return {
        "size_mm": list(spec.size),
        "cell_window": list(plan.cell.window),
        "density_window": list(plan.bounds),
        "least_member_mm": spec.least_member,
        "zones": zone_data(checked),
        "size_effects": {"mode": "periodic", "reason": checked.periodic}
        if checked.periodic
        else {"mode": "walls"},
        "law": {
            "name": law.name,
            "window": list(law.window),
            "to_be_computed": not law.tabulated,
            "minutes": list(law.minutes),
            "voxels": law.voxels or None,
        },
        "part_thickness": {
            "percent_of_volume": list(checked.thickness.shares),
            "below_mm": list(checked.thickness.thickness),
            "cells": list(checked.thickness.cells),
        },
        "lattice_share_of_volume": checked.run.lattice_share,
    }


def _prediction(checked: CaseCheck) -> dict[str, Any]:
    run, budget = checked.run, checked.plan.case.run
    return {
        "density": list(checked.plan.bounds),
        "mean_density": run.density,
        "thinnest_wall_mm": run.grid.wall,
        "spacing_mm": run.grid.spacing,
        "grid_set_by": run.grid.set_by,
        "part_dofs": run.cost.part_dofs,
        "explicit_dofs": run.cost.explicit_dofs,
        "memory_GB": run.cost.memory_bytes / 1e9,
        "memory_allowed_GB": budget.memory / 1e9,
        "seconds_per_iteration": run.iteration_s,
        "seconds": run.run_s,
        "seconds_allowed": budget.time,
        "law_seconds": run.law_s,
        "stages": asdict(run.cost),
    }
