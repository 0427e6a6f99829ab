"""Displacement: the largest nodal displacement of a region must stay below a limit.

The largest displacement may change places from one design to the next: of a pin in two ears now one
ear moves most, now the other. Its gradient at the present place alone makes sizing stiffen one at
the cost of the other, for ever. The region is divided into clusters of nodes, each of which is held
by a smooth measure of its own (as stresses are by Holmberg, Torstenfelt and Klarbring, Struct.
Multidisc. Optim. 48, 2013, 33-47): one measure of the whole region holds no two ears, and single
nodes no rim that moves evenly. Nodes of one kept solid that moves as a rigid body are one cluster:
what holds one of them holds the others.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
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
from gradedesign.mechanics.limits.clusters import moving_parts
from gradedesign.mechanics.limits.held_region import judged_cases, refuse_held_surfaces
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.largest import largest_and_slope
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

#: Exponent of the measure of a cluster: a node that moves 10 % less than the farthest has a fifth
#: of its weight. Sizing of a plate around a hole under pressure, whose rim moves evenly, settles at
#: 16.4 g after 16 iterations; with one measure of that exponent at 20.6 g after 30, with the four
#: nodes that moved most at 17.7 g after 62. `clevis`, whose two ears take turns: 244, 279, 252 g.
_NORM = 16.0
#: A cluster that moves less than this share of the largest displacement governs no more: two steps
#: of sizing change a displacement by less. Chosen, not measured.
_RELEVANT = 0.7
#: A region that moves by less than this share of the part's largest displacement is at rest.
#: Chosen, not measured.
_AT_REST = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DisplacementLimit(Limit):
    """The largest nodal displacement of a region in one load case."""

    nodes: IntArray  #: ``(k,)``. Nodes of the region on the tetrahedra of the part.
    #: 0, 1, 2 limits the absolute value of one component, None the magnitude.
    component: int | None
    #: mm. By which places lie apart that a design moves each for itself: `moving_parts`.
    apart: float = 0.0
    #: ``(k,)``. Number of the kept solid that each node belongs to, -1 where it belongs to none.
    #: None: there is no kept solid.
    solids: IntArray | None = None

    unit: ClassVar[str] = "mm"
    converges: ClassVar[bool] = True

    def __post_init__(self) -> None:
        nodes = locked(self.nodes, (None,), dtype=np.int64, name="nodes")
        object.__setattr__(self, "nodes", nodes)
        if self.solids is not None:
            solids = locked(self.solids, (len(nodes),), dtype=np.int64, name="solids")
            object.__setattr__(self, "solids", solids)
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
        """Displacement of the region, mm."""
        u = state.displacement(self.key.load_case)
        return Predicted(value=self._response(u, self.nodes).value, load_case=self.key.load_case)

    def responses(self, state: HomogenisedState) -> tuple[Response, ...]:
        """Largest displacement of every cluster of nodes that is near the largest of all."""
        u = state.displacement(self.key.load_case)
        points, moved = state.nodes[:, self.nodes], u[:, self.nodes]
        parts = moving_parts(points, moved, self.solids, self.apart)
        found = [self._cluster(u, self.nodes[mine]) for mine in parts]
        least = _RELEVANT * max(response.value for response in found)
        relevant = [response for response in found if response.value >= least]
        return tuple(sorted(relevant, key=lambda response: -response.value))

    def _cluster(self, u: FloatArray, nodes: IntArray) -> Response:
        """The largest displacement of some nodes, mm, see `largest_and_slope`."""
        chosen = slice(None) if self.component is None else [self.component]
        moved = u[chosen][:, nodes]
        sizes = np.linalg.norm(moved, axis=0)
        value, by_size = largest_and_slope(sizes, _NORM)
        directions = np.divide(moved, sizes, out=np.zeros_like(moved), where=sizes > 0.0)
        slope = np.zeros((3, nodes.size))
        slope[chosen] = self.factor * by_size * directions
        by_displacement = np.zeros_like(u)
        by_displacement[:, nodes] = slope
        return Response(
            name=self.name,
            load_case=self.key.load_case,
            value=self.factor * value,
            by_displacement=by_displacement,
        )

    def _response(self, u: FloatArray, nodes: IntArray) -> Response:
        """Value of nodes of the region, mm, with its derivative by displacements ``(3, N)``."""
        value, slope = self._value_and_slope(u[:, nodes], self._shares)
        by_displacement = np.zeros_like(u)
        by_displacement[:, nodes] = self.factor * slope
        return Response(
            name=self.name,
            load_case=self.key.load_case,
            value=self.factor * value,
            by_displacement=by_displacement,
        )

    @property
    def _shares(self) -> FloatArray:
        """Shares of the region's area that its nodes stand for; the largest needs none."""
        return np.zeros(0)

    def _value_and_slope(
        self,
        moved: FloatArray,
        shares: FloatArray,  # noqa: ARG002
    ) -> tuple[float, FloatArray]:
        """Value, mm, and its derivative ``(3, k)`` at places moved by ``(3, k)`` mm.

        ``shares (k,)`` are those of the region's area that the places stand for.
        """
        value, point = largest_displacement(moved, np.arange(moved.shape[1]), self.component)
        slope = np.zeros_like(moved)
        if self.component is not None:
            slope[self.component, point] = math.copysign(1.0, moved[self.component, point])
        elif value > 0.0:
            slope[:, point] = moved[:, point] / value
        return value, slope

    def goal(self) -> DisplacementGoal:
        """The value that is judged."""

        def by_displacement(u: FloatArray, area: FloatArray) -> FloatArray:
            return self._value_and_slope(u, area / area.sum())[1]

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
        return _AT_REST * analysis.largest_displacement(self.key.load_case)


