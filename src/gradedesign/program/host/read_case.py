"""Reading a case with keys that plugins may bring."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gradedesign.design.case import read_case
from gradedesign.design.case.schema import Brought, Case
from gradedesign.design.resolve.fitting_part import installed_part
from gradedesign.design.resolve.registry import Registry
from gradedesign.geometry.lattice.component_kind import component_entries
from gradedesign.geometry.part.part import Part
from gradedesign.mechanics.limits.kinds import limit_entries
from gradedesign.program.host.registry import build_registry


def load_case(
    path: str | Path,
    *,
    allow_outside: bool = False,
    registry: Registry | None = None,
    values: Mapping[str, Any] = read_case.NO_VALUES,
) -> Case:
    """Read and check a case file.

    Parameters
    ----------
    path : str or Path
        The TOML file, or the folder that holds a ``case.toml``.
    allow_outside : bool
        Whether the part file may lie outside the folder of the case.
    registry : Registry, optional
        Kinds of limits and readers; the installed ones by default.
    values : mapping of dotted key to value
        As TOML gives them, such as ``{"lattice.size": "10 mm"}``; they replace those of the file.

    Returns
    -------
    Case
        Every value in internal units.

    Raises
    ------
    CaseError
        With a summary and one line per problem: file, line, key, what was found, what would be
        right.

    Examples
    --------
    >>> case = load_case("cases/mini", values={"lattice.size": "10 mm"})
    >>> case.name, case.lattice.size
    ('mini', (10.0,))
    """
    return read_case.load_case(
        path, allow_outside=allow_outside, brought=lambda: brought_by(registry), values=values
    )


def load_part(
    path: str | Path, *, allow_outside: bool = False, registry: Registry | None = None
) -> Part:
    """Read the part of a case, repaired and with the regions that the case names.

    Parameters
    ----------
    path, allow_outside
        As `load_case` takes them.
    registry : Registry, optional
        Readers and repairers; the installed ones by default.

    Raises
    ------
    CaseError, PartError, ResourceError, PluginError
        Whatever is wrong, with file, line and key.

    Examples
    --------
    >>> part = load_part("cases/mini")
    >>> list(part.regions), round(part.volume, 6)
    (['root', 'tip'], 3456.0)
    """
    registry = build_registry() if registry is None else registry
    case = load_case(path, allow_outside=allow_outside, registry=registry)
    return installed_part(case, registry)


def brought_by(registry: Registry | None) -> Brought:
    """Keys of case files of the kinds and readers of a registry, or else of the installed ones."""
    registry = build_registry() if registry is None else registry
    return Brought(
        limits=limit_entries(registry.limits),
        lattice=component_entries(registry.components),
        part={r.key: r.table for r in registry.readers.values() if r.table is not None},
    )
