"""Tables of the stresses that buckle a cell, over its densities."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib import metadata

import numpy as np

from gradedesign import DensityError, SolverError
from gradedesign.commands import counted
from gradedesign.properties import LEAST_VOXELS, BucklingTable, Cell, voxels_in_wall
from gradedesign_laboratory.critical_stress import (
    BUCKLING_RESOLUTIONS,
    CriticalStress,
    critical_stress,
)

log = logging.getLogger(__name__)

#: Changes whenever the numbers do.
_BUCKLING_VERSION = 1
#: Thin cells, where buckling can come before yield; what is known of the densest serves above.
_BUCKLING_DENSITIES = (0.05, 0.1, 0.2, 0.3)


def compute_buckling(cell: Cell, *, poissons_ratio: float = 0.3) -> BucklingTable:
    """Compute the critical stresses of a cell, at the resolution that its wall needs.

    Densities are 0.05, 0.1, 0.2 and 0.3, as far as the thinnest wall has three voxels; those
    whose critical stresses do not settle are left out, with a warning in the log.

    Raises
    ------
    DensityError, LatticeError, SolverError
        As `critical_stress`; `DensityError` also if fewer than two densities are left.
    """
    finest = BUCKLING_RESOLUTIONS[-1]
    chosen = [d for d in _BUCKLING_DENSITIES if voxels_in_wall(cell, d, finest) >= LEAST_VOXELS]
    rows, refused = [], ""
    for rho in counted(chosen, f"buckling of {cell.name}, density", len(chosen)):
        try:
            row = critical_stress(cell, rho, poissons_ratio=poissons_ratio)
        except SolverError as error:
            refused = f"; at {rho:g}: {error}"
            log.warning("buckling of %s at density %g is left out: %s", cell.name, rho, error)
        else:
            rows.append(row)
    if len(rows) < 2:
        raise DensityError(
            f"critical stresses of cell '{cell.name}' are found at fewer than two of the "
            f"densities {list(_BUCKLING_DENSITIES)}: at others its walls have fewer than "
            f"{LEAST_VOXELS:g} voxels at resolution {finest}, or they do not settle{refused}"
        )
    return buckling_table(rows, poissons_ratio)


def buckling_table(rows: Sequence[CriticalStress], poissons_ratio: float) -> BucklingTable:
    """Join critical stresses of one cell, by increasing density.

    What a cell bears at least is raised to what it bears with less material; its material has
    yielded by then, as `critical_stress` says of such an entry.
    """
    critical = np.array([r.critical for r in rows])
    for k in range(1, len(rows)):
        least = rows[k].cells == 0
        critical[k][least] = np.maximum(critical[k], critical[k - 1])[least]
    return BucklingTable(
        density=np.array([r.density for r in rows]),
        critical=critical,
        cells=np.array([r.cells for r in rows]),
        error=np.array([r.error for r in rows]),
        resolution=np.array([r.resolution for r in rows]),
        wall_voxels=np.array([r.wall_voxels for r in rows]),
        poissons_ratio=poissons_ratio,
        method=(
            f"linear elastic buckling of one periodic cell of trilinear hexahedra, nu "
            f"{poissons_ratio:g}, weakest of the modes that repeat after one or two cells, "
            f"extrapolated from two grids; 0 cells: at least this"
        ),
        version=f"{metadata.version('gradedesign')} (method {_BUCKLING_VERSION})",
        date=datetime.now(tz=UTC).date().isoformat(),
    )
