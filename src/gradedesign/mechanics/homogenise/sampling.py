"""The grid of voxels of a cell at a relative density."""

from __future__ import annotations

import logging
from collections.abc import Sequence

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.errors import DensityError, SolverError
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.shape import evaluate_shape
from gradedesign.geometry.cell.wall_size import wall_mm

log = logging.getLogger(__name__)

#: Samples along each edge of a voxel. Chosen, not measured.
SUBSAMPLES = 3
#: Voxels that the thinnest wall must have at least: rows of older tables with three to six across a
#: strut are up to 10 % too stiff.
LEAST_VOXELS = 3.0
#: Edges of a cell that is a cube.
CUBE = (1.0, 1.0, 1.0)
#: Edges of the voxel grid may be out of proportion by this: about its error in stiffness.
_EDGE_MISFIT = 5e-3
#: Misfit below which no better numbers are looked for. Chosen, not measured.
_GOOD_FIT = 1e-3
#: Mean difference of fill below which a cell of cubic symmetry is made exactly symmetric. Chosen,
#: not measured.
_ROUNDING = 2e-3


def cell_fill(
    cell: Cell,
    rho: float,
    resolution: int,
    *,
    subsamples: int = SUBSAMPLES,
    edges: Sequence[float] = CUBE,
    share_ties: bool | None = None,
) -> FloatArray:
    """Sample a cell on cubic voxels.

    Samples lie at the centres of the ``subsamples^3`` equal parts of each voxel. The level is the
    quantile of these very samples, so that the mean fill is ``rho``. Raises `DensityError` if the
    cell does not exist at this density. Returns ``(N, N, N)``: solid volume fraction of each voxel;
    of the shape `voxel_counts` where edges differ.

    - ``rho``: relative density
    - ``resolution``: voxels along each edge of the cell, or of its period where that is longer
    - ``subsamples``: 1 gives voxels that are solid or void by their centre
    - ``edges (3,)``: of the cell, up to a factor: see `voxel_counts`
    - ``share_ties``: count samples that lie at the level in part, so that the mean fill is ``rho``;
      by default where voxels may be filled in part (``subsamples`` above 1). A strut cell has many
      such samples: without, its mean fill is up to a tenth off.

    Examples
    --------
    >>> from gradedesign.geometry.cell.formula_cell import formula_cell
    >>> from gradedesign.geometry.cell.calibration import calibrate
    >>> family = formula_cell("p", formula="cos(2*pi*x) + cos(2*pi*y) + cos(2*pi*z)")
    >>> cell = calibrate(family, resolution=32)
    >>> cell_fill(cell, 0.3, 8).shape, round(float(cell_fill(cell, 0.3, 8).mean()), 3)
    ((8, 8, 8), 0.3)
    """
    if share_ties is None:
        share_ties = subsamples > 1
    cell.level_of(rho)
    counts = voxel_counts(edges, resolution)
    n = tuple(c * subsamples for c in counts)
    axes = [(np.arange(m) + 0.5) / m * cell.family.period for m in n]
    value = np.zeros(n)
    # In slices: a shape function may need many times the memory of its result.
    step = max(1, 2_000_000 // (n[1] * n[2]))
    for start in range(0, n[0], step):
        u = np.stack(np.meshgrid(axes[0][start : start + step], *axes[1:], indexing="ij"))
        value[start : start + step] = evaluate_shape(cell.family, cell.parameters, u)
    # Shared, the last sample counts as far as the density asks; else it must not exceed it.
    wanted = rho * value.size
    rank = max(int(np.ceil(wanted) if share_ties else wanted) - 1, 0)
    # Symmetric samples differ in the last digit; rounding keeps them on one side of the level.
    np.round(value, 12, out=value)
    level = np.partition(value, rank, axis=None)[rank]
    fill = _counted(value <= level, counts, subsamples)
    if share_ties:
        without = _counted(value < level, counts, subsamples)
        less, whole = np.count_nonzero(value < level), np.count_nonzero(value <= level)
        # Rounding in the number wanted must not take the share past all of them.
        share = min((wanted - less) / (whole - less), 1.0)
        fill = without + share * (fill - without)
    return _symmetric(fill) if cell.family.symmetry == "cubic" and len(set(counts)) == 1 else fill


def _counted(solid: BoolArray, counts: tuple[int, int, int], subsamples: int) -> FloatArray:
    """Share of solid samples in every voxel."""
    shape = tuple(m for c in counts for m in (c, subsamples))
    share = solid.reshape(shape).sum(axis=(1, 3, 5), dtype=np.int64) / subsamples**3
    return np.asarray(share)


def voxel_counts(edges: Sequence[float], resolution: int) -> tuple[int, int, int]:
    """Cubic voxels along the edges of a cell whose mean edge has about ``resolution`` of them.

    Even numbers, so that half of them make the coarser grid: the nearest to ``resolution e_i / (e_1
    e_2 e_3)^(1/3)`` that fit within `_GOOD_FIT`, else those of 0.9 to 1.4 times the resolution that
    fit best. Equal edges have ``resolution`` each. Raises `SolverError` if no numbers fit the
    proportion within `_EDGE_MISFIT`.

    ``edges (3,)``: up to a factor.
    """
    lengths = np.asarray(edges, dtype=np.float64)
    if np.ptp(lengths) == 0:
        return resolution, resolution, resolution
    relative = lengths / np.prod(lengths) ** (1 / 3)
    best, chosen = np.inf, np.zeros(3)
    scales = resolution * np.linspace(0.9, 1.4, 1001)
    for scale in scales[np.argsort(np.abs(np.log(scales / resolution)), kind="stable")]:
        counts = np.maximum(2 * np.round(0.5 * scale * relative), 4)
        misfit = float(np.ptp(np.log(counts / relative)))
        if misfit < best:
            best, chosen = misfit, counts
        if best <= _GOOD_FIT:
            break
    if best > _EDGE_MISFIT:
        raise SolverError(
            f"a cell with edges in proportion {' : '.join(f'{e:g}' for e in relative)} does not "
            f"fit cubic voxels at resolution {resolution} better than {100 * best:.2g} %, at most "
            f"{100 * _EDGE_MISFIT:g} % is taken; use edges that differ less"
        )
    x, y, z = (int(c) for c in chosen)
    return x, y, z


def _symmetric(fill: FloatArray) -> FloatArray:
    """Average values over the cyclic permutations of x, y, z if only rounding separates them."""
    turned = [fill, fill.transpose(1, 2, 0), fill.transpose(2, 0, 1)]
    apart = float(np.abs(turned[0] - turned[1]).mean())
    if apart == 0 or apart > _ROUNDING:
        return fill
    # An order of summation that is the same at all three places.
    low, middle, high = np.sort(np.stack(turned), axis=0)
    return np.asarray((low + middle + high) / 3)


def voxels_in_wall(
    cell: Cell,
    rho: float,
    resolution: int,
    edges: Sequence[float] = CUBE,
) -> float:
    """Voxels across the thinnest wall or strut, at least: walls across the shortest edge.

    Examples
    --------
    >>> from gradedesign.geometry.cell.formula_cell import formula_cell
    >>> from gradedesign.geometry.cell.calibration import calibrate
    >>> family = formula_cell("p", formula="cos(2*pi*x) + cos(2*pi*y) + cos(2*pi*z)")
    >>> cell = calibrate(family, resolution=32)
    >>> voxels_in_wall(cell, 0.3, 48) > 3
    True
    """
    along = min(voxel_counts(edges, resolution))
    return float(wall_mm(cell, rho, 1.0)) * along / cell.family.period


def require_resolved(
    cell: Cell,
    rho: float,
    resolution: int,
    edges: Sequence[float] = CUBE,
) -> None:
    """Refuse a grid on which the thinnest wall has fewer than `LEAST_VOXELS` voxels.

    Raises `DensityError` saying which resolution would do.

    Examples
    --------
    >>> from gradedesign.geometry.cell.formula_cell import formula_cell
    >>> from gradedesign.geometry.cell.calibration import calibrate
    >>> family = formula_cell("p", formula="cos(2*pi*x) + cos(2*pi*y) + cos(2*pi*z)")
    >>> cell = calibrate(family, resolution=32)
    >>> require_resolved(cell, 0.3, 48)
    """
    voxels = voxels_in_wall(cell, rho, resolution, edges)
    if voxels < LEAST_VOXELS:
        # A grid of half as many voxels is extrapolated from, for buckling an even one.
        enough = 4 * np.ceil(0.25 * resolution * LEAST_VOXELS / voxels) if voxels > 0 else 0
        need = f"{enough:g}" if enough else "no resolution"
        raise DensityError(
            f"cell '{cell.name}' at density {rho:g} has {voxels:.2f} voxels across its thinnest "
            f"wall at resolution {resolution}, expected {LEAST_VOXELS:g} at least; take resolution "
            f"{need} or a higher density"
        )
