"""Finite-size ratios of a cell family over density, as a table with its errors."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from importlib import metadata

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.cell.calibration import calibrate
from gradedesign.cell.family import CellFamily
from gradedesign.cell.shape import complete_parameters
from gradedesign.errors import DensityError, SolverError
from gradedesign.homogenise.finite_size import FiniteSize, finite_size
from gradedesign.homogenise.sampling import LEAST_VOXELS, cell_fill, voxels_in_wall
from gradedesign.material.finite_size_table import FiniteRatio, FiniteSizeRow, FiniteSizeTable
from gradedesign.workspace.progress import counted

log = logging.getLogger(__name__)

#: Changes whenever a table would come out otherwise.
METHOD_VERSION = 1
#: Densities of a table, as far as the family and the finest grid reach.
DENSITIES = (0.1, 0.2, 0.3, 0.5, 0.7)
#: Voxels along a cell; a density takes the first with three of them across the thinnest wall.
RESOLUTIONS = (24, 36)
#: Cells along the edges of blocks and across walls; and at one density, where the coarser of the
#: grids serves, more of them, to show how far a line in one over their number holds: a block of two
#: costs eight times one of one.
COUNTS = (1,)
MORE_COUNTS, MORE_AT = (1, 2), 0.3
#: Residual of the solves, and what it does to an extrapolated ratio at most (2e-4 of one block of
#: the gyroid sheet at 0.5, five times that by extrapolation); part of the stated error.
RTOL, SOLVE_ERROR = 1e-2, 1e-3
#: Ratios of the two beginnings of a cell that differ by less on the coarser grid are one.
_SAME = 1e-3


def finite_size_table(
    family: CellFamily,
    *,
    poissons_ratio: float = 0.3,
    densities: Sequence[float] = DENSITIES,
    on_row: Callable[[FiniteSizeRow], None] | None = None,
) -> FiniteSizeTable:
    """Finite-size ratios of a family with its default parameters.

    Parameters
    ----------
    family : CellFamily
        Of cubic symmetry: blocks are loaded along x, walls lie across z.
    poissons_ratio : float
        Of the base material.
    densities : sequence of float
        Those that the family has, with walls that the finest grid resolves, are computed.
    on_row : callable, optional
        Called with each row.

    Returns
    -------
    FiniteSizeTable

    Raises
    ------
    DensityError
        If fewer than two densities are left.
    LatticeError, SolverError
        As `finite_size`; `SolverError` also for a family that is not cubic.
    """
    if family.symmetry != "cubic":
        raise SolverError(
            f"finite-size ratios are computed along x and across z only, but cell '{family.name}' "
            f"is of symmetry '{family.symmetry}'; expected cubic"
        )
    low, high = calibrate(family).window
    found = [(rho, resolution_for(family, rho)) for rho in densities if low <= rho <= high]
    usable = [(rho, n) for rho, n in found if n is not None]
    if len(usable) < 2:
        raise DensityError(
            f"cell '{family.name}' has walls of {LEAST_VOXELS:g} voxels at resolution "
            f"{RESOLUTIONS[-1]} at {len(usable)} of the densities {list(densities)}; expected two"
        )
    rows = []
    for rho, resolution in counted(usable, "density", len(usable)):
        more = rho == MORE_AT and resolution == RESOLUTIONS[0]
        counts = MORE_COUNTS if more else COUNTS
        row = finite_size_row(family, rho, resolution, counts=counts, poissons_ratio=poissons_ratio)
        log.info("cell %s at %.3f: block of one cell %.4f", family.name, rho, row.block[0].value)
        if on_row is not None:
            on_row(row)
        rows.append(row)
    return FiniteSizeTable(
        family=family.name,
        parameters=complete_parameters(family, None),
        poissons_ratio=poissons_ratio,
        rows=tuple(rows),
        method=(
            f"trilinear hexahedra on filled voxels, nu {poissons_ratio:g}, over the periodic value "
            f"of the same voxels; blocks between smooth plates, sides free; walls across z, faces "
            f"free; extrapolated from the stated resolution and two thirds of it, error first "
            f"order in the voxel; mean of cells begun at their corner and half a cell in"
        ),
        version=f"{metadata.version('gradedesign')} (method {METHOD_VERSION})",
        date=datetime.now(tz=UTC).date().isoformat(),
    )


def resolution_for(family: CellFamily, rho: float) -> int | None:
    """Voxels along a cell that put three across its thinnest wall; None if too many."""
    for resolution in RESOLUTIONS:
        if voxels_in_wall(calibrate(family), rho, resolution) >= LEAST_VOXELS:
            return resolution
    return None


def finite_size_row(
    family: CellFamily,
    rho: float,
    resolution: int,
    *,
    counts: Sequence[int] = COUNTS,
    poissons_ratio: float = 0.3,
) -> FiniteSizeRow:
    """Ratios at one density, from ``resolution`` voxels along the cell and two thirds of them.

    Free faces bend what they cut, which voxels follow to first order only (block of one gyroid
    sheet cell at 0.3: 0.718, 0.702, 0.694 with 32, 48, 64 voxels), so twice the change from the
    coarser grid is added.

    Parameters
    ----------
    family : CellFamily
    rho : float
    resolution : int
        A multiple of 12.
    counts : sequence of int
        Cells along the edges of blocks and across walls.
    poissons_ratio : float

    Returns
    -------
    FiniteSizeRow
    """
    if resolution % 12:
        raise SolverError(f"found {resolution} voxels along a cell; expected a multiple of 12")
    coarse, fine = (cell_fill(calibrate(family), rho, n) for n in (2 * resolution // 3, resolution))
    coarser = [_ratios(coarse, start, counts, poissons_ratio) for start in (0, 1)]
    starts = (0, 1) if _apart(coarser) > _SAME else (0,)
    finer = [_ratios(fine, start, counts, poissons_ratio) for start in starts]

    def series(key: str, cells: Sequence[int]) -> tuple[FiniteRatio, ...]:
        a = np.array([getattr(coarser[s], key) for s in starts])
        b = np.array([getattr(f, key) for f in finer])
        # Linear in the voxel's edge, of 3 and 2 to nothing.
        value, change = 3 * b - 2 * a, np.abs(b - a)
        return tuple(
            FiniteRatio(
                cells=n,
                value=float(value[:, i].mean()),
                error=float(change[:, i].max()) + SOLVE_ERROR,
                spread=float(0.5 * np.ptp(value[:, i])),
            )
            for i, n in enumerate(cells)
        )

    return FiniteSizeRow(
        density=rho,
        resolution=resolution,
        block=series("block", counts),
        wall=series("wall_youngs", counts),
        wall_shear=series("wall_shear", counts),
    )


def _ratios(
    fill: FloatArray, start: int, counts: Sequence[int], poissons_ratio: float
) -> FiniteSize:
    """Ratios of cells that begin at their corner (0) or half a cell in (1)."""
    half = fill.shape[0] // 2 if start else 0
    begun = np.roll(fill, (half, half, half), (0, 1, 2))
    return finite_size(begun, counts, walls=counts, poissons_ratio=poissons_ratio, rtol=RTOL)


def _apart(found: Sequence[FiniteSize]) -> float:
    """Largest difference between the ratios of the two beginnings."""
    return max(
        float(np.abs(getattr(found[0], key) - getattr(found[1], key)).max())
        for key in ("block", "wall_youngs", "wall_shear")
    )
