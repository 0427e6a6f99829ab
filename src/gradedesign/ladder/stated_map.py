"""The map from mm to cell coordinates that a case states, and what cells it makes."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from gradedesign.arrays import Field, FloatArray
from gradedesign.case.cell_map_schema import CellMapSpec
from gradedesign.case.generate_schema import GenerateCase
from gradedesign.case.regions_schema import direction_vector
from gradedesign.cell.calibration import Calibration
from gradedesign.cell.cell_map import CellMap, uniform_map
from gradedesign.cell.conformal_map import conformal_map
from gradedesign.cell.cylindrical_map import cylindrical_map
from gradedesign.cell.map_report import map_report, require_unfolded, volume_points
from gradedesign.cell.phase_fields import default_spacing, graded_size_map
from gradedesign.cell.size_law import size_field_by_ratio, size_field_for_wall
from gradedesign.cell.spherical_map import spherical_map
from gradedesign.cell.warp_map import MorphingSphere, warp_map
from gradedesign.errors import CaseError
from gradedesign.ladder.locate import locating
from gradedesign.lattice.density_grid import DensityGrid, evaluate
from gradedesign.part.part import Part
from gradedesign.part.signed_distance import region_distance

#: Places in the part's box at which a map is measured.
REPORT_POINTS = 40_000


def stated_map(
    case: GenerateCase,
    part: Part,
    calibration: Calibration,
    density: DensityGrid | float,
    distance: Field,
) -> tuple[CellMap, dict[str, Any]]:
    """Make the map of a case and measure it.

    Parameters
    ----------
    case : GenerateCase
    part : Part
    calibration : Calibration
        Of the (first) family: graded size follows its walls.
    density : DensityGrid or float
    distance : callable
        Signed distance of the part.

    Returns
    -------
    cell_map : CellMap
    report : dict
        Local size and shear, folds, and how well wanted sizes are met; plain data.

    Raises
    ------
    CaseError
        If the map is impossible, or the cell has no wall of one thickness to grade.
    LatticeError
        If the map folds in the part, or the part reaches where it cannot be used.
    """
    spec = case.lattice
    points = part.surface.vertices
    lower, upper = points.min(axis=0), points.max(axis=0)
    wanted: Field | None = None
    if spec.grading == "thickness" and not calibration.family.distance:
        with locating(case, "lattice.grading"):
            raise CaseError(
                f'grading = "thickness" needs walls of one thickness in each cell, which '
                f"'{calibration.family.name}' does not have; take a cell whose name ends in -wall "
                f'or a strut cell, or grading = "level"'
            )
    if spec.grading in ("size", "ratio") and isinstance(density, DensityGrid):
        with locating(case, "lattice.size"):
            wanted = _wanted_size(case, calibration, density)
            spacing = default_spacing(lower, upper, spec.cell_size)
            cell_map = graded_size_map(wanted, lower, upper, spacing=spacing)
    else:
        with locating(case, "lattice.cell_map"):
            cell_map = _placed(case, part, distance)
    if spec.warp:
        spheres = [
            MorphingSphere(
                centre=np.array(w.centre),
                stable_radius=w.stable_radius,
                outer_radius=w.outer_radius,
                magnification=w.magnification,
            )
            for w in spec.warp
        ]
        with locating(case, "lattice.warp"):
            cell_map = warp_map(cell_map, spheres)
    with locating(case, "lattice.size" if wanted is not None else "lattice.cell_map"):
        report = map_report(
            cell_map, volume_points(distance, lower, upper, REPORT_POINTS), wanted=wanted
        )
        require_unfolded(report)
    return cell_map, asdict(report)


def _wanted_size(case: GenerateCase, calibration: Calibration, density: DensityGrid) -> Field:
    """Size that the density asks for, mm."""
    spec, family, parameters = case.lattice, calibration.family, calibration.parameters

    def rho(points: FloatArray) -> FloatArray:
        return evaluate(density, points)

    if spec.wall is not None:
        return size_field_for_wall(rho, family, parameters, spec.wall, spec.size)
    ends = (float(density.values.min()), float(density.values.max()))
    return size_field_by_ratio(rho, family, parameters, spec.size, ends)


def _placed(case: GenerateCase, part: Part, distance: Field) -> CellMap:
    """A map of cells of one size: straight, about an axis or centre, or in layers."""
    spec, size = case.lattice, case.lattice.cell_size
    if spec.cell_map is None:
        rotation = Rotation.from_euler("XYZ", spec.rotation, degrees=True).as_matrix()
        return uniform_map(size, spec.origin, rotation if any(spec.rotation) else None)
    told = spec.cell_map
    if told.kind == "conformal":
        return conformal_map(
            _depth(told, part, distance),
            size,
            normal=direction_vector(told.normal),
            origin=spec.origin,
        )
    around, inner = told.around, told.inner_radius
    if around is None or inner is None:
        raise CaseError(f"a {told.kind} map needs around and inner_radius")
    if told.kind == "cylindrical":
        return cylindrical_map(
            around=around,
            radial_size=size,
            axial_size=size,
            inner_radius=inner,
            origin=told.centre,
            axis=direction_vector(told.axis),
        )
    return spherical_map(
        around=around,
        pole_to_pole=around // 2,
        radial_size=size,
        inner_radius=inner,
        polar_cap=told.polar_cap,
        origin=told.centre,
        axis=direction_vector(told.axis),
    )


def _depth(told: CellMapSpec, part: Part, distance: Field) -> Field:
    """Distance into the part from its surface, or from one region of it."""
    if told.surface is not None:
        return region_distance(part.regions[told.surface].corners)
    return lambda points: -distance(points)
