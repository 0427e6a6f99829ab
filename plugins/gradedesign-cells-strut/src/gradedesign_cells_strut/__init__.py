"""Strut cells for gradedesign: eleven graphs, round and angular sections, waves and helices."""

from __future__ import annotations

from collections.abc import Iterator

from gradedesign import CellFamily, ScalingLaw, hookimpl
from gradedesign_cells_strut import (
    bcc,
    bccz,
    cuboctahedron,
    diamond,
    f2bcc,
    fcc,
    fccz,
    kelvin,
    octet,
    rhombic_dodecahedron,
    sc,
    sc_bcc,
)
from gradedesign_cells_strut.properties import computed_laws
from gradedesign_cells_strut.strut_family import strut_family

__all__ = ["gradedesign_cell_families", "gradedesign_scaling_laws", "strut_family"]


@hookimpl
def gradedesign_cell_families() -> Iterator[CellFamily]:
    """Register the cells of every graph."""
    for graph in (
        bcc, bccz, cuboctahedron, diamond, f2bcc, fcc, fccz, kelvin, octet,
        rhombic_dodecahedron, sc, sc_bcc,
    ):  # fmt: skip
        yield from graph.FAMILIES


@hookimpl
def gradedesign_scaling_laws() -> Iterator[ScalingLaw]:
    """Register the laws computed for these cells."""
    yield from computed_laws()
