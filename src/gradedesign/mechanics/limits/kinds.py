"""Loops over the registered kinds of limits."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator, Mapping, Sequence

import gradedesign.mechanics.limits
from gradedesign.common.values.locate import Where
from gradedesign.geometry.part.regions import Region
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.limits.limit import Limit, LimitKind, PlacedModel, StatedLimit
from gradedesign.mechanics.limits.limits_schema import LimitEntry, LimitsSpec
from gradedesign.mechanics.material.material import Material


def builtin_kinds() -> Iterator[LimitKind]:
    """The kind of every file of this package that defines a ``KIND``."""
    for module in sorted(
        pkgutil.iter_modules(gradedesign.mechanics.limits.__path__), key=lambda m: m.name
    ):
        kind = getattr(
            importlib.import_module(f"gradedesign.mechanics.limits.{module.name}"), "KIND", None
        )
        if kind is not None:
            yield kind


def limit_entries(kinds: Mapping[str, LimitKind]) -> dict[str, type[LimitEntry]]:
    """Entries that limit kinds add to ``[limits]``: a list of tables under their name."""
    return {name: kind.entry for name, kind in kinds.items() if kind.entry is not None}


def _kinds_of(kinds: Mapping[str, LimitKind], limits: LimitsSpec) -> Iterator[LimitKind]:
    """Kinds that a case may state: those of the core's keys, and those whose list it holds."""
    for name, kind in kinds.items():
        if kind.entry is None or getattr(limits, name, False):
            yield kind


def stated_limits(
    kinds: Mapping[str, LimitKind],
    limits: LimitsSpec,
    load_cases: Sequence[LoadCaseSpec],
    material: Material,
) -> tuple[StatedLimit, ...]:
    """Every limit as a case states it, measured ones first."""
    stated = [
        limit
        for kind in _kinds_of(kinds, limits)
        for limit in kind.stated(limits, load_cases, material)
    ]
    return tuple(sorted(stated, key=lambda limit: not limit.explicit))


def require_possible(
    kinds: Mapping[str, LimitKind],
    limits: LimitsSpec,
    load_cases: Sequence[LoadCaseSpec],
    regions: Mapping[str, Region],
    where: Where,
) -> None:
    """Refuse limits that the part's surface shows to be impossible.

    Raises `CaseError`.
    """
    for kind in _kinds_of(kinds, limits):
        kind.require(limits, load_cases, regions, where)


def made_limits(
    kinds: Mapping[str, LimitKind], stated: LimitsSpec, placed: PlacedModel
) -> tuple[tuple[Limit, ...], tuple[str, ...]]:
    """Every limit of a case on the tetrahedra of its part, and warnings.

    Raises `CaseError` for a limit that no design can change.
    """
    limits: list[Limit] = []
    warnings: list[str] = []
    for kind in _kinds_of(kinds, stated):
        made, remarks = kind.make(stated, placed)
        limits += made
        warnings += remarks
    return in_order(limits), tuple(dict.fromkeys(warnings))


def in_order(limits: Sequence[Limit]) -> tuple[Limit, ...]:
    """Limits as every table lists them: of stiffness, of stress, then predicted ones."""
    return tuple(sorted(limits, key=lambda limit: (not limit.explicit, limit.needs_stress)))
