"""The law that a case will use, found without computing any."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from gradedesign.case.schema import Case
from gradedesign.cell.cell import Cell
from gradedesign.cell.family import CellFamily
from gradedesign.homogenise.cached_table import (
    ON_DEMAND_RESOLUTION,
    has_table,
    on_demand_resolution,
)
from gradedesign.homogenise.table import table_densities
from gradedesign.plugin.choose_law import choose_law, usable_laws
from gradedesign.plugin.registry import Registry

#: Minutes of one processor that a table takes at ON_DEMAND_RESOLUTION, least and most.
TABLE_MINUTES = (1.0, 2.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedLaw:
    """The law that a run will use.

    Attributes
    ----------
    name : str
    window : (float, float)
        Densities that it covers.
    why : str
        Why no registered law describes the cell; empty where one does.
    voxels : int
        Along the cell that it is computed on; 0 for a registered law.
    tabulated : bool
        Registered, or in the user's cache.
    """

    name: str
    window: tuple[float, float]
    why: str = ""
    voxels: int = 0
    tabulated: bool = True

    @property
    def minutes(self) -> tuple[float, float]:
        """Predicted time of computing it, least and most; zero where it is known."""
        if self.tabulated:
            return 0.0, 0.0
        work = (self.voxels / ON_DEMAND_RESOLUTION) ** 3
        return TABLE_MINUTES[0] * work, TABLE_MINUTES[1] * work


def planned_law(
    case: Case,
    registry: Registry,
    cell: Cell,
    *,
    poissons_ratio: float,
) -> PlannedLaw:
    """Choose between the registered laws and one that is computed for the case.

    ``auto`` takes a registered law only for the family's default parameters in cells of equal
    edges, which are what laws describe. A law that the case names is taken as it is.

    Raises
    ------
    CaseError
        As `choose_law`.
    DensityError
        If the walls are too thin for any grid that a law is computed on.
    """
    name, edges = case.lattice.law, case.lattice.edges
    changed = changed_parameters(cell.family, cell.parameters)
    unequal = min(edges) < max(edges)
    if name != "auto" or not (changed or unequal or not usable_laws(registry, cell.name)):
        law = choose_law(registry, cell.name, name, case.lattice.density)
        return PlannedLaw(name=law.name, window=law.window)
    why = f"with {values_in_words(changed, cell.parameters)}" if changed else "of this cell"
    if unequal:
        why += f" with edges in proportion {proportion(edges)}"
    voxels = on_demand_resolution(cell, edges)
    densities = table_densities(cell, voxels, edges)
    return PlannedLaw(
        name=f"{cell.name}-computed{'-stretched' if unequal else ''}",
        window=(densities[0], densities[-1]),
        why=f"no law {why} is installed",
        voxels=voxels,
        tabulated=has_table(cell, poissons_ratio, voxels, edges),
    )


def changed_parameters(family: CellFamily, parameters: Mapping[str, float]) -> list[str]:
    """Names of the parameters that differ from the family's defaults."""
    return [k for k, value in parameters.items() if value != family.parameters[k]]


def proportion(edges: Sequence[float]) -> str:
    """Edges over the shortest, in words."""
    return " : ".join(f"{edge / min(edges):.4g}" for edge in edges)


def values_in_words(names: list[str], parameters: Mapping[str, float]) -> str:
    """Named parameters with their values."""
    return ", ".join(f"{name} = {parameters[name]:g}" for name in names)
