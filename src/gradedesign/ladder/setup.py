"""From a case to everything that does not change from round to round."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray
from gradedesign.case.schema import Case
from gradedesign.cell.calibration import Calibration, calibrate
from gradedesign.cell.cell_map import uniform_map
from gradedesign.cell.family import CellFamily
from gradedesign.cell.wall_size import density_for_wall
from gradedesign.errors import CaseError, DensityError
from gradedesign.fe.load_case import case_loads, region_nodes
from gradedesign.fe.space import TetSpace, tet_space
from gradedesign.lattice.lattice import KeptRegion
from gradedesign.material.material import Material
from gradedesign.material.scaling_law import ScalingLaw
from gradedesign.mesh.tet_mesh import TetMesh, centroids, signed_volumes
from gradedesign.part.part import Part, read_part
from gradedesign.part.part_mesh import (
    box_part_mesh,
    check_region_area,
    mesh_part,
    region_facets,
)
from gradedesign.part.signed_distance import region_distance, surface_distance
from gradedesign.plugin.choose_law import choose_law
from gradedesign.plugin.registry import Registry, lookup
from gradedesign.sizing.homogenised import HomogenisedModel, homogenised_model
from gradedesign.sizing.responses import DisplacementLimit
from gradedesign.verify.phases import considered_at

log = logging.getLogger(__name__)

#: Sample points per edge when the solid share of a tetrahedron is counted.
SHARE_SAMPLES = 4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Setup:
    """A case resolved to records, its part meshed, its loads applied.

    Attributes
    ----------
    case : Case
    material : Material
    family : CellFamily
    parameters : dict of str to float
    calibration : Calibration
    law : ScalingLaw
    bounds : (float, float)
        Intersection of the user's, the family's, the law's and the printer's density windows.
    part : Part
    distance : callable
        Signed distance of the part.
    mesh_attempts : tuple of str
        What the part's mesher needed.
    space : TetSpace
        Quadratic tetrahedra of the part.
    facets : dict of region to (k, 3) int array
    model : HomogenisedModel
        Without corrections.
    displacement_limits : tuple of DisplacementLimit
    stress_limit : float or None, MPa
    considered : (M,) bool array
        Tetrahedra outside the exclusion radius.
    clamped : tuple of callable
    exclusion_radius : float, mm
    kept : tuple of KeptRegion
    cell_map : callable
    warnings : tuple of str
    """

    case: Case
    material: Material
    family: CellFamily
    parameters: dict[str, float]
    calibration: Calibration
    law: ScalingLaw
    bounds: tuple[float, float]
    part: Part
    distance: Field
    mesh_attempts: tuple[str, ...]
    space: TetSpace
    facets: dict[str, IntArray]
    model: HomogenisedModel
    displacement_limits: tuple[DisplacementLimit, ...]
    stress_limit: float | None
    considered: BoolArray
    clamped: tuple[Field, ...]
    exclusion_radius: float
    kept: tuple[KeptRegion, ...]
    cell_map: Field
    warnings: tuple[str, ...]


def resolve_material(case: Case, registry: Registry) -> Material:
    """Material of the case: from the library, with what the case states instead."""
    spec = case.material
    stated = {
        key: value
        for key in (
            "youngs_modulus",
            "poissons_ratio",
            "density",
            "yield_strength",
            "thermal_expansion",
        )
        if (value := getattr(spec, key)) is not None
    }
    if spec.name is not None:
        base: Material = lookup(registry, "materials", spec.name)
        values = {key: getattr(base, key) for key in Material.__dataclass_fields__}
        source = (
            base.source
            if not stated
            else f"{base.source}; stated in the case: " + ", ".join(sorted(stated))
        )
        return Material(**{**values, **stated, "source": source})
    return Material(name="stated in the case", **stated)


def density_bounds(
    case: Case,
    family: CellFamily,
    calibration: Calibration,
    law: ScalingLaw,
    parameters: Mapping[str, float],
) -> tuple[tuple[float, float], list[str]]:
    """Intersect the density windows and say which one narrowed the user's.

    Raises
    ------
    DensityError
        If nothing is left.
    """
    low, high = case.lattice.density
    windows = {
        f"cell family '{family.name}'": calibration.window,
        f"law '{law.name}'": law.window,
    }
    if case.print is not None:
        floor = density_for_wall(family, parameters, case.print.min_wall, case.lattice.size)
        windows[f"[print] min_wall {case.print.min_wall:g} mm"] = (floor, 1.0)
    warnings = []
    for name, (a, b) in windows.items():
        if a > low + 1e-9 or b < high - 1e-9:
            warnings.append(
                f"density [{low:g}, {high:g}] narrowed to [{max(low, a):.4g}, {min(high, b):.4g}] "
                f"by the window [{a:.4g}, {b:.4g}] of {name}"
            )
        low, high = max(low, a), min(high, b)
    if low > high:
        listed = "; ".join(f"{n}: [{a:.4g}, {b:.4g}]" for n, (a, b) in windows.items())
        raise DensityError(
            f"{case.path}: [lattice] density {list(case.lattice.density)} has nothing in common "
            f"with the windows of what it uses ({listed}); widen it or choose another cell or law"
        )
    return (low, high), warnings


def prepare(case: Case, registry: Registry) -> Setup:
    """Resolve names, read and mesh the part, find its regions, apply its loads."""
    material = resolve_material(case, registry)
    family: CellFamily = lookup(registry, "cell_families", case.lattice.cell)
    parameters = cell_parameters(case, family)
    calibration = calibrate(family, parameters)
    law = choose_law(registry, family.name, case.lattice.law, case.lattice.density)
    bounds, warnings = density_bounds(case, family, calibration, law, parameters)
    part = read_part(case, {s: r.read for r in registry.readers.values() for s in r.suffixes})
    mesh, attempts = part_tets(case, part)
    space = tet_space(mesh, 2)
    facets = part_facets(case, part, mesh)
    distance = surface_distance(part.surface)
    kept = tuple(
        KeptRegion(distance=region_distance(part.regions[k.region].corners), margin=k.margin)
        for k in case.keep
    )
    clamped_names = sorted({f.region for spec in case.load_case for f in spec.fix})
    clamped = tuple(region_distance(part.regions[name].corners) for name in clamped_names)
    radius = exclusion_radius(case)
    rotation = Rotation.from_euler("XYZ", case.lattice.rotation, degrees=True).as_matrix()
    share = solid_share(mesh, distance, case.lattice.skin, kept)
    model = homogenised_model(
        space,
        share,
        material,
        law,
        case_loads(space, case, part.regions, facets),
        rotation=rotation,
    )
    return Setup(
        case=case,
        material=material,
        family=family,
        parameters=parameters,
        calibration=calibration,
        law=law,
        bounds=bounds,
        part=part,
        distance=distance,
        mesh_attempts=attempts,
        space=space,
        facets=facets,
        model=model,
        displacement_limits=displacement_limits(case, space, facets),
        stress_limit=stress_limit(case, material),
        considered=considered_at(centroids(mesh), clamped, radius),
        clamped=clamped,
        exclusion_radius=radius,
        kept=kept,
        cell_map=uniform_map(case.lattice.size, origin=case.lattice.origin, rotation=rotation),
        warnings=(*case.warnings, *part.report.warnings, *warnings),
    )


def cell_parameters(case: Case, family: CellFamily) -> dict[str, float]:
    """Defaults of the family with what the case states."""
    unknown = sorted(set(case.lattice.parameters) - set(family.parameters))
    if unknown:
        raise CaseError(
            f"{case.path}: [lattice] parameters {unknown} are not parameters of cell "
            f"'{family.name}', which has {sorted(family.parameters) or 'none'}"
        )
    return {**family.parameters, **case.lattice.parameters}


def part_tets(case: Case, part: Part) -> tuple[TetMesh, tuple[str, ...]]:
    """Tetrahedra of the part: structured for a box, by the mesher otherwise."""
    if case.part.box is not None:
        return box_part_mesh(case.part.box, case.part.mesh_size), ()
    meshed = mesh_part(
        part.surface,
        case.part.mesh_size,
        time_limit_s=case.run.time,
        memory_limit_bytes=case.run.memory,
    )
    return meshed.mesh, meshed.attempts


def used_regions(case: Case) -> tuple[str, ...]:
    """Regions that loads, supports or displacement limits speak about."""
    names = {f.region for spec in case.load_case for f in spec.fix}
    names |= {s.region for spec in case.load_case for s in spec.load}
    names |= {limit.region for limit in case.limits.displacement}
    return tuple(sorted(names))


def part_facets(case: Case, part: Part, mesh: TetMesh) -> dict[str, IntArray]:
    """Facets of every used region on the part's tetrahedra, with its area checked."""
    facets = {}
    for name in used_regions(case):
        region = part.regions[name]
        found = region_facets(mesh, region.corners, tolerance=0.1 * case.part.mesh_size)
        check_region_area(found, region.area, name=name)
        facets[name] = found.facets
    return facets


