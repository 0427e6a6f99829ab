"""A single cell of a closed form, at any density."""

import numpy as np

from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.cells import single
from gradedesign.geometry.cell.family import CellFamily


def plain_cells(shape, *levels, **parameters):
    """The cell ``shape(u, **parameters) <= t``, t linear between levels at even densities; or 0."""
    levels = levels or (0.0, 0.0)
    return single(
        Cell(
            family=CellFamily(name="plain", shape=shape, parameters=parameters),
            parameters=parameters,
            density=np.linspace(0.0, 1.0, len(levels)),
            level=levels,
            window=(0.0, 1.0),
            neck=(0.0, 0.0, 0.0),
        )
    )