def largest_displacement(
    displacement: FloatArray, nodes: IntArray, component: int | None
) -> tuple[float, int]:
    """Largest magnitude (or absolute component) over nodes, mm, and the node that has it."""
    u = displacement[:, nodes]
    values = np.linalg.norm(u, axis=0) if component is None else np.abs(u[component])
    k = int(np.argmax(values))
    return float(values[k]), int(nodes[k])


@dataclass(frozen=True, slots=True, kw_only=True)
class DisplacementKind:
    """How limits on the displacement of regions are made: one per region and load case."""

    name: str  #: Of the kind, and of its list in ``[limits]``.
    made: Callable[..., DisplacementLimit]  #: Type of its limits.
    shared: bool = False  #: Whether they take ``shares``.
    #: Layout of one table of its list; None: the core's.
    entry: type[DisplacementEntry] | None = None

    def kind(self) -> LimitKind:
        """As it is registered."""
        return LimitKind(
            name=self.name,
            make=self._make,
            stated=self._stated,
            entry=self.entry,
            require=self._require,
        )

    def _make(self, limits: LimitsSpec, placed: PlacedModel) -> tuple[list[Limit], list[str]]:
        """Limits for the load cases that `judged_cases` leaves, and its warnings."""
        made: list[Limit] = []
        warnings: list[str] = []
        for number, entry in enumerate(self._entries(limits)):
            place, name = f"{self.name}[{number}]", self._named(entry)
            cases, remarks = judged_cases(placed, entry, place, name)
            warnings += remarks
            shares = {"shares": placed.shares[entry.region]} if self.shared else {}
            made += [
                self.made(
                    key=LimitKey(
                        kind=self.name,
                        region=entry.region,
                        component=_direction(entry),
                        load_case=case,
                    ),
                    name=name,
                    allowed=in_number(entry.magnitude),
                    times_solid=as_multiple(entry.magnitude),
                    case_key=f"limits.{place}.magnitude",
                    nodes=placed.nodes[entry.region],
                    component=entry.component,
                    apart=placed.filter_radius,
                    solids=placed.solids.get(entry.region),
                    **shares,
                )
                for case in cases
            ]
        return made, warnings

    def _stated(
        self, limits: LimitsSpec, load_cases: Sequence[LoadCaseSpec], _material: Material
    ) -> list[StatedLimit]:
        return [
            StatedLimit(
                name=self._named(entry),
                load_case=load.name,
                allowed=stated_words(entry.magnitude, DisplacementLimit.unit),
                region=entry.region,
            )
            for entry in self._entries(limits)
            for load in entry.judged(load_cases)
        ]

    def _require(
        self,
        limits: LimitsSpec,
        load_cases: Sequence[LoadCaseSpec],
        regions: Mapping[str, Region],
        where: Where,
    ) -> None:
        refuse_held_surfaces(load_cases, self._entries(limits), self.name, regions, where)

    def _entries(self, limits: LimitsSpec) -> Sequence[DisplacementEntry]:
        return getattr(limits, self.name)

    def _named(self, entry: DisplacementEntry) -> str:
        return f"{self.name.replace('_', ' ')} of {entry.region} {_direction(entry)}"


def _direction(entry: DisplacementEntry) -> str:
    return "magnitude" if entry.component is None else "xyz"[entry.component]


#: Displacement of a region, ``displacement = [{region = "tip", magnitude = "2 mm"}]``.
KIND = DisplacementKind(name="displacement", made=DisplacementLimit).kind()
