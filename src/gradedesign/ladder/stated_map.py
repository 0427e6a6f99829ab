"""The map from mm to cell coordinates of a stated lattice, and what cells it makes."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from gradedesign.arrays import Field, FloatArray
from gradedesign.case.generate_schema import GenerateCase
from gradedesign.cell.calibration import Calibration
from gradedesign.cell.cell_map import CellMap
from gradedesign.cell.map_report import map_report, require_unfolded
from gradedesign.cell.phase_fields import default_spacing, graded_size_map
from gradedesign.cell.size_law import size_field_by_ratio, size_field_for_wall
from gradedesign.errors import CaseError
from gradedesign.ladder.locate import locating
from gradedesign.ladder.placed_map import placed_map
from gradedesign.lattice.density_grid import DensityGrid, evaluate
from gradedesign.part.part import Part


def stated_map(
    case: GenerateCase,
    part: Part,
    calibration: Calibration,
    density: DensityGrid | float,
    distance: Field,
    points: FloatArray,
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
    points : (3, n) array, mm
        Places of the lattice.

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
    wanted: Field | None = None
    if spec.grading == "thickness" and not calibration.family.distance:
        with locating(case, "lattice.grading"):
            raise CaseError(
                f'grading = "thickness" needs walls of one thickness in each cell, which '
                f"'{calibration.family.name}' does not have; take a cell whose name ends in -wall "
                f'or a strut cell, or grading = "level"'
            )
    if spec.grading in ("size", "ratio") and isinstance(density, DensityGrid):
        corners = part.surface.vertices
        lower, upper = corners.min(axis=0), corners.max(axis=0)
        with locating(case, "lattice.size"):
            wanted = _wanted_size(case, calibration, density)
            spacing = default_spacing(lower, upper, spec.cell_size)
            cell_map = graded_size_map(wanted, lower, upper, spacing=spacing)
    else:
        cell_map = placed_map(case, part, distance)
    with locating(case, "lattice.size" if wanted is not None else "lattice.cell_map"):
        report = map_report(cell_map, points, wanted=wanted)
        require_unfolded(report)
    return cell_map, asdict(report)


def _wanted_size(case: GenerateCase, calibration: Calibration, density: DensityGrid) -> Field:
    """Size that the density asks for, mm."""
    spec, family, parameters = case.lattice, calibration.family, calibration.parameters
    ends = (spec.size[0], spec.size[-1])

    def rho(points: FloatArray) -> FloatArray:
        return evaluate(density, points)

    if spec.wall is not None:
        return size_field_for_wall(rho, family, parameters, spec.wall, ends)
    window = (float(density.values.min()), float(density.values.max()))
    return size_field_by_ratio(rho, family, parameters, ends, window)
