"""The lattice that sizing is expected to choose, estimated beforehand."""

from __future__ import annotations

from gradedesign.design.resolve.analysable import EXPECTED_SHARE
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.cells import single
from gradedesign.geometry.lattice.cell_layout import CellLayout
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import LatticeDesign


def expected_density(bounds: tuple[float, float]) -> float:
    """Relative density `EXPECTED_SHARE` of the window above its lower bound."""
    return bounds[0] + EXPECTED_SHARE * (bounds[1] - bounds[0])


def expected_design(
    domain: DesignDomain, cell: Cell, layout: CellLayout, bounds: tuple[float, float]
) -> LatticeDesign:
    """Lattice of the one density that is expected."""
    return LatticeDesign(
        domain=domain,
        cells=single(cell),
        cell_map=layout.cell_map,
        cell_size=layout.typical,
        density=expected_density(bounds),
    )
