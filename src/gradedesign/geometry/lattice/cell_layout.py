"""Placement of the cells of a run in its part, with their sizes and stretches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from gradedesign.arrays import Field, FloatArray, lock
from gradedesign.geometry.maps.cell_map import CellMap
from gradedesign.geometry.maps.local_cells import local_cells
from gradedesign.geometry.maps.map_report import map_report, require_unfolded, spread

#: A law describes cells whose extents are as stated; from here on a warning states their stretch.
#: Chosen, not measured.
_TOLD_STRETCH = 1.1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellLayout:
    """A cell map and the cells that it makes in one part."""

    cell_map: CellMap
    points: FloatArray  #: ``(3, n)``, mm. That fill the lattice evenly.
    typical: float  #: mm. Edge of the cube of the median cell's volume.
    least: float  #: mm. Shortest extent of any cell.
    report: Mapping[str, Any]  #: Size, shear, stretch and folds; plain data.

    def __post_init__(self) -> None:
        lock(self, points=(3, None))


def cell_layout(
    cell_map: CellMap,
    points: FloatArray,
    edges: Sequence[float],
    *,
    wanted: Field | None = None,
) -> CellLayout:
    """Measure the cells of a map in a part.

    Raises LatticeError if the map folds in the lattice, or cannot be used there, or there are no
    points.

    ``points (3, n)``, mm: that fill the lattice evenly. ``edges (3,)``, mm: of the cell that the
    law describes. ``wanted``, mm: nominal size.
    """
    report = map_report(cell_map, points, wanted=wanted)
    require_unfolded(report)
    here = local_cells(cell_map, points, edges)
    stretch = spread(here.stretch, np.ones(here.stretch.size))
    uniform = cell_map.name == "uniform"
    return CellLayout(
        cell_map=cell_map,
        points=points,
        typical=cell_map.size if uniform else float(np.median(here.size)),
        least=min(edges) if uniform else float(here.least.min()),
        report={**asdict(report), "stretch": asdict(stretch)},
    )


def layout_warnings(layout: CellLayout, law: str) -> tuple[str, ...]:
    """Warnings on effects of this map that the homogenised analysis leaves out."""
    stretch = layout.report["stretch"]["p95"]
    if stretch <= _TOLD_STRETCH:
        return ()
    return (
        f"the {layout.cell_map.name} cell map stretches cells by up to {stretch:.2f} (longest over "
        f"shortest extent, 95 % of the volume), law '{law}' describes cells that are not "
        f"stretched; explicit analyses correct the mean of the difference",
    )
