"""The cells that a density field makes where their size follows it."""

from __future__ import annotations

from dataclasses import replace

from gradedesign.arrays import FloatArray
from gradedesign.case.locate import locating
from gradedesign.layout.cell_layout import cell_layout
from gradedesign.layout.graded_map import graded_map, wanted_size
from gradedesign.loop.round import density_grid
from gradedesign.resolve.setup import Setup, cell_axes
from gradedesign.sizing.homogenised_model import bond_matrix


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
    case = setup.case
    if not case.lattice.graded_size:
        return setup
    with locating(case, "lattice.size"):
        wanted = wanted_size(case, setup.cell, density_grid(setup, rho), setup.bounds)
        cell_map = graded_map(case, setup.part, wanted, setup.frames)
        layout = cell_layout(cell_map, setup.layout.places, case.lattice.edges, wanted=wanted)
    axes = cell_axes(layout, setup.space)
    return replace(
        setup,
        # One scale for filters and reports, whatever the design.
        layout=replace(layout, typical=setup.layout.typical),
        model=replace(setup.model, rotation=bond_matrix(axes)),
    )
