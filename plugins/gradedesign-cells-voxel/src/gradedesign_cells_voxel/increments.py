"""Cells from a library of increments, selected by a grey value or by the density.

Aremu et al. 2017, section 3.6: a cell changes in increments from one extreme to another, from a
straight strut to a helix or from thin to thick, and the grey value of an image selects one. Here
neighbouring increments are interpolated, so that any grey value has a cell.

Straight to helix, no increment contains the one before: each is a cell with all its densities,
among which the parameter ``grey`` selects (`cell_from_increments`). Thin to thick, each contains
the one before: one level holds them all, and the density selects (`cell_from_nested_increments`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

from gradedesign import CaseError, CellFamily, PluginError
from gradedesign.fields import Field, FloatArray, periodic_distance_to_level_set, periodic_spline
from gradedesign_cells_voxel.sampling import COUNT, spread
from gradedesign_cells_voxel.voxel_cell import Symmetry, VoxelReading, VoxelSurface, voxel_surface
from gradedesign_cells_voxel.voxels import VoxelSource

SOURCE = "library of increments (Aremu et al., Additive Manufacturing 13 (2017) 1-13, section 3.6)"

#: Grey value of the last increment: 8 bits.
_WHITE = 255.0


def cell_from_increments(
    increments: Sequence[Callable[[], Field]],
    *,
    name: str,
    grey: float = 0.0,
    symmetry: Symmetry = "none",
    source: str = "",
) -> CellFamily:
    """Make a family whose parameter ``grey``, 0 to 255, selects among increments of a cell.

    The shape is the density rank: the relative density at which an increment reaches a point,
    interpolated between the two neighbouring increments. At the grey values ``255 k / (n - 1)`` the
    cell of density rho is exactly that of increment k.

    Parameters
    ----------
    increments : sequence of callables
        Each without arguments, returning a shape function; called once, when first needed.
    grey : float
        Default of the parameter.
    symmetry : {"cubic", "tetragonal", "orthotropic", "none"}
        At the default.
    source : str
        What the increments are.

    Raises
    ------
    PluginError
        If there are fewer than two increments.
    """
    if len(increments) < 2:
        raise PluginError(f"cell '{name}': {len(increments)} increments, expected 2 or more")

    @cache
    def ranked(index: int) -> Field:
        return _density_rank(increments[index]())

    def shape(u: FloatArray, *, grey: float = grey) -> FloatArray:
        if not 0 <= grey <= _WHITE:
            raise CaseError(f"grey is {grey:g}, expected 0 to {_WHITE:g}")
        place = grey / _WHITE * (len(increments) - 1)
        first = min(int(place), len(increments) - 2)
        part = place - first
        if part == 0:
            return ranked(first)(u)
        if part == 1:
            return ranked(first + 1)(u)
        return np.asarray((1 - part) * ranked(first)(u) + part * ranked(first + 1)(u))

    return CellFamily(
        name=name,
        shape=shape,
        source=f"{source or 'increments'}; {SOURCE}",
        parameters={"grey": grey},
        symmetry=symmetry,
    )


def cell_from_nested_increments(
    increments: Sequence[VoxelSource],
    *,
    name: str,
    smooth: float | None = None,
    resolution: int = 64,
    tolerance: float = 0.01,
    symmetry: Symmetry = "none",
    source: str = "",
) -> CellFamily:
    """Make a family from voxels of a cell in increments, each containing the one before.

    The level is a density: at that of increment k the cell is increment k, between two increments
    it is interpolated, and beyond the ends it shrinks and grows evenly.

    Parameters
    ----------
    increments : sequence of paths or array_likes
        Two or more from thin to thick, see `read_voxels`, all of one shape.
    smooth : float, optional
        See `cell_from_voxels`.
    resolution : int
        Steps of the table.
    tolerance : float
        Share of the cell in which an increment may lack what the one before has.
    symmetry : {"cubic", "tetragonal", "orthotropic", "none"}
    source : str
        What the increments are.

    Raises
    ------
    PluginError
        If there are fewer than two increments; when first evaluated, if one cannot be read, does
        not repeat, or does not contain the one before.
    """
    if len(increments) < 2:
        raise PluginError(f"cell '{name}': {len(increments)} increments, expected 2 or more")

    @cache
    def field() -> Field:
        surfaces = [voxel_surface(voxels, VoxelReading(smooth=smooth)) for voxels in increments]
        return nested(surfaces, resolution, tolerance)

    return CellFamily(
        name=name,
        shape=lambda u: field()(u),
        source=f"{source or 'increments'}; {SOURCE}",
        symmetry=symmetry,
    )


def _density_rank(shape: Field) -> Field:
    """Relative density at which the solid of a shape function reaches a point, 0 to 1."""
    values = np.sort(shape(spread(COUNT)))
    rank = (np.arange(COUNT) + 0.5) / COUNT

    def evaluate(u: FloatArray) -> FloatArray:
        value = shape(u)
        # Beyond the samples the rank goes on rising, so that no values coincide.
        below, above = np.minimum(value - values[0], 0.0), np.maximum(value - values[-1], 0.0)
        return np.asarray(np.interp(value, values, rank) + below + above)

    return evaluate


def nested(surfaces: Sequence[VoxelSurface], resolution: int, tolerance: float) -> Field:
    """Tabulate one function whose levels hold all surfaces; see `cell_from_nested_increments`."""
    points = spread(COUNT)
    density = np.zeros(len(surfaces))
    before = np.zeros(COUNT, dtype=bool)
    for k, surface in enumerate(surfaces):
        solid = surface.function(points) <= 0
        lacking = float((before & ~solid).mean())
        if lacking > tolerance:
            raise PluginError(
                f"increment {k} lacks {lacking:.1%} of the cell that increments before it fill "
                f"(allowed {tolerance:.1%}); sort them from thin to thick, or let a parameter "
                f"select among cells with cell_from_increments"
            )
        before = before | solid
        density[k] = before.mean()
    thin, thick = (
        periodic_distance_to_level_set(surface.function, resolution=max(resolution // 2, 32))
        for surface in (surfaces[0], surfaces[-1])
    )
    # Density by distance at both ends, so that the level rises about as fast beyond them.
    slopes = [_slope(ends) for ends in (thin(points), thick(points))]

    def evaluate(u: FloatArray) -> FloatArray:
        level = density[-1] + slopes[1] * np.maximum(thick(u), 0.0)
        after = surfaces[-1].function(u)
        for k in range(len(surfaces) - 2, -1, -1):
            here = surfaces[k].function(u)
            reached = (here > 0) & (after <= 0)
            gap = np.where(reached, here - after, 1.0)
            between = density[k] + (density[k + 1] - density[k]) * here / gap
            level = np.where(reached, between, level)
            after = here
        first = density[0] + slopes[0] * np.minimum(thin(u), 0.0)
        return np.asarray(np.where(after <= 0, first, level))

    nodes = np.stack(np.meshgrid(*[np.arange(resolution) / resolution] * 3, indexing="ij"))
    return periodic_spline(evaluate(nodes))


def _slope(distance: FloatArray, reach: float = 0.02) -> float:
    """Density by distance at the surface of a distance's samples."""
    return float(np.mean(np.abs(distance) <= reach)) / (2 * reach)
