"""The cell that a case describes itself, beside the installed ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from gradedesign.common.values.locate import Where, locating
from gradedesign.design.resolve.registry import Registry, lookup
from gradedesign.errors import CaseError, PluginError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.family import VOID, CellFamily
from gradedesign.geometry.cell.maker import make_cell
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.mechanics.material.void_law import VOID_LAW


def with_own_cell(lattice: LatticeSpec, registry: Registry, where: Where) -> Registry:
    """The registry and the cell that ``[lattice]`` describes; as it is where it describes none.

    Where cells are no phase of it, void stands for them.

    Raises CaseError for an unknown maker or option, a file of the wrong kind, the name of an
    installed cell, options that the maker refuses, or a shape that is no cell. Raises DensityError
    if at no density the solid is one connected piece. Raises PluginError if the maker breaks.
    """
    own, name = lattice.own_cell, lattice.cell
    if not lattice.cells:
        laws = MappingProxyType({**registry.scaling_laws, VOID_LAW.name: VOID_LAW})
        families = MappingProxyType({**registry.cell_families, name: VOID})
        return replace(registry, cell_families=families, scaling_laws=laws)
    if own is None:
        return registry
    if name in registry.cell_families:
        raise CaseError(
            f"{where('lattice.cell')}: '{name}' is an installed cell; give the one of "
            f"[lattice.own_cell] another name"
        )
    with locating(where, "lattice.own_cell.maker"):
        maker = lookup(registry, "cell_makers", own.maker)
    with locating(where, "lattice.own_cell"):
        family = make_cell(maker, name, own.options, own.file)
        _require_usable(family, lattice.parameters)
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
