"""A divided solid on one set of supports, ready to be solved."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.finite_cell.elements import Elements
from gradedesign.mechanics.finite_cell.operator import Operator
from gradedesign.mechanics.finite_cell.space import BrickSpace
from gradedesign.mechanics.finite_cell.surface import SurfacePoints


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeldSystem:
    """Set-up that load cases with equal supports, and modes, share.

    Attributes
    ----------
    places : mapping of name to SurfacePoints
    keep : (N, 3) float32 array
        1 for unknowns, 0 for what is held or hangs.
    precondition : callable
        Sets its second argument to the correction for a residual.
    """

    elements: Elements
    space: BrickSpace
    places: Mapping[str, SurfacePoints]
    stiffness: Operator
    keep: NDArray[np.float32]
    precondition: Callable[[FloatArray, FloatArray], None]
