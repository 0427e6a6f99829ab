"""The map from mm to cell coordinates of a stated lattice, and the sizes of its cells."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.values.locate import locating
from gradedesign.design.case.schema import Case
from gradedesign.design.resolve.oriented import (
    alignment,
    constant_size,
    oriented_frames,
)
from gradedesign.design.resolve.stated_directions import stated_directions
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.lattice.density_grid import DensityGrid
from gradedesign.geometry.lattice.graded_map import graded_map, require_one_thickness, wanted_size
from gradedesign.geometry.lattice.part_room import require_warps_reach
from gradedesign.geometry.lattice.placed_map import map_key, placed_map
from gradedesign.geometry.maps.cell_map import CellMap
from gradedesign.geometry.maps.map_report import map_report, require_unfolded
from gradedesign.geometry.part.part import Part


def stated_map(
    case: Case,
    part: Part,
    cell: Cell,
    density: DensityGrid | float,
    distance: Field,
    points: FloatArray,
) -> tuple[CellMap, dict[str, Any]]:
    """Make the map of a case and measure it.

    Parameters
    ----------
    cell : Cell
        Of the (first) family: graded size follows its walls.
    distance : callable
        Signed distance of the part.
    points : (3, n) array, mm
        Points of the lattice.

    Returns
    -------
    report : dict
        Local size and shear, folds, and how well wanted sizes are met; plain data.

    Raises
    ------
    CaseError
        If the map is impossible, or the cell has no wall of one thickness to grade.
    LatticeError
        If the map folds in the part, or the part reaches where it cannot be used.
    """
    require_one_thickness(case.lattice, case.where, cell.family)
    wanted: Field | None = None
    spec = case.lattice
    tensor_of = stated_directions(spec.orientation, distance, case.run.memory, case.where)
    frames = None if tensor_of is None else oriented_frames(spec, part, tensor_of, case.where)
    if case.lattice.graded_size and isinstance(density, DensityGrid):
        with locating(case.where, "lattice.size"):
            ends = (float(density.values.min()), float(density.values.max()))
            wanted = wanted_size(case.lattice, cell, density, ends)
            cell_map = graded_map(case.lattice, case.where, part, wanted, frames)
    elif frames is not None:
        wanted = constant_size(case.lattice.edges[0])
        cell_map = graded_map(case.lattice, case.where, part, wanted, frames)
    else:
        require_warps_reach(case.lattice, case.where, points)
        cell_map = placed_map(case.lattice, case.where, part, distance)
    key = "lattice.size" if case.lattice.graded_size else map_key(case.where)
    with locating(case.where, "lattice.orientation" if frames is not None else key):
        report = map_report(cell_map, points, wanted=wanted)
        require_unfolded(report)
    data = asdict(report)
    if tensor_of is not None:
        data["orientation"] = alignment(case.lattice.rotation, cell_map, tensor_of, points)
    return cell_map, data
