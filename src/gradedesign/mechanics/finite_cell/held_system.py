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
    """Set-up that load cases with equal supports, and modes, share."""

    elements: Elements
    space: BrickSpace
    places: Mapping[str, SurfacePoints]  #: By name.
    stiffness: Operator
    keep: NDArray[np.float32]  #: ``(N, 3)`` float32. 1 for unknowns, 0 for what is held or hangs.
    #: Sets its second argument to the correction for a residual.
    precondition: Callable[[FloatArray, FloatArray], None]
