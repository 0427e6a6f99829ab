"""Property tables: a cell's stiffness and strength over its window of densities."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from importlib import metadata
from typing import TypeAlias

import numpy as np

from gradedesign.common.system.progress import counted
from gradedesign.errors import DensityError
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.wall_size import density_for_wall, wall_mm
from gradedesign.mechanics.homogenise.cell_properties import (
    RESOLUTIONS,
    CellProperties,
    cell_properties,
    stretched_symmetry,
)
from gradedesign.mechanics.homogenise.sampling import (
    CUBE,
    LEAST_VOXELS,
    SUBSAMPLES,
    voxel_counts,
)
from gradedesign.mechanics.homogenise.strength import PERCENTILE
from gradedesign.mechanics.material.property_table import PropertyTable

log = logging.getLogger(__name__)

#: Hears of a row, its number and the number of rows.
RowListener: TypeAlias = Callable[[CellProperties, int, int], None]

#: Changes whenever the numbers do.
METHOD_VERSION = 3


#: With these the law is within 0.5 % in stiffness and 2 % in strength of rows left out between.
_DENSITIES = (0.05, 0.07, 0.1, 0.14, 0.2, 0.3, 0.4, 0.5, 0.65, 0.8)
#: Least density over that at which the solid falls apart. Chosen, not measured.
_ABOVE_FLOOR = 1.15


def compute_table(
    cell: Cell,
    *,
    densities: Sequence[float] | None = None,
    poissons_ratio: float = 0.3,
    resolution: int | None = None,
    on_row: RowListener | None = None,
    edges: Sequence[float] = CUBE,
) -> PropertyTable:
    """Compute the property table of a cell.

    Raises `DensityError`, `LatticeError` or `SolverError` as `cell_properties`.

    - ``densities``: by default `table_densities`
    - ``resolution``: of all rows; by default each row has the resolution that its wall needs
    - ``on_row``: called with each density's result, how many are done and how many there are
    - ``edges (3,)``: of the cell, up to a factor

    Examples
    --------
    >>> from gradedesign.geometry.cell.formula_cell import formula_cell
    >>> from gradedesign.geometry.cell.calibration import calibrate
    >>> family = formula_cell("p", formula="cos(2*pi*x) + cos(2*pi*y) + cos(2*pi*z)")
    >>> cell = calibrate(family, resolution=32)
    >>> table = compute_table(cell, densities=[0.4, 0.6], resolution=16)
    >>> table.density.tolist(), table.stiffness.shape
    ([0.4, 0.6], (2, 6, 6))
    """
    finest = resolution or RESOLUTIONS[-1]
    if densities is None:
        densities = table_densities(cell, finest, edges)
    rows: list[CellProperties] = []
    for rho in counted(densities, f"{cell.name}, density", len(densities)):
        row = cell_properties(
            cell,
            rho,
            poissons_ratio=poissons_ratio,
            resolution=resolution,
            edges=edges,
        )
        log.info("cell %s at %.3f: C11 %.5f", cell.name, rho, row.stiffness[0, 0])
        if on_row is not None:
            on_row(row, len(rows) + 1, len(densities))
        rows.append(row)
    return PropertyTable(
        name=f"{cell.name}-computed{'' if min(edges) == max(edges) else '-stretched'}",
        family=cell.name,
        parameters=cell.parameters,
        symmetry=stretched_symmetry(cell.family.symmetry, edges),
        poissons_ratio=poissons_ratio,
        density=np.array([r.density for r in rows]),
        stiffness=np.array([r.stiffness for r in rows]),
        stiffness_error=np.array([r.stiffness_error for r in rows]),
        uncertainty=np.array([r.uncertainty for r in rows]),
        strength=np.array([r.strength.strength for r in rows]),
        strength_error=np.array([r.strength_error for r in rows]),
        factors={
            **{n: np.array([r.strength.factor[n] for r in rows]) for n in rows[0].strength.factor},
            "hydrostatic": np.array([r.strength.hydrostatic for r in rows]),
        },
        surfaces=tuple(r.surface for r in rows if r.surface is not None),
        resolution=np.array([r.resolution for r in rows]),
        percentile=PERCENTILE,
        method=_method(poissons_ratio),
        version=f"{metadata.version('gradedesign')} (method {METHOD_VERSION})",
        date=datetime.now(tz=UTC).date().isoformat(),
    )


def table_densities(
    cell: Cell,
    resolution: int,
    edges: Sequence[float] = CUBE,
) -> tuple[float, ...]:
    """Densities of a table: closer together where the cell is thin.

    From 0.05, or where the thinnest wall has `LEAST_VOXELS` voxels, or 15 % above the density at
    which the solid falls apart, to 0.8, or where the void closes; the ends are rounded to a
    thousandth inwards. Nearer to falling apart, the last necks decide everything: a thousandth more
    density is several per cent more stiffness. Raises `DensityError` if fewer than two are left.
    """
    window = cell.window
    voxel = cell.family.period / min(voxel_counts(edges, resolution))
    window_top = float(wall_mm(cell, window[1], 1.0))
    if window_top < LEAST_VOXELS * voxel:
        need = "none will do"
        if window_top > 0.0:
            need = f"{2 * np.ceil(0.5 * resolution * LEAST_VOXELS * voxel / window_top):g}"
        raise DensityError(
            f"cell '{cell.name}' has {window_top / voxel:.2f} voxels across its thinnest wall at "
            f"resolution {resolution} and its highest density, {window[1]:.3f}; expected "
            f"{LEAST_VOXELS:g} at least; resolution needed: {need}"
        )
    thinnest = density_for_wall(cell, LEAST_VOXELS * voxel, 1.0)
    floor = max(thinnest, _ABOVE_FLOOR * window[0])
    lower = max(np.ceil(1000 * floor + 0.01) / 1000, _DENSITIES[0])
    upper = min(np.floor(1000 * window[1] - 0.01) / 1000, _DENSITIES[-1])
    inner = [d for d in _DENSITIES if 1.05 * lower < d < 0.97 * upper]
    chosen = (float(lower), *inner, float(upper))
    if lower >= upper:
        raise DensityError(
            f"cell '{cell.name}' has walls of {LEAST_VOXELS:g} voxels at resolution {resolution} "
            f"only from density {lower:.3f} on, but its void closes at {upper:.3f}; "
            f"take a higher resolution"
        )
    return chosen


def _method(poissons_ratio: float) -> str:
    """State how a table was made."""
    return (
        f"one periodic cell of trilinear hexahedra, each filled by {SUBSAMPLES}^3 samples, "
        f"nu {poissons_ratio:g}, stiffness extrapolated from two grids; strength from the "
        f"{PERCENTILE:g}th volume percentile of von Mises stress at voxel centres, worst of 63 "
        f"macroscopic stresses"
    )
