"""The record of an exporter: one file format of the printed lattice."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from gradedesign.arrays import Field
from gradedesign.geometry.cell.strut_axes import StrutAxes
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
        name, that are written. Where no format needs a surface and one samples, `generate` makes
        none, measures the samples, and hands them to ``write`` as ``lattice.sampled``.
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
