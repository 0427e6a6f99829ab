"""The solid that finite cells analyse, given by a field, with its loads and supports."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from dataclasses import field as dataclass_field

import numpy as np

from gradedesign.arrays import Field, FloatArray, locked
from gradedesign.errors import CaseError
from gradedesign.geometry.part.regions import Region
from gradedesign.mechanics.fe.displacement_goal import DisplacementGoal
from gradedesign.mechanics.fe.load_case import LoadCaseSpecification
from gradedesign.mechanics.fe.modes import ModeGoal
from gradedesign.mechanics.finite_cell.grid import Plane
from gradedesign.mechanics.material.material import Material


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CutProblem:
    """A solid with its loads and supports."""

    field: Field  #: Points ``(3, ...)`` in mm to values ``(...)``, negative inside the solid.
    #: ``(3,)``, mm. Box of the part; the solid ends at its faces.
    lower: FloatArray
    upper: FloatArray
    cases: tuple[LoadCaseSpecification, ...]
    #: By name. Of the part's surface; every one named in a load case, and others to measure on.
    regions: Mapping[str, Region]
    material: Material
    #: Plane faces inside the box to lay grid planes on, such as those of passive solids; the plane
    #: regions are added.
    planes: tuple[Plane, ...] = ()
    bodies: int = 1  #: Connected components that belong to the solid.
    #: Points ``(3, m)`` to how much larger than the spacing elements may be there, ``(m,)``: 2
    #: where walls are twice as thick as the thinnest.
    grading: Field | None = None
    #: Values whose own error is estimated, see `CaseSolution.goals`; each costs the solution of its
    #: dual. Only on elements of one size.
    goals: Mapping[Hashable, DisplacementGoal] = dataclass_field(default_factory=dict)
    #: Natural frequencies and load factors to find, see `CaseSolution.modes`.
    modes: Mapping[Hashable, ModeGoal] = dataclass_field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "lower", locked(self.lower, (3,), name="lower"))
        object.__setattr__(self, "upper", locked(self.upper, (3,), name="upper"))


def require_regions(problem: CutProblem) -> None:
    """Refuse load cases that name a region that is not given."""
    if not problem.cases:
        raise CaseError("no load case is given; expected one or more")
    for case in problem.cases:
        for name in (*(f.region for f in case.fix), *(s.region for s in case.load)):
            if name not in problem.regions:
                raise CaseError(
                    f"load case '{case.name}' names region '{name}', but the regions are "
                    f"{', '.join(problem.regions)}"
                )
    for goal in problem.goals.values():
        if goal.region not in problem.regions:
            raise CaseError(
                f"a value of region '{goal.region}' is asked for, but the regions are "
                f"{', '.join(problem.regions)}"
            )


def region_planes(regions: Mapping[str, Region]) -> tuple[Plane, ...]:
    """Planes of the triangles of regions that lie across an axis, with their areas."""
    area: dict[tuple[int, float], float] = {}
    for region in regions.values():
        corners = region.corners
        size = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        for axis in range(3):
            flat = np.ptp(corners[:, :, axis], axis=1) < 1e-9 * size
            for k in np.flatnonzero(flat):
                key = axis, round(float(corners[k, 0, axis]), 9)
                area[key] = area.get(key, 0.0) + 0.5 * float(np.linalg.norm(across[k]))
    return tuple(Plane(axis=a, place=p, area=s) for (a, p), s in area.items())
