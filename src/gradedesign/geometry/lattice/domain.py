"""The design domain: the part with the components of its lattice."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray, locked
from gradedesign.errors import LatticeError
from gradedesign.geometry.lattice.component import (
    KEPT,
    LATTICE,
    MEMBER,
    SKIN,
    CellComponent,
    Component,
    CutComponent,
    JoinComponent,
    SolidComponent,
)

__all__ = ["KEPT", "LATTICE", "SKIN", "DesignDomain", "grown", "phase_at", "solid_at"]

_Stage = TypeVar("_Stage", bound=Component)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DesignDomain:
    """The part that is designed.

    Attributes
    ----------
    distance : callable
        Signed distance of the part, points ``(3, ...)`` mm to ``(...)`` mm, negative inside.
    lower, upper : (3,) array, mm
        Box around the part.
    components : tuple of Component
        What lies in it beside the cells.
    bodies : int
        Connected components of the part.
    least_rim : float, mm
        Rims of less solid below the part's faces, at flat angles, are left out; 0: none.
    overhang : float, mm
        By which the faces of ``distance`` lie outside those of the part, see `grown`.
    notes : tuple of str
        Remarks for the user on its components.

    Raises
    ------
    LatticeError
        If the box is empty.
    """

    distance: Field
    lower: FloatArray
    upper: FloatArray
    components: tuple[Component, ...] = ()
    bodies: int = 1
    least_rim: float = 0.0
    overhang: float = 0.0
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "lower", locked(self.lower, (3,), name="lower"))
        object.__setattr__(self, "upper", locked(self.upper, (3,), name="upper"))
        if not (self.upper > self.lower).all():
            raise LatticeError(f"the lattice's box is empty: {self.lower} to {self.upper} mm")

    def of(self, stage: type[_Stage]) -> tuple[_Stage, ...]:
        """Components of one class."""
        return tuple(c for c in self.components if isinstance(c, stage))

    @property
    def solids(self) -> tuple[SolidComponent, ...]:
        """Places that are solid."""
        return tuple(c for c in self.components if isinstance(c, SolidComponent))

    @property
    def on_cells(self) -> tuple[CellComponent, ...]:
        """Components that add to the cells."""
        return tuple(c for c in self.components if isinstance(c, CellComponent))

    @property
    def has_cells(self) -> bool:
        """Whether cells are built."""
        return not any(component.replaces for component in self.on_cells)

    @property
    def cuts(self) -> tuple[CutComponent, ...]:
        """Components that take material away."""
        return tuple(c for c in self.components if isinstance(c, CutComponent))

    @property
    def in_members(self) -> Callable[[FloatArray], BoolArray] | None:
        """Whether points ``(3, n)`` mm of the printed solid lie in solid members, ``(n,)``.

        None where there are none.
        """
        if all(solid.phase != MEMBER for solid in self.solids):
            return None
        return lambda points: printed_phase_at(self, points) == MEMBER

    @property
    def lattice_only(self) -> bool:
        """Whether no place of the part is solid."""
        return not self.solids

    @property
    def closed(self) -> bool:
        """Whether solids close the lattice in below faces of the part."""
        return any(solid.closes for solid in self.solids)

    @property
    def join(self) -> JoinComponent | None:
        """Rounded corners between cells and solids."""
        return next((c for c in self.components if isinstance(c, JoinComponent)), None)

    @property
    def ties_faces(self) -> bool:
        """Whether cells are held at the part's faces."""
        return any(c.ties_faces for c in self.components)

    @property
    def layers(self) -> tuple[float, ...]:
        """Least thicknesses that grids must resolve, mm."""
        return tuple(c.least for c in self.components if np.isfinite(c.least))

    def with_components(self, more: Sequence[Component], notes: Sequence[str] = ()) -> DesignDomain:
        """The domain with further components and remarks on them."""
        return replace(self, components=(*self.components, *more), notes=(*self.notes, *notes))

    def facts(self) -> dict[str, list[dict[str, Any]]]:
        """Plain data of its components for ``result.json``, by measure."""
        listed: dict[str, list[dict[str, Any]]] = {"drains": []}
        for component in self.components:
            if component.listed:
                listed.setdefault(component.listed, []).append(dict(component.facts))
        return listed

    def plain(self) -> DesignDomain:
        """The domain without what adds to the cells or rounds corners."""
        added = (*(c for c in self.on_cells if not c.replaces), self.join)
        return replace(self, components=tuple(c for c in self.components if c not in added))


def phase_at(
    domain: DesignDomain, points: FloatArray, distance: FloatArray | None = None
) -> IntArray:
    """Phase of points of the part ``(3, ...)`` mm, ``(...)``: `LATTICE` or that of a solid.

    ``distance`` is that of the part where it is known already.
    """
    phase = np.full(np.shape(points)[1:], LATTICE, dtype=np.int64)
    to_part = distance
    # Where several solids lie, what is stated counts before members, and the later phase first.
    for solid in sorted(domain.solids, key=lambda solid: (solid.phase == MEMBER, -solid.phase)):
        if to_part is None and solid.part_depth:
            to_part = domain.distance(points)
        open_ones = phase == LATTICE
        there = None if to_part is None else to_part[open_ones]
        inside = solid.distance(np.asarray(points)[:, open_ones], there) < 0
        phase[open_ones] = np.where(inside, solid.phase, LATTICE)
    return phase


def printed_phase_at(domain: DesignDomain, points: FloatArray) -> IntArray:
    """Phase of points of the printed solid ``(3, ...)`` mm, ``(...)``.

    Without cells, what lies a rounding error outside all solids is of their members.
    """
    phase = phase_at(domain, points)
    return phase if domain.has_cells else np.where(phase == LATTICE, MEMBER, phase)


def solid_at(domain: DesignDomain, points: FloatArray) -> BoolArray:
    """Whether points of the part ``(3, ...)`` mm lie in a solid, ``(...)``."""
    return np.asarray(phase_at(domain, points) != LATTICE)


def grown(domain: DesignDomain, overhang: float) -> DesignDomain:
    """The domain with its faces moved outward by ``overhang``, mm; inside, nothing moves."""
    inner = domain.distance
    return replace(
        domain,
        distance=lambda points: inner(points) - overhang,
        overhang=domain.overhang + overhang,
        components=tuple(component.grown(overhang) for component in domain.components),
        lower=domain.lower - overhang,
        upper=domain.upper + overhang,
    )
