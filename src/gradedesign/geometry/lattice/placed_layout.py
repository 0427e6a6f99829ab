"""Cells of a case placed where its part is lattice."""

from __future__ import annotations

from gradedesign.common.values.locate import Where, locating
from gradedesign.geometry.lattice.cell_layout import CellLayout, cell_layout
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.geometry.lattice.part_room import require_lattice_left, require_warps_reach
from gradedesign.geometry.lattice.placed_map import lattice_points, map_key, placed_map
from gradedesign.geometry.part.part import Part


def placed_layout(
    lattice: LatticeSpec, where: Where, part: Part, domain: DesignDomain
) -> CellLayout:
    """The map of a table ``[lattice]`` with the cells that it makes.

    Raises
    ------
    CaseError, LatticeError
        If skin and solid regions leave no lattice, or the map is impossible, folds in the lattice,
        or cannot be used there.
    """
    cell_map = placed_map(lattice, where, part, domain.distance)
    points = lattice_points(domain)
    require_lattice_left(where, points, domain)
    require_warps_reach(lattice, where, points)
    with locating(where, map_key(where)):
        return cell_layout(cell_map, points, lattice.edges)
