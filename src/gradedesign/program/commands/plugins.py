"""The registry as the commands build it, and the cell that a command names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import typer

from gradedesign.design.resolve.own_cell import with_own_cell
from gradedesign.design.resolve.registry import Registry, lookup
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.program.host.read_case import load_case
from gradedesign.program.host.registry import build_registry


def registry_for(*, strict_plugins: bool) -> Registry:
    """Build the registry of the installed plugins and print what is wrong with them.

    Raises `PluginError` with ``strict_plugins``, for one that failed to load or has a hook without
    its marker.
    """
    registry = build_registry(strict=strict_plugins)
    for note in registry.notes:
        typer.echo(f"warning: {note}", err=True)
    return registry


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NamedCell:
    """A cell family with the parameters that a case states for it."""

    family: CellFamily
    parameters: Mapping[str, float]  #: Empty for an installed cell, which has its defaults.


def named_cell(registry: Registry, name: str) -> NamedCell:
    """Find a cell by its name, or by the case file, or its folder, that uses it.

    A case is told by its suffix ``.toml``, or by a folder that holds a ``case.toml``. Raises
    `CaseError`, `DensityError`, `PluginError` for an unknown name, with the nearest one, and for
    what is wrong with a case.
    """
    path = Path(name)
    if path.suffix.lower() != ".toml" and not (path / "case.toml").is_file():
        return NamedCell(family=lookup(registry, "cell_families", name), parameters={})
    case = load_case(path, registry=registry)
    registry = with_own_cell(case.lattice, registry, case.where)
    family = lookup(registry, "cell_families", case.lattice.cell)
    return NamedCell(family=family, parameters=case.lattice.parameters)
