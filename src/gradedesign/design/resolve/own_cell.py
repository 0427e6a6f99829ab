"""The cell that a case describes itself, beside the installed ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from gradedesign.common.values.locate import locating
from gradedesign.design.case.schema import Case
from gradedesign.design.resolve.registry import Registry, lookup
from gradedesign.errors import CaseError, PluginError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.maker import make_cell


def with_own_cell(case: Case, registry: Registry) -> Registry:
    """The registry and the case's own cell; as it is where the case has none.

    Raises
    ------
    CaseError
        For an unknown maker or option, a file of the wrong kind, the name of an installed cell,
        options that the maker refuses, or a shape that is no cell.
    DensityError
        If at no density the solid is one connected piece.
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
    with locating(case.where, "lattice.own_cell.maker"):
        maker = lookup(registry, "cell_makers", own.maker)
    with locating(case.where, "lattice.own_cell"):
        family = make_cell(maker, name, own.options, own.file)
        _require_usable(family, case.lattice.parameters)
    by = f"the case, through '{maker.name}' of {registry.sources['cell_makers'][maker.name]}"
    kinds = {kind: dict(names) for kind, names in registry.sources.items()}
    kinds["cell_families"][name] = by
    return replace(
        registry,
        cell_families=MappingProxyType({**registry.cell_families, name: family}),
        sources=MappingProxyType({k: MappingProxyType(v) for k, v in kinds.items()}),
    )


def _require_usable(family: CellFamily, stated: Mapping[str, float]) -> None:
    """Calibrate the cell as it is used later, when parameters that it lacks are told by name."""
    known = {name: value for name, value in stated.items() if name in family.parameters}
    try:
        calibrate(family, known)
    except PluginError as error:
        # Of a plugin's cell it is the plugin's mistake, of this one the case's.
        raise CaseError(str(error)) from error