def exclusion_radius(case: Case) -> float:
    """Radius around clamped regions where stress is not judged, mm."""
    if case.limits.exclusion_radius is not None:
        return case.limits.exclusion_radius
    return (case.limits.exclusion_mesh_sizes or 0.0) * case.part.mesh_size


def stress_limit(case: Case, material: Material) -> float | None:
    """Allowed von Mises stress, MPa."""
    if case.limits.safety_factor is not None:
        return material.yield_strength / case.limits.safety_factor
    return case.limits.stress


def displacement_limits(
    case: Case, space: TetSpace, facets: Mapping[str, IntArray]
) -> tuple[DisplacementLimit, ...]:
    """One limit per region, direction and load case it holds for."""
    limits = []
    for spec in case.limits.displacement:
        what = "magnitude" if spec.component is None else "xyz"[spec.component]
        for load_case in case.load_case:
            if spec.load_case in (None, load_case.name):
                limits.append(
                    DisplacementLimit(
                        name=f"{spec.region} {what}",
                        load_case=load_case.name,
                        nodes=region_nodes(space, facets[spec.region]),
                        component=spec.component,
                        limit=spec.value,
                    )
                )
    return tuple(limits)


def solid_share(
    mesh: TetMesh, distance: Field, skin: float | None, kept: tuple[KeptRegion, ...]
) -> FloatArray:
    """Share of every tetrahedron that stays solid, counted on interior points, ``(M,)``."""
    count = mesh.tets.shape[1]
    if skin is None and not kept:
        return np.zeros(count)
    weights = _interior_weights(SHARE_SAMPLES)
    corners = mesh.points[:, mesh.tets]
    points = np.einsum("dcm,qc->dqm", corners, weights)
    solid = np.zeros(points.shape[1:], dtype=bool)
    if skin is not None:
        solid |= distance(points) > -skin
    for region in kept:
        solid |= region.distance(points) < region.margin
    return np.asarray(solid.mean(axis=0), dtype=np.float64)


def _interior_weights(n: int) -> FloatArray:
    """Barycentric coordinates of evenly spread interior points, ``(k, 4)``."""
    return np.array(
        [
            ((i + 0.25) / n, (j + 0.25) / n, (k + 0.25) / n, (n - 1 - i - j - k + 0.25) / n)
            for i in range(n)
            for j in range(n - i)
            for k in range(n - i - j)
        ]
    )


def part_volume(setup: Setup) -> float:
    """Volume of the part's tetrahedra, mm^3."""
    return float(signed_volumes(setup.space.mesh).sum())
