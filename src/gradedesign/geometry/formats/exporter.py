"""The records of an exporter and of what it writes: printed lattice, fields on a mesh."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.values.shown_record import ShownRecord
from gradedesign.geometry.cell.family import StrutAxes
from gradedesign.geometry.formats.printed_lattice import PrintedLattice, SampledPrint
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.geometry.maps.cell_map import CellMap


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlannedPrint:
    """A printed lattice before it is made, as far as formats depend on it.

    Attributes
    ----------
    axes : StrutAxes or None
        Of the cell where it is made of struts, and of no other cell beside it.
    cell_map : CellMap or None
        None where it follows from the design: cells of graded size, or along directions.
    layer_height : float or None, mm
        As the case states it.
    """

    axes: StrutAxes | None
    cell_map: CellMap | None
    domain: DesignDomain
    layer_height: float | None


def _writes_every_print(_planned: PlannedPrint) -> str:
    """No lattice is refused."""
    return ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Exporter:
    """Writes the printed lattice in one file format.

    Attributes
    ----------
    name : str
        Lower case with dashes; what ``[output] formats`` names, such as ``stl``.
    suffix : str
        Lower-case file ending with its dot, such as ``.stl``.
    write : callable
        ``write(path, lattice)`` writes a `PrintedLattice` to one new file at ``path``. The file
        takes its place in the run folder when ``write`` returns.
    needs_surface : bool
        Whether it reads ``lattice.surface``.
    sample : callable or None
        ``sample(lattice, formats) -> SampledPrint`` samples the field once for the formats, by
        name, that are written. Where no format needs a surface and one samples, a run of a stated
        density makes none, measures the samples, and hands them on as ``lattice.sampled``.
    fields : callable or None
        Comes with ``sample``: ``fields(design, reach)`` gives the fields of a `LatticeDesign` and
        of the part alone, mm, exact within the reach in mm and right in sign everywhere.
    refuses : callable
        ``refuses(PlannedPrint) -> str``: why the format cannot hold a lattice, in a sentence; empty
        where it can. Asked before anything is made; ``write`` is to refuse by the same function.
    """

    name: str
    suffix: str
    write: Callable[[Path, PrintedLattice], None]
    needs_surface: bool = True
    sample: Callable[[PrintedLattice, Sequence[str]], SampledPrint] | None = None
    fields: Callable[[LatticeDesign, float], tuple[Field, Field]] | None = None
    refuses: Callable[[PlannedPrint], str] = _writes_every_print


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
