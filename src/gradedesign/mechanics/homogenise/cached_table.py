"""Property tables of cells that come without one, computed once and kept in the user's cache."""

from __future__ import annotations

import logging
from collections.abc import Sequence

import numpy as np

from gradedesign.common.system.cache import content_key, load_arrays, store_arrays
from gradedesign.errors import DensityError, PluginError, SolverError
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.shape import evaluate_shape, grid_nodes
from gradedesign.mechanics.homogenise.cell_properties import RESOLUTIONS
from gradedesign.mechanics.homogenise.sampling import CUBE
from gradedesign.mechanics.homogenise.strength import PERCENTILE
from gradedesign.mechanics.homogenise.table import (
    METHOD_VERSION,
    RowListener,
    compute_table,
    table_densities,
)
from gradedesign.mechanics.material.property_table import (
    FORMAT,
    PropertyTable,
    read_property_table,
    write_property_table,
)
from gradedesign.mechanics.material.scaling_law import ScalingLaw
from gradedesign.mechanics.material.tabulated_law import tabulated_law

log = logging.getLogger(__name__)

_KIND = "property-table"

#: Voxels along most cells whose table is computed during a run: 20 to 60 s of one processor.
ON_DEMAND_RESOLUTION = 48


def property_table(
    cell: Cell,
    poissons_ratio: float = 0.3,
    resolution: int | None = None,
    edges: Sequence[float] = CUBE,
    on_row: RowListener | None = None,
) -> PropertyTable:
    """Property table of any cell: from the user's cache, or computed and stored there.

    Raises `DensityError`, `LatticeError` or `SolverError` as `compute_table`.

    - ``poissons_ratio``: of the base material
    - ``resolution``: voxels along the cell; by default what each density's wall needs
    - ``edges (3,)``: of the cell, up to a factor
    - ``on_row``: as `compute_table`, where the table is computed

    Notes
    -----
    The key holds the family's name and its shape function's values at 4096 nodes of one period, the
    complete parameters, nu, the resolution, and the versions of method and format: a changed cell
    or a newer method is computed again.
    """
    key = _table_key(cell, poissons_ratio, resolution, edges)
    entry = load_arrays(_KIND, key)
    if entry is not None:
        try:
            return read_property_table(entry["json"].tobytes().decode("utf-8"))
        except (KeyError, UnicodeDecodeError, PluginError) as error:
            log.warning("the cached table of cell %s is unusable: %s", cell.name, error)
    log.info("no table for cell %s: computing one", cell.name)
    table = compute_table(
        cell,
        poissons_ratio=poissons_ratio,
        resolution=resolution,
        on_row=on_row,
        edges=edges,
    )
    text = write_property_table(table).encode("utf-8")
    store_arrays(_KIND, key, json=np.frombuffer(text, dtype=np.uint8))
    return table


def has_table(
    cell: Cell,
    poissons_ratio: float = 0.3,
    resolution: int | None = None,
    edges: Sequence[float] = CUBE,
) -> bool:
    """Whether `property_table` would find its answer in the user's cache."""
    key = _table_key(cell, poissons_ratio, resolution, edges)
    return load_arrays(_KIND, key) is not None


def _table_key(
    cell: Cell,
    poissons_ratio: float,
    resolution: int | None,
    edges: Sequence[float],
) -> str:
    """Content key of a table: see the notes of `property_table`."""
    points = cell.family.period * grid_nodes(16, (0.3, 0.6, 0.8))
    return content_key(
        cell.name,
        cell.family.symmetry,
        repr(sorted(cell.parameters.items())),
        cell.family.period,
        evaluate_shape(cell.family, cell.parameters, points),
        float(poissons_ratio),
        int(resolution or 0),
        *_stretch(edges),
        PERCENTILE,
        METHOD_VERSION,
        FORMAT,
    )


def on_demand_resolution(
    cell: Cell,
    edges: Sequence[float] = CUBE,
) -> int:
    """Voxels along a cell whose table is computed during a run.

    48, or the first of `RESOLUTIONS` with three voxels across the wall at some densities. Raises
    `DensityError` if the walls are too thin for all of them.
    """
    for n in (ON_DEMAND_RESOLUTION, *RESOLUTIONS[:-1]):
        try:
            table_densities(cell, n, edges)
        except DensityError as error:
            log.info("not %d voxels: %s", n, error)
        else:
            return n
    table_densities(cell, RESOLUTIONS[-1], edges)
    return RESOLUTIONS[-1]


def computed_law(
    cell: Cell,
    poissons_ratio: float = 0.3,
    resolution: int | None = None,
    edges: Sequence[float] = CUBE,
    density: tuple[float, float] | None = None,
    on_row: RowListener | None = None,
) -> ScalingLaw:
    """Law of a cell that comes without a table, from the user's cache or computed now.

    Raises `DensityError`, `LatticeError` or `SolverError` as `compute_table`; `DensityError` also
    if the law would not meet ``density``, `SolverError` if stiffness or strength do not grow with
    density. Returns ScalingLaw: of kind ``computed``, named ``<family>-computed``.

    - ``poissons_ratio``: of the base material
    - ``resolution``: voxels along the cell, by default `on_demand_resolution`. The law's window
      begins where three of them span the thinnest wall.
    - ``edges (3,)``: of the cell, up to a factor: a cell of unequal edges is stiffer along the
      longer ones
    - ``density``: range of interest. The law need not cover all of it, but a range outside the
      law's is refused before anything is computed.
    - ``on_row``: as `compute_table`, where the law is computed
    """
    resolution = resolution or on_demand_resolution(cell, edges)
    if density is not None:
        _require_meeting(cell, resolution, edges, density)
    table = property_table(cell, poissons_ratio, resolution, edges, on_row)
    try:
        return tabulated_law(table)
    except ValueError as error:
        raise SolverError(
            f"no law follows from the computed properties of cell '{cell.name}' on "
            f"{resolution}^3 voxels: {error}"
        ) from error


def _require_meeting(
    cell: Cell,
    resolution: int,
    edges: Sequence[float],
    density: tuple[float, float],
) -> None:
    """Refuse densities that the law to be computed will not meet; a single one may be its end."""
    chosen = table_densities(cell, resolution, edges)
    low, high = chosen[0], chosen[-1]
    if density[0] > high + 1e-9 or density[1] < low - 1e-9:
        exists = cell.window
        raise DensityError(
            f"no law of cell '{cell.name}' can be computed for relative density {density[0]:g} "
            f"to {density[1]:g}: on {resolution}^3 voxels it reaches from {low:g} to {high:g}, and "
            f"the cell exists from {exists[0]:.3g} to {exists[1]:.3g}; change [lattice] density"
        )


def _stretch(edges: Sequence[float]) -> tuple[float, ...]:
    """Part of the key that only cells of unequal edges have."""
    return () if min(edges) == max(edges) else tuple(float(e) / min(edges) for e in edges)
