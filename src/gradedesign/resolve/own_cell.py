"""The cell that a case describes itself, beside the installed ones."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

from gradedesign.case.generate_schema import GenerateCase
from gradedesign.case.locate import locating
from gradedesign.case.schema import Case
from gradedesign.cell.maker import make_cell
from gradedesign.errors import CaseError
from gradedesign.plugin.registry import Registry, lookup


def with_own_cell(case: Case | GenerateCase, registry: Registry) -> Registry:
    """The registry and the case's own cell; as it is where the case has none.

    Raises
    ------
    CaseError
        For an unknown maker or option, a file of the wrong kind, the name of an installed cell, or
        options that the maker refuses.
    PluginError
        If the maker breaks.
    """
    own = case.lattice.own_cell
    if own is None:
        return registry
    name = case.lattice.cell
    if name in registry.cell_families:
        raise CaseError(
            f"{case.where('lattice.cell')}: '{name}' is an installed cell; give the one of "
            f"[lattice.own_cell] another name"
        )
    with locating(case, "lattice.own_cell.maker"):
        maker = lookup(registry, "cell_makers", own.maker)
    with locating(case, "lattice.own_cell"):
        family = make_cell(maker, name, own.options, own.file)
    by = f"the case, through '{maker.name}' of {registry.sources['cell_makers'][maker.name]}"
    kinds = {kind: dict(names) for kind, names in registry.sources.items()}
    kinds["cell_families"][name] = by
    return replace(
        registry,
        cell_families=MappingProxyType({**registry.cell_families, name: family}),
        sources=MappingProxyType({k: MappingProxyType(v) for k, v in kinds.items()}),
    )
