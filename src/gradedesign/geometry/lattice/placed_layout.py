"""Cells of a case placed where its part is lattice: of one size, or of one that differs."""

from __future__ import annotations

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.values.locate import Where, locating
from gradedesign.geometry.lattice.cell_layout import CellLayout, cell_layout
from gradedesign.geometry.lattice.domain import LATTICE, DesignDomain, phase_at
from gradedesign.geometry.lattice.graded_map import graded_map
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.geometry.lattice.part_room import require_lattice_left, require_warps_reach
from gradedesign.geometry.lattice.placed_map import REPORT_POINTS, map_key, placed_map
from gradedesign.geometry.maps.map_report import volume_points
from gradedesign.geometry.part.part import Part


def placed_layout(
    lattice: LatticeSpec, where: Where, part: Part, domain: DesignDomain
) -> CellLayout:
    """The map of a table ``[lattice]`` with the cells that it makes, not graded in size.

    Raises CaseError or LatticeError if skin and solid regions leave no lattice, or the map is
    impossible, folds in the lattice, or cannot be used there.
    """
    cell_map = placed_map(lattice, where, part, domain.distance)
    points = lattice_points(where, domain)
    require_warps_reach(lattice, where, points)
    with locating(where, map_key(where)):
        return cell_layout(cell_map, points, lattice.edges)


def graded_layout(
    lattice: LatticeSpec,
    where: Where,
    part: Part,
    points: FloatArray,
    wanted: Field,
    frames: Field | None,
) -> CellLayout:
    """Phase fields of cells of the wanted size, see `graded_map`, with the cells that they make.

    Raises CaseError, DensityError, LatticeError or ResourceError if the map is impossible, or folds
    in the lattice.

    ``points``, (3, n) array, mm: that fill the lattice evenly.
    """
    with locating(where, "lattice.size" if lattice.graded_size else "lattice.orientation"):
        cell_map = graded_map(lattice, where, part, wanted, frames)
        return cell_layout(cell_map, points, lattice.edges, wanted=wanted)


def lattice_points(where: Where, domain: DesignDomain) -> FloatArray:
    """Points that fill the part evenly where it is lattice, not skin or passive, ``(3, n)``, mm.

    Raises CaseError if no place is left.
    """
    points = volume_points(domain.distance, domain.lower, domain.upper, REPORT_POINTS)
    points = points[:, phase_at(domain, points) == LATTICE]
    require_lattice_left(where, points, domain)
    return points
