"""A value of the displacement of a region, whose own error an analysis estimates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from gradedesign.arrays import FloatArray

#: ``(u (3, k) mm, area (k,) mm^2) -> (3, k)``: derivative of a value by the displacements at k
#: points of a region, each of which stands for an area.
_ByDisplacement: TypeAlias = Callable[[FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DisplacementGoal:
    """A value of the displacement of a region in one load case."""

    region: str
    load_case: str
    #: Derivative of the value by the displacements at points of the region.
    by_displacement: _ByDisplacement
