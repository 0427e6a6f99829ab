"""Void in place of cells: what a part is filled with where lattice is no phase of it."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.geometry.cell.family import CellFamily


def _bars(u: FloatArray) -> FloatArray:
    """Distance to the nearest of three bars along the axes through a corner, in cells."""
    square = (u - np.round(u)) ** 2
    return np.asarray(np.sqrt(square.sum(axis=0) - square.max(axis=0)))


#: Bars that stand for solid members in what is planned before any design, in cells as large as
#: these are thick: none of them is built.
VOID = CellFamily(name="void", shape=_bars, source="not built", distance=True, wall=1.0)
