"""A cell family from voxels: binary, grey or a stack of slices."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from scipy.ndimage import gaussian_filter

from gradedesign import CellFamily, PluginError
from gradedesign.fields import Field, Interpolation, periodic_distance_to_level_set, periodic_spline
from gradedesign_cells_voxel.sampling import COUNT, require_volume, spread
from gradedesign_cells_voxel.voxels import (
    VoxelSource,
    drop_repeated_ends,
    read_voxels,
    require_periodic,
)

Symmetry = Literal["cubic", "tetragonal", "orthotropic", "none"]

#: Width in voxels of the filter for voxels of two values.
SMOOTH = 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VoxelSurface:
    """The surface that voxels describe.

    Attributes
    ----------
    function : callable
        Points ``(3, ...)`` in cell units to ``(...)``, negative inside, smooth, period 1; no
        distance.
    density : float
        Share of the cell that is solid.
    steps : int
        Most voxels along an axis.
    """

    function: Field
    density: float
    steps: int


@dataclass(frozen=True, slots=True, kw_only=True)
class VoxelReading:
    """Options for turning voxels into a surface.

    Attributes
    ----------
    level : float, optional
        Values above are solid; half-way between the least and the largest unless given.
    smooth : float, optional
        Width (standard deviation) in voxels of a filter against steps, which keeps the volume;
        1 for voxels of two values and none for grey ones unless given. Features of less than about
        two widths are lost.
    endpoint : bool
        True if the last plane along each axis repeats the first, as in samples from 0 to 2 pi
        inclusive. Values then lie on the planes, else in the middle of voxels.
    interpolation : {"cubic", "linear"}
        Of the values between voxels.
    tolerance : float
        Share of opposite faces that may differ, see `require_periodic`.
    """

    level: float | None = None
    smooth: float | None = None
    endpoint: bool = False
    interpolation: Interpolation = "cubic"
    tolerance: float = 0.02


def cell_from_voxels(
    voxels: VoxelSource,
    *,
    name: str,
    reading: VoxelReading = VoxelReading(),
    resolution: int | None = None,
    symmetry: Symmetry = "none",
    source: str = "",
) -> CellFamily:
    """Make a cell family of the voxels of one cell.

    The shape is the signed distance to the surface of the voxels, negative inside, of period 1:
    level 0 is the cell as given, others grow and shrink it evenly. Everything is read, checked and
    tabulated when the shape is first evaluated; errors come then.

    Parameters
    ----------
    voxels : path or array_like
        See `read_voxels`. A cell of unequal edges is stretched to the unit cube, distances too.
    resolution : int, optional
        Steps of the table of distances; twice the voxels, 32 to 64, unless given.
    symmetry : {"cubic", "tetragonal", "orthotropic", "none"}
        Of the stiffness, if known; the conformance kit checks it.
    source : str
        Where the voxels come from.

    Examples
    --------
    >>> axis = (np.arange(24) + 0.5) / 24
    >>> x, y, z = np.cos(2 * np.pi * np.stack(np.meshgrid(axis, axis, axis)))
    >>> family = cell_from_voxels(x + y + z > 0, name="my-cell", symmetry="cubic")
    >>> bool(family.shape(np.array([0.5, 0.5, 0.5])) > 0)
    True
    """

    @cache
    def distance() -> Field:
        surface = voxel_surface(voxels, reading)
        steps = min(max(2 * surface.steps, 32), 64) if resolution is None else resolution
        field = periodic_distance_to_level_set(surface.function, resolution=steps)
        require_volume(field, surface.density, steps)
        return field

    return CellFamily(
        name=name,
        shape=lambda u: distance()(u),
        source=source or "voxels of one cell (Aremu et al., Additive Manufacturing 13 (2017) 1-13)",
        symmetry=symmetry,
    )


def voxel_surface(
    voxels: VoxelSource,
    reading: VoxelReading = VoxelReading(),
) -> VoxelSurface:
    """Read voxels, check that they repeat, and interpolate them; see `cell_from_voxels`.

    Raises
    ------
    PluginError
        If the voxels cannot be read, do not repeat, or hold no surface at the level.
    """
    values = read_voxels(voxels)
    if reading.endpoint:
        values = drop_repeated_ends(values)
    low, high = float(values.min()), float(values.max())
    limit = 0.5 * (low + high) if reading.level is None else reading.level
    solid = values > limit
    if not solid.any() or solid.all():
        raise PluginError(
            f"no voxel boundary at level {limit:g}: the values lie between {low:g} and {high:g}"
        )
    require_periodic(solid, reading.tolerance)
    two = np.unique(values).size == 2
    width = reading.smooth if reading.smooth is not None else SMOOTH if two else 0.0
    if not 0 <= width <= 0.2 * min(values.shape):
        raise PluginError(
            f"smooth is {width:g} voxels, expected 0 to {0.2 * min(values.shape):g}, a fifth of "
            f"the cell"
        )
    if width:
        values = gaussian_filter(values, width, mode="wrap")
    start = 0.0 if reading.endpoint else 0.5
    between = periodic_spline(values, start=start, interpolation=reading.interpolation)
    sample = between(spread(COUNT))
    if two:
        # A filter shrinks what is convex; the level that keeps the volume makes up for it.
        limit = float(np.quantile(sample, 1 - solid.mean()))
    return VoxelSurface(
        function=lambda u: limit - between(u),
        density=float((sample > limit).mean()),
        steps=max(values.shape),
    )
