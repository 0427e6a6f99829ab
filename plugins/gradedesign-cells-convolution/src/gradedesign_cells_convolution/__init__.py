"""Strut cells with smooth joints for gradedesign: convolution surfaces of eleven graphs."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

from gradedesign import CellFamily, CellMaker, ScalingLaw, hookimpl, shipped_laws
from gradedesign_cells_convolution.convolution_family import convolution_family
from gradedesign_cells_convolution.graphs import graphs

__all__ = ["convolution_family", "gradedesign_cell_families", "gradedesign_cell_makers"]


@cache
def _families() -> tuple[CellFamily, ...]:
    """One cell for each graph, the same records at every call."""
    return tuple(
        convolution_family(
            f"{graph.name}-convolution", graph.nodes, graph.edges, source=f"{graph.name} struts"
        )
        for graph in graphs()
    )


@hookimpl
def gradedesign_cell_families() -> Iterator[CellFamily]:
    """Register the convolution of every graph."""
    yield from _families()


@hookimpl
def gradedesign_cell_makers() -> Iterator[CellMaker]:
    """Register the maker of convolution cells from the graph that a case describes."""
    yield CellMaker(
        name="convolution-graph",
        make=convolution_family,
        options={
            "nodes": "[[x, y, z], ...] in cell units; a whole number of cells apart is the same",
            "edges": "[[i, j], ...]: struts between nodes, counted from 0",
            "sigma": "width of the kernel in cell units",
            "source": "where the graph comes from",
        },
        required=("nodes", "edges"),
        source="convolution_family of gradedesign-cells-convolution",
    )


@hookimpl
def gradedesign_scaling_laws() -> Iterator[ScalingLaw]:
    """Register the laws computed for these cells."""
    yield from shipped_laws(f"{__name__}.properties")
