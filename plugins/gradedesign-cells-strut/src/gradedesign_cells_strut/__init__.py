"""Strut cells for gradedesign: eleven graphs, round and angular sections, waves and helices."""

from __future__ import annotations

from collections.abc import Iterator

from gradedesign import (
    CellFamily,
    CellMaker,
    ScalingLaw,
    hookimpl,
    shipped_laws,
)
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
from gradedesign_cells_strut.strut_family import strut_family

__all__ = [
    "gradedesign_cell_families",
    "gradedesign_cell_makers",
    "gradedesign_scaling_laws",
    "strut_family",
]


@hookimpl
def gradedesign_cell_families() -> Iterator[CellFamily]:
    """Register the cells of every graph."""
    for graph in (
        bcc, bccz, cuboctahedron, diamond, f2bcc, fcc, fccz, kelvin, octet,
        rhombic_dodecahedron, sc, sc_bcc,
    ):  # fmt: skip
        yield from graph.FAMILIES


@hookimpl
def gradedesign_cell_makers() -> Iterator[CellMaker]:
    """Register the maker of strut cells from the graph that a case describes."""
    yield CellMaker(
        name="strut-graph",
        make=strut_family,
        options={
            "nodes": "[[x, y, z], ...] in cell units; a whole number of cells apart is the same",
            "edges": "[[i, j], ...]: struts between nodes, counted from 0",
            "section": "round, square or triangle",
            "path": "straight, wave or helix",
            "source": "where the graph comes from",
        },
        required=("nodes", "edges"),
        source="strut_family of gradedesign-cells-strut",
    )


@hookimpl
def gradedesign_scaling_laws() -> Iterator[ScalingLaw]:
    """Register the laws computed for these cells."""
    yield from shipped_laws(f"{__name__}.properties")
