"""Displacement: the largest nodal displacement of a region must stay below a limit.

The largest displacement may change places from one design to the next: of a pin in two ears now one
ear moves most, now the other. Its gradient at the present place alone makes sizing stiffen one at
the cost of the other, for ever. Places that governed before stay responses of their own, so that
all of them are held at once.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gradedesign.arrays import FloatArray, IntArray, locked
from gradedesign.common.values.locate import Where
from gradedesign.errors import CaseError
from gradedesign.geometry.part.regions import Region
from gradedesign.mechanics.fe.displacement_goal import DisplacementGoal
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.limits.analysis import Analysis
from gradedesign.mechanics.limits.held_region import judged_cases, refuse_held_surfaces
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.limit import Limit, LimitKind, PlacedModel, StatedLimit
from gradedesign.mechanics.limits.limits_schema import DisplacementLimit as DisplacementEntry
from gradedesign.mechanics.limits.limits_schema import (
    LimitsSpec,
    as_multiple,
    in_number,
    stated_words,
)
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.state import HomogenisedState, Predicted, Response
from gradedesign.mechanics.material.material import Material

#: Nodes nearer than this share of the region's extent count as one place. Chosen, not measured.
APART = 0.2
#: A place that moves less than this share of the largest displacement governs no more. With it and
#: `MOST_PLACES` sizing of `clevis`, whose two ears take turns, holds after 8 to 14 iterations; with
#: the present node alone not after 60.
RELEVANT = 0.5
#: Places of a limit that are followed. Chosen, not measured.
MOST_PLACES = 4
#: A region that moves by less than this share of the part's largest displacement is at rest.
#: Chosen, not measured.
AT_REST = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DisplacementLimit(Limit):
    """The largest nodal displacement of a region in one load case.

    Attributes
    ----------
    nodes : (k,) int array
        Nodes of the region on the tetrahedra of the part.
    component : int or None
        0, 1, 2 limits the absolute value of one component, None the magnitude.
    """

    nodes: IntArray
    component: int | None

    unit: ClassVar[str] = "mm"
    converges: ClassVar[bool] = True
    by_gradient: ClassVar[bool] = True

    def __post_init__(self) -> None:
        nodes = locked(self.nodes, (None,), dtype=np.int64, name="nodes")
        object.__setattr__(self, "nodes", nodes)
        if len(nodes) == 0:
            raise CaseError(
                f"{self.name} has no nodes: its region is not on the mesh; refine [part] mesh_size "
                f"or choose another region"
            )

    @property
    def measure(self) -> str:
        """The largest nodal value."""
        return "largest nodal value on the region"

    def predict(self, state: HomogenisedState) -> Predicted:
        """Largest displacement of the region, mm."""
        u = state.displacement(self.key.load_case)
        value, _ = largest_displacement(u, self.nodes, self.component)
        return Predicted(value=self.factor * value, load_case=self.key.load_case)

    def responses(
        self, state: HomogenisedState, memory: tuple[int, ...] = ()
    ) -> tuple[tuple[Response, ...], tuple[int, ...]]:
        """Displacements of the places that govern; ``memory`` holds their nodes."""
        u = state.displacement(self.key.load_case)
        places = governing_places(u, self.nodes, self.component, state.nodes, memory)
        return tuple(self._response(u, node) for node in places), places

    def _response(self, u: FloatArray, node: int) -> Response:
        value, _ = largest_displacement(u, np.array([node]), self.component)
        unit = np.zeros_like(u)
        if self.component is None:
            unit[:, node] = u[:, node] / value if value > 0 else 0.0
        else:
            unit[self.component, node] = 1.0 if u[self.component, node] >= 0 else -1.0
        return Response(
            name=self.name,
            load_case=self.key.load_case,
            value=self.factor * value,
            by_displacement=self.factor * unit,
        )

    def goal(self) -> DisplacementGoal:
        """The displacement of the place that moves most."""

        def by_displacement(u: FloatArray, _area: FloatArray) -> FloatArray:
            value, point = largest_displacement(u, np.arange(u.shape[1]), self.component)
            slope = np.zeros_like(u)
            if self.component is not None:
                slope[self.component, point] = math.copysign(1.0, u[self.component, point])
            elif value > 0.0:
                slope[:, point] = u[:, point] / value
            return slope

        return DisplacementGoal(
            region=self.key.region, load_case=self.key.load_case, by_displacement=by_displacement
        )

    def rows(self, analysis: Analysis, judged_by: str) -> tuple[LimitRow, ...]:
        """Largest nodal value on the region, mm."""
        u = analysis.region_displacement(self.key.region, self.key.load_case)
        value, _ = largest_displacement(u, np.arange(u.shape[1]), self.component)
        return (self.row(value, judged_by),)

    def rest(self, analysis: Analysis) -> float:
        """A share of the part's largest displacement."""
        return AT_REST * analysis.largest_displacement(self.key.load_case)


