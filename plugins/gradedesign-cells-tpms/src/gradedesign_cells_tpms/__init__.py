"""Gyroid, diamond and primitive cells for gradedesign, with their scaling laws."""

from __future__ import annotations

from collections.abc import Iterator

from gradedesign import CellFamily, ScalingLaw, hookimpl
from gradedesign_cells_tpms import diamond, gyroid, primitive
from gradedesign_cells_tpms.laws import scaling_laws
from gradedesign_cells_tpms.properties import computed_laws


@hookimpl
def gradedesign_cell_families() -> Iterator[CellFamily]:
    """Register sheet, network and wall of every surface."""
    for surface in (diamond, gyroid, primitive):
        yield from surface.FAMILIES


@hookimpl
def gradedesign_scaling_laws() -> Iterator[ScalingLaw]:
    """Register laws from the literature and from homogenisation."""
    yield from scaling_laws()
    yield from computed_laws()
