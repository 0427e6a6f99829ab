"""The protocol of a lattice's components: what lies in a part beside its cells.

A component acts at one of four stages: the body is ``cut(max(part, join(cells, solids)))``. Solids
have a distance. Those on the cells change the cells' values, a join has a radius and no place of
its own, and a cut takes material away from all of them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Self, TypeAlias

import numpy as np

from gradedesign.arrays import Field, FloatArray

#: Phases of the printed solid: indices into ``explicit.measures.PHASES``.
LATTICE, SKIN, KEPT, MEMBER = 0, 1, 2, 3

#: Points ``(3, ...)`` mm and the part's distance there, where it is known, to the distance of a
#: solid, mm.
SolidLayer: TypeAlias = Callable[[FloatArray, FloatArray | None], FloatArray]
#: A function of points ``(3, n)`` mm to values ``(n,)`` and its values there, about mm, negative
#: inside.
Valued: TypeAlias = tuple[FloatArray, Field]


class InnerPlane(NamedTuple):
    """A plane face of a solid across an axis, its place on it, mm, and its area, mm^2."""

    axis: int
    place: float
    area: float


class Slab(NamedTuple):
    """All between two parallel planes: their unit normal, and their places along it, mm."""

    normal: FloatArray
    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Distances:
    """Distances that are exact in a band around their zero set, or everywhere."""

    part: Field  #: That of the part.
    reach: float  #: mm. Of the band; infinite: exact everywhere.
    #: ``banded(distance, inner, outer)``: the distance, exact from ``-inner`` to ``outer`` mm.
    banded: Callable[[Field, float, float], Field]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Component:
    """A component of a lattice."""

    name: str = ""  #: In sentences, such as ``"the skin"``.
    where: str = ""  #: Place in the case that states it.

    #: It holds the cells at the part's faces, which are then not free.
    ties_faces: ClassVar[bool] = False
    #: Measure of ``result.json`` that lists its `facts`; empty: none.
    listed: ClassVar[str] = ""

    @property
    def least(self) -> float:
        """Least thickness of what it adds, mm; infinite where no grid needs to resolve it."""
        return np.inf

    @property
    def part_depth(self) -> float:
        """Depth below the part's faces down to which it needs the part's distance, mm."""
        return 0.0

    @property
    def facts(self) -> Mapping[str, Any]:
        """Plain data for ``result.json``, in the list `listed`."""
        return {}

    def grown(self, overhang: float) -> Self:  # noqa: ARG002
        """The component of a part whose faces have moved outward by ``overhang`` mm."""
        return self


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SolidComponent(Component, ABC):
    """A place of the part that is solid.

    Attributes
    ----------
    region : str, optional
        Region of the part that it lies at.
    box : ((3,) array, (3,) array), optional, mm
        Corners of a box around it, for pictures and volumes.
    planes : tuple of InnerPlane
        Its faces that a grid may meet.
    """

    region: str | None = None
    box: tuple[FloatArray, FloatArray] | None = None
    planes: tuple[InnerPlane, ...] = ()

    #: Phase of what it holds.
    phase: ClassVar[int] = KEPT
    #: It closes the lattice in below the part's faces.
    closes: ClassVar[bool] = False

    @property
    def slab(self) -> Slab | None:
        """Of one that is all between two planes: its share in an element is exact."""
        return None

    @property
    def thickest(self) -> float:
        """Its largest thickness, mm."""
        return self.least

    @property
    def all_round(self) -> bool:
        """Whether it closes the lattice in below all of the part's faces."""
        return False

    def covers(self, region: str) -> bool:  # noqa: ARG002
        """Whether it lies below a region of the part as a closed layer."""
        return False

    @abstractmethod
    def distance(self, points: FloatArray, to_part: FloatArray | None) -> FloatArray:
        """Distance to it in the part, about mm, negative in it.

        Parameters
        ----------
        points : (3, ...) array, mm
        to_part : (...) array, mm
            Signed distance of the part there; read where `part_depth` is above 0.
        """

    def layer(self, near: Distances) -> SolidLayer:
        """Its distance with the band of these, also beyond the part."""
        own = near.banded(lambda points: self.distance(points, None), near.reach, near.reach)
        return lambda points, _: own(points)

    def within(self) -> Self:
        """The same in the part, whose layer does not widen beyond the part's faces."""
        return self

    def why_full(self, inside: FloatArray, to_part: FloatArray) -> str:
        """Why it leaves no place of the part, at points that fill it; empty where it leaves some.

        Parameters
        ----------
        inside : (3, n) array, mm
        to_part : (n,) array, mm
        """
        if float(self.distance(inside, to_part).max()) > 0:
            return ""
        return (
            f"{self.where}: holds the whole part, so all of it would stay solid; expected a "
            f"smaller one"
        )


class CellComponent(Component, ABC):
    """A component that changes the cells."""

    __slots__ = ()

    #: It takes their place, and adds no solid to them.
    replaces: ClassVar[bool] = False

    @abstractmethod
    def over(
        self, cells: FloatArray, points: FloatArray, to_part: FloatArray, cell: tuple[Field, float]
    ) -> FloatArray:
        """Values of the cells with what it adds, ``(n,)``, about mm, negative inside.

        Parameters
        ----------
        cells : (n,) array
            Values of the cells.
        points : (3, n) array, mm
        to_part : (n,) array, mm
            Signed distance of the part there.
        cell : (callable, float)
            Field of the infinite lattice, about mm, and the size of its cells, mm.
        """


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JoinComponent(Component, ABC):
    """A component that rounds the corners between cells and solids."""

    radius: float  #: mm.

    @property
    @abstractmethod
    def reach(self) -> float:
        """Reach of the distances that it needs, mm."""

    @abstractmethod
    def joined(self, points: FloatArray, cell: Valued, solids: Sequence[Valued]) -> FloatArray:
        """Union of cells and solids, ``(n,)``, about mm.

        ``points (3, n)``, mm. ``cell``: values ``(n,)`` of the infinite lattice, about mm, and
        their function. ``solids``: distances ``(n,)`` of the solids, mm, and their functions.
        """


class CutComponent(Component, ABC):
    """A component that takes material away."""

    __slots__ = ()

    @abstractmethod
    def distance(self, points: FloatArray) -> FloatArray:
        """Distance to it at points ``(3, ...)`` mm, ``(...)``, mm, negative in it."""


def less(distance: Field, by: float) -> Field:
    """A distance less so many mm."""
    return lambda points: distance(points) - by
