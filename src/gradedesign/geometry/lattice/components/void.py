"""Void: no cells are built."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.geometry.lattice.component import CellComponent
from gradedesign.geometry.lattice.component_kind import ComponentKind, ComponentPlace, Made


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Void(CellComponent):
    """Void in place of all cells."""

    replaces: ClassVar[bool] = True

    def over(
        self,
        cells: FloatArray,
        points: FloatArray,  # noqa: ARG002
        to_part: FloatArray,  # noqa: ARG002
        cell: tuple[Field, float],
    ) -> FloatArray:
        """As far from any cell as it is large."""
        return np.full(cells.shape, cell[1])


def _make(place: ComponentPlace) -> Made:
    if place.lattice.cells:
        return (), ()
    return (Void(where="lattice.phases"),), ()


#: Void in place of cells, ``phases = ["solid", "void"]``.
KIND = ComponentKind(name="void", stage="cells", make=_make)
