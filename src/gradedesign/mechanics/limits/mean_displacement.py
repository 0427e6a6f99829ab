"""Mean displacement: the displacement of a region, averaged over its area, must stay below a limit.

One component of it, or its length. The mean of the length, not the length of the mean: a face that
twists about its middle moves, though its mean vector stays at rest.

The deflection of a bare lattice face: the largest nodal value there is that of a single wall end
that dents under its share of the load, while the mean, times the force, is the work of a load that
is spread evenly over the face.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from gradedesign.arrays import FloatArray, IntArray, locked
from gradedesign.common.values.locate import Where
from gradedesign.common.values.value_types import RegionName
from gradedesign.errors import CaseError
from gradedesign.geometry.part.regions import Region
from gradedesign.geometry.part.regions_schema import AxisIndex
from gradedesign.mechanics.fe.displacement_goal import DisplacementGoal
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.limits.analysis import Analysis
from gradedesign.mechanics.limits.held_region import judged_cases, refuse_held_surfaces
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.limit import Limit, LimitKind, PlacedModel, StatedLimit
from gradedesign.mechanics.limits.limits_schema import (
    Allowed,
    LimitEntry,
    LimitsSpec,
    SolidMultiple,
    as_multiple,
    in_number,
    stated_words,
)
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.state import HomogenisedState, Predicted, Response
from gradedesign.mechanics.material.material import Material

#: A mean below this share of the part's largest displacement is none. Chosen, not measured.
AT_REST = 1e-6


class MeanDisplacementEntry(LimitEntry):
    """Mean displacement of a region over its area: of its length, or of one component of it."""

    region: RegionName = Field(examples=["tip"])
    """Name of the region."""
    magnitude: Annotated[float | SolidMultiple, Allowed("length")] = Field(
        examples=["2 mm", "1.5 x solid"]
    )
    """Allowed absolute value: mm, or so many times that of the solid part, each load case its
    own."""
    component: AxisIndex | None = None
    """The one component that is limited, instead of the magnitude; 0, 1 or 2 once read."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeanDisplacementLimit(Limit):
    """Mean displacement of a region in one load case.

    Attributes
    ----------
    nodes : (k,) int array
        Nodes of the region on the tetrahedra of the part.
    shares : (k,) array
        Share of the region's area that each node stands for.
    component : int or None
        0, 1, 2 limits the absolute value of the mean of one component, None the mean length.
    """

    nodes: IntArray
    shares: FloatArray
    component: int | None

    unit: ClassVar[str] = "mm"
    converges: ClassVar[bool] = True
    by_gradient: ClassVar[bool] = True

    def __post_init__(self) -> None:
        nodes = locked(self.nodes, (None,), dtype=np.int64, name="nodes")
        object.__setattr__(self, "nodes", nodes)
        object.__setattr__(self, "shares", locked(self.shares, (len(nodes),), name="shares"))
        if len(nodes) == 0:
            raise CaseError(
                f"{self.name} has no nodes: its region is not on the mesh; refine [part] mesh_size "
                f"or choose another region"
            )

    @property
    def measure(self) -> str:
        """The mean over the area."""
        if self.component is None:
            return "mean length over the area of the region"
        return "mean over the area of the region"

    def predict(self, state: HomogenisedState) -> Predicted:
        """Mean displacement of the region, mm."""
        value, _ = self._value_and_slope(state)
        return Predicted(value=self.factor * value, load_case=self.key.load_case)

    def responses(
        self, state: HomogenisedState, memory: tuple[int, ...] = ()
    ) -> tuple[tuple[Response, ...], tuple[int, ...]]:
        """The mean with its derivative by the nodal displacements of the region."""
        value, slope = self._value_and_slope(state)
        by_displacement = np.zeros_like(state.displacement(self.key.load_case))
        by_displacement[:, self.nodes] = self.factor * slope
        response = Response(
            name=self.name,
            load_case=self.key.load_case,
            value=self.factor * value,
            by_displacement=by_displacement,
        )
        return (response,), memory

    def goal(self) -> DisplacementGoal:
        """The mean over the area."""

        def by_displacement(u: FloatArray, area: FloatArray) -> FloatArray:
            _, slope = value_and_slope(u, area / area.sum(), self.component)
            return slope

        return DisplacementGoal(
            region=self.key.region, load_case=self.key.load_case, by_displacement=by_displacement
        )

    def rows(self, analysis: Analysis, judged_by: str) -> tuple[LimitRow, ...]:
        """Mean over the area where the solid reaches the region, mm."""
        region, load_case = self.key.region, self.key.load_case
        if self.component is None:
            return (self.row(analysis.mean_length(region, load_case), judged_by),)
        mean = analysis.mean_displacement(region, load_case)[self.component]
        return (self.row(abs(mean), judged_by),)

    def rest(self, analysis: Analysis) -> float:
        """A share of the part's largest displacement."""
        return AT_REST * analysis.largest_displacement(self.key.load_case)

    def _value_and_slope(self, state: HomogenisedState) -> tuple[float, FloatArray]:
        """Value, mm, and its derivative by the displacements of the region's nodes, ``(3, k)``."""
        moved = state.displacement(self.key.load_case)[:, self.nodes]
        return value_and_slope(moved, self.shares, self.component)


