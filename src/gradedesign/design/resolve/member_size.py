"""Least thickness of solid members, and tetrahedra that follow it."""

from __future__ import annotations

from math import inf

from gradedesign.common.values.locate import Where
from gradedesign.design.printing.print_schema import PrintSpec
from gradedesign.errors import CaseError
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.geometry.part.part_schema import PartSpec

#: Least thickness of solid members over the edge of a cell: thinner ones are struts. Chosen, not
#: measured.
_OF_CELL = 0.25
#: Radius of the fillets between members and what is solid in any case over their least thickness,
#: where no cells are joined to them: the level set of members alone meets a plane at flat angles,
#: in teeth of its grid. Chosen, not measured.
_FILLET = 0.25
#: Edges of quadratic tetrahedra across a member, at least: with one of them the explicit
#: displacement of `bracket` was 37 % above the first prediction, with 1.5 of them 8 %.
ACROSS = 1.5
#: A thickness that is just enough may come out a rounding error less.
_ROUNDING = 1e-9


def with_member_size(
    lattice: LatticeSpec, part: PartSpec, printer: PrintSpec | None, where: Where
) -> LatticeSpec:
    """``[lattice]`` with the least thickness of its solid members, if it may have any.

    ``part`` states the mesh size.

    Raises CaseError if tetrahedra or the printer do not resolve a stated one.
    """
    if not lattice.members:
        return lattice
    mesh = ACROSS * part.element_size
    wall = (printer and printer.min_wall) or 0.0
    stated = lattice.least_member
    if stated is None:
        thickness = max(_OF_CELL * lattice.cell_size, mesh, wall)
        return lattice.model_copy(update={"least_member": thickness})
    if stated < mesh * (1 - _ROUNDING):
        raise CaseError(
            f"{where('lattice.least_member')}: found {stated:g} mm, which tetrahedra of "
            f"{part.element_size:g} mm do not resolve; expected {mesh:.3g} mm at least, or [part] "
            f"mesh_size of {stated / ACROSS:.3g} mm"
        )
    if stated < wall * (1 - _ROUNDING):
        raise CaseError(
            f"{where('lattice.least_member')}: found {stated:g} mm, less than the {wall:g} mm of "
            f"[print] min_wall that the printer makes; expected {wall:g} mm at least"
        )
    if lattice.cells or "joint_radius" in lattice.model_fields_set:
        return lattice
    return lattice.model_copy(update={"joint_radius": _FILLET * stated})


def edges_of_tets(lattice: LatticeSpec) -> tuple[float, float]:
    """Edges of the part's tetrahedra where none is stated, mm: at most, and in any case at most."""
    if not lattice.members:
        return lattice.cell_size, inf
    stated = lattice.least_member
    thickness = stated or _OF_CELL * lattice.cell_size
    return min(lattice.cell_size, thickness / ACROSS), stated / ACROSS if stated else inf