def largest_displacement(
    displacement: FloatArray, nodes: IntArray, component: int | None
) -> tuple[float, int]:
    """Largest magnitude (or absolute component) over nodes, mm, and the node that has it."""
    u = displacement[:, nodes]
    values = np.linalg.norm(u, axis=0) if component is None else np.abs(u[component])
    k = int(np.argmax(values))
    return float(values[k]), int(nodes[k])


def governing_places(
    displacement: FloatArray,
    nodes: IntArray,
    component: int | None,
    points: FloatArray,
    before: Sequence[int],
) -> tuple[int, ...]:
    """Nodes that govern a region or governed it before, the present one first.

    Parameters
    ----------
    displacement : (3, N) array, mm
    nodes : (k,) int array
        Of the region.
    component : int or None
    points : (3, N) array, mm
    before : sequence of int
        Nodes that governed earlier designs; those that move little now are dropped.
    """
    largest, node = largest_displacement(displacement, nodes, component)
    extent = float(np.linalg.norm(np.ptp(points[:, nodes], axis=1)))
    places = [node]
    for nearer in before:
        away = np.linalg.norm(points[:, places] - points[:, [nearer]], axis=0)
        value, _ = largest_displacement(displacement, np.array([nearer]), component)
        if away.min() > APART * extent and value >= RELEVANT * largest:
            places.append(nearer)
    return tuple(places[:MOST_PLACES])


def _make(limits: LimitsSpec, placed: PlacedModel) -> tuple[Sequence[Limit], Sequence[str]]:
    """One limit per region, direction and load case it holds for, see `judged_cases`."""
    made: list[Limit] = []
    warnings: list[str] = []
    for number, entry in enumerate(limits.displacement):
        names, remarks = judged_cases(placed, entry, f"displacement[{number}]", _name(entry))
        warnings += remarks
        made += [
            DisplacementLimit(
                key=LimitKey(
                    kind=KIND.name,
                    region=entry.region,
                    component=_direction(entry),
                    load_case=name,
                ),
                name=_name(entry),
                allowed=in_number(entry.magnitude),
                times_solid=as_multiple(entry.magnitude),
                case_key=f"limits.displacement[{number}].magnitude",
                nodes=placed.nodes[entry.region],
                component=entry.component,
            )
            for name in names
        ]
    return made, warnings


def _stated(
    limits: LimitsSpec, load_cases: Sequence[LoadCaseSpec], _material: Material
) -> Sequence[StatedLimit]:
    return [
        StatedLimit(
            name=_name(entry),
            load_case=load.name,
            allowed=stated_words(entry.magnitude, DisplacementLimit.unit),
            region=entry.region,
            by_gradient=True,
        )
        for entry in limits.displacement
        for load in load_cases
        if entry.load_case in (None, load.name)
    ]


def _require(
    limits: LimitsSpec,
    load_cases: Sequence[LoadCaseSpec],
    regions: Mapping[str, Region],
    where: Where,
) -> None:
    refuse_held_surfaces(load_cases, limits.displacement, "displacement", regions, where)


def _direction(entry: DisplacementEntry) -> str:
    return "magnitude" if entry.component is None else "xyz"[entry.component]


def _name(entry: DisplacementEntry) -> str:
    return f"displacement of {entry.region} {_direction(entry)}"


#: Displacement of a region, ``displacement = [{region = "tip", magnitude = "2 mm"}]``.
KIND = LimitKind(name="displacement", make=_make, stated=_stated, require=_require)
