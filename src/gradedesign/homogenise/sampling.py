"""The grid of voxels of a cell at a relative density."""

from __future__ import annotations

import logging
from collections.abc import Mapping

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.cell.calibration import calibrate
from gradedesign.cell.family import CellFamily
from gradedesign.cell.shape import evaluate_shape
from gradedesign.cell.wall_size import wall_mm
from gradedesign.errors import DensityError

log = logging.getLogger(__name__)

#: Samples along each edge of a voxel.
SUBSAMPLES = 3
#: Voxels that the thinnest wall must have at least.
LEAST_VOXELS = 3.0
#: Mean difference of fill below which a cell of cubic symmetry is made exactly symmetric.
_ROUNDING = 2e-3


def cell_fill(
    family: CellFamily,
    parameters: Mapping[str, float] | None,
    rho: float,
    resolution: int,
    *,
    subsamples: int = SUBSAMPLES,
) -> FloatArray:
    """Sample a cell on voxels.

    Samples lie at the centres of the ``subsamples^3`` equal parts of each voxel. The level is the
    quantile of these very samples, so that the mean fill is ``rho`` to one sample.

    Parameters
    ----------
    family : CellFamily
    parameters : mapping of str to float or None
    rho : float
    resolution : int
        Voxels along each edge of the cell, or of its period where that is longer.
    subsamples : int
        1 gives voxels that are solid or void by their centre.

    Returns
    -------
    (N, N, N) array
        Solid share of each voxel.

    Raises
    ------
    DensityError
        If the cell does not exist at this density.
    """
    calibration = calibrate(family, parameters)
    calibration.level_of(rho)
    n = resolution * subsamples
    axis = (np.arange(n) + 0.5) / n * family.period
    value = np.zeros((n, n, n))
    # In slices: a shape function may need many times the memory of its result.
    step = max(1, 2_000_000 // n**2)
    for start in range(0, n, step):
        part = axis[start : start + step]
        u = np.stack(np.meshgrid(part, axis, axis, indexing="ij"))
        value[start : start + step] = evaluate_shape(family, calibration.parameters, u)
    rank = max(int(rho * n**3) - 1, 0)
    # Symmetric samples differ in the last digit; rounding keeps them on one side of the level.
    np.round(value, 12, out=value)
    level = np.partition(value, rank, axis=None)[rank]
    solid = value <= level
    shape = (resolution, subsamples) * 3
    fill = solid.reshape(shape).sum(axis=(1, 3, 5), dtype=np.int64) / subsamples**3
    return _symmetric(fill) if family.symmetry == "cubic" else fill


def _symmetric(fill: FloatArray) -> FloatArray:
    """Mean over the cycles of x, y, z where only rounding sets them apart."""
    turned = [fill, fill.transpose(1, 2, 0), fill.transpose(2, 0, 1)]
    apart = float(np.abs(turned[0] - turned[1]).mean())
    if apart == 0 or apart > _ROUNDING:
        return fill
    # An order of summation that is the same at all three places.
    low, middle, high = np.sort(np.stack(turned), axis=0)
    return np.asarray((low + middle + high) / 3)


def voxels_in_wall(
    family: CellFamily, parameters: Mapping[str, float] | None, rho: float, resolution: int
) -> float:
    """Voxels across the thinnest wall or strut."""
    return float(wall_mm(family, parameters, rho, 1.0)) * resolution / family.period


def require_resolved(
    family: CellFamily, parameters: Mapping[str, float] | None, rho: float, resolution: int
) -> None:
    """Refuse a grid on which the thinnest wall has fewer than `LEAST_VOXELS` voxels.

    Raises
    ------
    DensityError
        Saying which resolution would do.
    """
    found = voxels_in_wall(family, parameters, rho, resolution)
    if found < LEAST_VOXELS:
        need = "no resolution" if found <= 0 else f"{np.ceil(resolution * LEAST_VOXELS / found):g}"
        raise DensityError(
            f"cell '{family.name}' at density {rho:g} has {found:.2f} voxels across its thinnest "
            f"wall at resolution {resolution}, expected {LEAST_VOXELS:g} at least; take resolution "
            f"{need} or a higher density"
        )
