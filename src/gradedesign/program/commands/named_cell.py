"""The cell that a command names: an installed one, or that of a case with a cell of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from gradedesign.design.resolve.own_cell import with_own_cell
from gradedesign.design.resolve.registry import Registry, lookup
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.program.host.read_case import load_case


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NamedCell:
    """A cell family with the parameters that a case states for it.

    Attributes
    ----------
    parameters : mapping of str to float
        Empty for an installed cell, which has its defaults.
    """

    family: CellFamily
    parameters: Mapping[str, float]


def named_cell(registry: Registry, name: str) -> NamedCell:
    """Find a cell by its name, or by the case file, or its folder, that uses it.

    A case is told by its suffix ``.toml``, or by a folder that holds a ``case.toml``.

    Raises
    ------
    CaseError, DensityError, PluginError
        For an unknown name, with the nearest one, and for what is wrong with a case.
    """
    path = Path(name)
    if path.suffix.lower() != ".toml" and not (path / "case.toml").is_file():
        return NamedCell(family=lookup(registry, "cell_families", name), parameters={})
    case = load_case(path, registry=registry)
    registry = with_own_cell(case.lattice, registry, case.where)
    family = lookup(registry, "cell_families", case.lattice.cell)
    return NamedCell(family=family, parameters=case.lattice.parameters)
