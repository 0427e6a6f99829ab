"""The cells that a density field makes where their size follows it."""

from __future__ import annotations

from dataclasses import replace

from gradedesign.arrays import FloatArray
from gradedesign.common.values.locate import locating
from gradedesign.design.loop.iteration_steps import density_grid
from gradedesign.design.resolve.cell_choice import CellChoice, cell_axes
from gradedesign.design.resolve.problem import Problem
from gradedesign.design.resolve.setup import Setup
from gradedesign.geometry.lattice.cell_layout import cell_layout
from gradedesign.geometry.lattice.graded_map import graded_map, wanted_size
from gradedesign.mechanics.sizing.homogenised_model import bond_matrix


def with_cells(setup: Setup, rho: FloatArray) -> Setup:
    """The setup with the cells of a design; as it is where their size is not graded.

    The homogenised part takes the axes of these cells: phase fields turn cells in order to keep
    their shape. What they shear is left to the correction.

    Parameters
    ----------
    setup : Setup
    rho : (M,) array
        Density of every tetrahedron.

    Raises
    ------
    LatticeError
        If the map folds.
    """
    cells = graded_cells(setup.problem, setup.cells, rho)
    if cells is setup.cells:
        return setup
    axes = cell_axes(cells.layout, setup.problem.space)
    return replace(setup, cells=cells, model=replace(setup.model, rotation=bond_matrix(axes)))


def graded_cells(problem: Problem, cells: CellChoice, rho: FloatArray) -> CellChoice:
    """Cells whose size follows the densities of a design; unchanged cells if not graded."""
    case = problem.case
    if not case.lattice.graded_size:
        return cells
    with locating(case.where, "lattice.size"):
        wanted = wanted_size(
            case.lattice, cells.cell, density_grid(problem, cells, rho), cells.bounds
        )
        cell_map = graded_map(case.lattice, case.where, problem.part, wanted, cells.frames)
        layout = cell_layout(cell_map, cells.layout.points, case.lattice.edges, wanted=wanted)
    # One scale for filters and reports, whatever the design.
    return replace(cells, layout=replace(layout, typical=cells.layout.typical))
