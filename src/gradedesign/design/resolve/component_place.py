"""The tables and the part from which components of a lattice are made."""

from __future__ import annotations

from collections.abc import Sequence

from gradedesign.arrays import Field
from gradedesign.common.values.locate import locating
from gradedesign.design.case.schema import Case
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.lattice.component_kind import ComponentPlace
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.signed_distance import surface_distance


def component_place(
    case: Case,
    part: Part,
    cells: Sequence[Cell] = (),
    *,
    stress: Field | None = None,
) -> ComponentPlace:
    """The tables of a case and its part, as yet without components.

    ``cells``: that will fill it. ``stress``: of the solid part, 0 to 1, at points ``(3, ...)`` mm,
    once it is known.
    """
    points = part.surface.vertices
    with locating(case.where, "part"):
        distance = surface_distance(part.surface)
    min_wall = (case.print and case.print.min_wall) or 0.0
    loaded = frozenset(
        [fix.region for load_case in case.load_case for fix in load_case.fix]
        + [load.region for load_case in case.load_case for load in load_case.load]
    )
    return ComponentPlace(
        lattice=case.lattice,
        keep=case.keep,
        zone=case.zone,
        where=case.where,
        part=part,
        distance=distance,
        domain=DesignDomain(
            distance=distance,
            lower=points.min(axis=0),
            upper=points.max(axis=0),
            bodies=part.report.bodies,
            least_rim=min_wall,
        ),
        loaded=loaded,
        min_wall=min_wall,
        cells=tuple(cells),
        stress=stress,
    )
