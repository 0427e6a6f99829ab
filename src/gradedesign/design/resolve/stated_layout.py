"""The cells of a stated lattice: their map from mm to cell coordinates, and their sizes."""

from __future__ import annotations

from dataclasses import replace

from gradedesign.arrays import Field
from gradedesign.common.values.locate import locating
from gradedesign.design.case.schema import Case
from gradedesign.design.resolve.oriented import alignment, constant_size, oriented_frames
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.stated_directions import stated_directions
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.lattice.cell_layout import CellLayout
from gradedesign.geometry.lattice.density_grid import DensityGrid
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.graded_map import require_one_thickness, wanted_size
from gradedesign.geometry.lattice.placed_layout import (
    graded_layout,
    lattice_points,
    placed_layout,
)
from gradedesign.geometry.part.part import Part


def stated_layout(
    case: Case,
    registry: Registry,
    part: Part,
    cell: Cell,
    density: DensityGrid | float,
    domain: DesignDomain,
) -> CellLayout:
    """Place the cells of a case whose density is stated, and measure them.

    Parameters
    ----------
    cell : Cell
        Of the (first) family: graded size follows its walls.

    Raises
    ------
    CaseError
        If the map is impossible, no lattice is left, or the cell has no wall of one thickness to
        grade.
    LatticeError
        If the map folds in the part, or the part reaches where it cannot be used.
    """
    spec, where, memory = case.lattice, case.where, case.run.memory
    require_one_thickness(spec, where, cell.family)
    tensor_of = stated_directions(spec.orientation, domain.distance, memory, registry, where)
    frames = None if tensor_of is None else oriented_frames(spec, part, tensor_of, where)
    wanted: Field | None = None
    if spec.graded_size and isinstance(density, DensityGrid):
        with locating(where, "lattice.size"):
            ends = (float(density.values.min()), float(density.values.max()))
            wanted = wanted_size(spec, cell, density, ends)
    elif frames is not None:
        wanted = constant_size(spec.edges[0])
    if wanted is None:
        return placed_layout(spec, where, part, domain)
    points = lattice_points(where, domain)
    layout = graded_layout(spec, where, part, points, wanted, frames)
    if tensor_of is None:
        return layout
    turned = alignment(spec.rotation, layout, tensor_of)
    return replace(layout, report={**layout.report, "orientation": turned})
