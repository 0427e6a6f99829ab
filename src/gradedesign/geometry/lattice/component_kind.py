"""Kinds of components: how a case makes them, and the domain that they make together."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

from pydantic import Field as TableField

from gradedesign.arrays import Field
from gradedesign.common.values.locate import Where
from gradedesign.common.values.table import Table
from gradedesign.common.values.value_types import Name
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.lattice import components
from gradedesign.geometry.lattice.component import Component
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.geometry.lattice.zone_schema import ZoneSpec
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.place_schema import KeepSpec
from gradedesign.geometry.part.signed_distance import SurfaceDistance

#: Stages in their order: a filling lies where all other solids leave little room.
Stage: TypeAlias = Literal["cells", "solid", "filling", "join", "cut"]
_BEFORE_CUTS: tuple[Stage, ...] = ("cells", "solid", "filling", "join")

#: Components that a case states, and remarks for the user on them.
Made: TypeAlias = tuple[Sequence[Component], Sequence[str]]


class ComponentEntry(Table):
    """One table of a list of components in the case file."""

    name: Name | None = TableField(default=None, examples=["middle"])
    """Shown in check, pictures and messages; a number without it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ComponentPlace:
    """A part as far as its lattice is composed: what components are made from.

    Attributes
    ----------
    lattice : LatticeSpec
        The table ``[lattice]``, with the lists that kinds bring.
    keep, zone : tuple of Table
        The tables ``[[keep]]`` and ``[[zone]]``.
    distance : SurfaceDistance
        Of the part.
    domain : DesignDomain
        With the components of the stages before, and those made before in the same stage.
    loaded : frozenset of str
        Regions that are held or loaded.
    min_wall : float, mm
        Thinnest wall that the printer makes; 0 where it is not stated.
    cells : tuple of Cell
        That will fill the part.
    stress : callable, optional
        Of the solid part, 0 to 1, at points ``(3, ...)`` mm, once it is known.
    design : LatticeDesign, optional
        Of the domain, with a density that the lattice will have somewhere; for cuts.
    cell_edge : float, mm
        Shortest edge of its cells.
    """

    lattice: LatticeSpec
    keep: tuple[KeepSpec, ...]
    zone: tuple[ZoneSpec, ...]
    where: Where
    part: Part
    distance: SurfaceDistance
    domain: DesignDomain
    loaded: frozenset[str] = frozenset()
    min_wall: float = 0.0
    cells: tuple[Cell, ...] = ()
    stress: Field | None = None
    design: LatticeDesign | None = None
    cell_edge: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ComponentKind:
    """A kind of component, as a plugin registers it.

    Attributes
    ----------
    name : str
        Also the key of its list in ``[lattice]``.
    stage : str
        At which it is made and acts.
    make : callable
        ``make(ComponentPlace) -> (components, remarks)``: what a case states, called where its list
        is stated. A `CaseError` refuses what is impossible in the part.
    entry : type of ComponentEntry or None
        Layout of one table of ``[[lattice.NAME]]``; None: its keys are the core's.
    """

    name: str
    stage: Stage
    make: Callable[[ComponentPlace], Made]
    entry: type[ComponentEntry] | None = None


def builtin_components() -> Iterator[ComponentKind]:
    """The kind of every file of the package of components that defines a ``KIND``."""
    for module in sorted(pkgutil.iter_modules(components.__path__), key=lambda m: m.name):
        kind = getattr(
            importlib.import_module(f"{components.__name__}.{module.name}"), "KIND", None
        )
        if kind is not None:
            yield kind


def component_entries(kinds: Mapping[str, ComponentKind]) -> dict[str, type[ComponentEntry]]:
    """Entries that kinds add to ``[lattice]``: a list of tables under their name."""
    return {name: kind.entry for name, kind in kinds.items() if kind.entry is not None}


def composed(place: ComponentPlace, kinds: Mapping[str, ComponentKind]) -> DesignDomain:
    """The domain of a place with every component that a case states, but for its cuts.

    Raises `CaseError`, `ResourceError` as the kinds do.
    """
    return _made(place, kinds, _BEFORE_CUTS)


def with_cuts(
    place: ComponentPlace,
    kinds: Mapping[str, ComponentKind],
    design: LatticeDesign,
    cell_edge: float,
) -> DesignDomain:
    """The domain of a design with the cuts that a case states.

    ``kinds``: by name. ``design``: of a density that the lattice will have somewhere, without cuts.
    ``cell_edge``, mm: shortest edge of a cell. Raises `CaseError`, `ResourceError` as the kinds do.
    """
    there = replace(place, domain=design.domain, design=design, cell_edge=cell_edge)
    return _made(there, kinds, ("cut",))


def _may_state(place: ComponentPlace, kind: ComponentKind) -> bool:
    """Whether a case may state a kind: one of the core's keys, or one whose list it holds."""
    return kind.entry is None or bool(getattr(place.lattice, kind.name, ()))


def _made(
    place: ComponentPlace, kinds: Mapping[str, ComponentKind], stages: Sequence[Stage]
) -> DesignDomain:
    for stage in stages:
        for kind in kinds.values():
            if kind.stage != stage or not _may_state(place, kind):
                continue
            made, notes = kind.make(place)
            place = replace(place, domain=place.domain.with_components(made, notes))
    return place.domain
