"""The record of an exporter: one file format of the printed lattice."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from gradedesign.output.printed_lattice import PrintedLattice


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
        Whether it reads ``lattice.surface``; where no format does, `generate` makes none.
    contoured : bool
        Whether it writes contours of the layers, which hold thin struts better than their pixels.
    """

    name: str
    suffix: str
    write: Callable[[Path, PrintedLattice], None]
    needs_surface: bool = True
    contoured: bool = False
