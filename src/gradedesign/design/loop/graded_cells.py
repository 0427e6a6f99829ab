"""The cells that a density field makes where their size follows it."""

from __future__ import annotations

from dataclasses import replace

from gradedesign.arrays import FloatArray
from gradedesign.common.values.locate import locating
from gradedesign.design.loop.iteration_steps import density_grid
from gradedesign.design.resolve.cell_choice import cell_axes
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.geometry.lattice.graded_map import wanted_size
from gradedesign.geometry.lattice.placed_layout import graded_layout
from gradedesign.mechanics.sizing.homogenised_model import bond_matrix


def with_cells(model: DesignModel, rho: FloatArray) -> DesignModel:
    """The model with the cells of a design; as it is where their size is not graded.

    The homogenised part takes the axes of these cells: phase fields turn cells in order to keep
    their shape. What they shear is left to the correction.

    Parameters
    ----------
    rho : (M,) array
        Density of every tetrahedron.

    Raises
    ------
    LatticeError
        If the map folds.
    """
    case, cells, homogenised = model.plan.case, model.cells, model.homogenised
    if not case.lattice.graded_size:
        return model
    with locating(case.where, "lattice.size"):
        wanted = wanted_size(case.lattice, cells.cell, density_grid(model, rho), cells.bounds)
    layout = graded_layout(
        case.lattice, case.where, model.plan.part, cells.layout.points, wanted, cells.frames
    )
    # One scale for filters and reports, whatever the design.
    layout = replace(layout, typical=cells.layout.typical)
    rotation = bond_matrix(cell_axes(layout, homogenised.space))
    return replace(
        model,
        cells=replace(cells, layout=layout),
        homogenised=replace(homogenised, rotation=rotation),
    )
