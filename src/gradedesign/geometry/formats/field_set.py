"""Fields of a run on one mesh, as files of elements hold them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray

from gradedesign.arrays import FloatArray
from gradedesign.common.values.shown_record import ShownRecord


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class FieldSet(ShownRecord):
    """Fields of a run on one mesh.

    Attributes
    ----------
    name : str
        ``solid``, ``density``, ``lattice``, or ``iteration`` with a number.
    points : (3, n) array, mm
    elements : (k, m) int array
        Nodes of tetrahedra of 4 or 10, or of hexahedra of 8 or 27, in VTK's order.
    point_data, element_data : mapping of str to array
        Values ``(..., n)`` and ``(..., m)`` by the name of the field with its unit.
    number : int or None
        Of the iteration.
    """

    name: str
    points: FloatArray
    elements: NDArray[Any]
    point_data: Mapping[str, FloatArray] = field(default_factory=dict)
    element_data: Mapping[str, FloatArray] = field(default_factory=dict)
    number: int | None = None
