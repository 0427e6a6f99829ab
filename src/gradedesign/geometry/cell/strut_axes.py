"""The axes of round struts, of which a cell's shape function is the distance."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gradedesign.arrays import FloatArray, lock


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StrutAxes:
    """Round struts of one cell; their radius is the level of the cell.

    Attributes
    ----------
    segments : (k, 2, 3) array, cell units
        Both ends of every strut; copies a whole number of cells apart belong to them.
    balls : (b, 3) array, cell units
        Nodes with balls, one of each set of copies.
    ball_ratio : float
        Radius of a ball by that of a strut.
    """

    segments: FloatArray
    balls: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    ball_ratio: float = 1.0

    def __post_init__(self) -> None:
        lock(self, segments=(None, 2, 3), balls=(None, 3))
