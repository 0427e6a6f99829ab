"""Mix of two cells in one proportion, as a cell of its own, of which a transition consists."""

from __future__ import annotations

from functools import lru_cache
from math import lcm

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.transition import CellTransition


@lru_cache(maxsize=64)
def mixed_cell(transition: CellTransition, share: float) -> Cell:
    """Periodic cell that a transition has where the second cell's share is the same everywhere.

    Parameters
    ----------
    transition : CellTransition
    share : float
        Of the second cell, between 0 and 1.

    Returns
    -------
    Cell
        Of no declared symmetry, its level the density itself. Two sheets that tell their sides
        mix to a sheet.

    Raises
    ------
    DensityError
        If the mix is one connected piece with an open void at no density.
    """
    first, second = transition.first.family, transition.second.family
    sheet = transition.sheets

    def shape(u: FloatArray) -> FloatArray:
        weight = np.full((1, *u.shape[1:]), share, dtype=u.dtype)
        return transition.shape(np.concatenate([u, weight]))

    return calibrate(
        CellFamily(
            name=f"{first.name}-to-{second.name}-{round(100 * share)}",
            shape=shape,
            source=f"transition, {share:.0%} of {second.name}",
            symmetry="none",
            sides=2 if sheet else 1,
            period=lcm(first.period, second.period),
            open_void=first.open_void and second.open_void,
        )
    )