def value_and_slope(
    moved: FloatArray, shares: FloatArray, component: int | None
) -> tuple[float, FloatArray]:
    """Mean length, or absolute mean of a component, and its derivative by displacements.

    Parameters
    ----------
    moved : (3, k) array, mm
    shares : (k,) array
        Share of the area that each place stands for.
    component : int or None

    Returns
    -------
    value : float, mm
    slope : (3, k) array
    """
    slope = np.zeros_like(moved)
    if component is None:
        lengths = np.linalg.norm(moved, axis=0)
        # A place at rest has no direction; zero is one of its slopes.
        np.divide(moved * shares, lengths, out=slope, where=lengths > 0)
        return float(lengths @ shares), slope
    mean = float(moved[component] @ shares)
    slope[component] = shares if mean >= 0 else -shares
    return abs(mean), slope


def _entries(limits: Any) -> Sequence[MeanDisplacementEntry]:
    entries: Sequence[MeanDisplacementEntry] = limits.mean_displacement
    return entries


def _make(limits: LimitsSpec, placed: PlacedModel) -> tuple[Sequence[Limit], Sequence[str]]:
    """One limit per region, direction and load case it holds for, see `judged_cases`."""
    made: list[Limit] = []
    warnings: list[str] = []
    for number, entry in enumerate(_entries(limits)):
        names, remarks = judged_cases(placed, entry, f"{KIND.name}[{number}]", _name(entry))
        warnings += remarks
        made += [
            MeanDisplacementLimit(
                key=LimitKey(
                    kind=KIND.name,
                    region=entry.region,
                    component=_direction(entry),
                    load_case=name,
                ),
                name=_name(entry),
                allowed=in_number(entry.magnitude),
                times_solid=as_multiple(entry.magnitude),
                case_key=f"limits.mean_displacement[{number}].magnitude",
                nodes=placed.nodes[entry.region],
                shares=placed.shares[entry.region],
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
            allowed=stated_words(entry.magnitude, MeanDisplacementLimit.unit),
            region=entry.region,
            by_gradient=True,
        )
        for entry in _entries(limits)
        for load in load_cases
        if entry.load_case in (None, load.name)
    ]


def _require(
    limits: LimitsSpec,
    load_cases: Sequence[LoadCaseSpec],
    regions: Mapping[str, Region],
    where: Where,
) -> None:
    refuse_held_surfaces(load_cases, _entries(limits), KIND.name, regions, where)


def _direction(entry: MeanDisplacementEntry) -> str:
    return "magnitude" if entry.component is None else "xyz"[entry.component]


def _name(entry: MeanDisplacementEntry) -> str:
    return f"mean displacement of {entry.region} {_direction(entry)}"


#: ``mean_displacement = [{region = "tip", component = "z", magnitude = "2 mm"}]``.
KIND = LimitKind(
    name="mean_displacement",
    entry=MeanDisplacementEntry,
    make=_make,
    stated=_stated,
    require=_require,
)
