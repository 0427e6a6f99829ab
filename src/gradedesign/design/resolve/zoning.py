"""Zones of a part: cell, law and densities of each, and the transitions between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter

from gradedesign.arrays import Field, FloatArray, locked
from gradedesign.errors import DensityError
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.cells import Cells, largest_two
from gradedesign.geometry.cell.wall_size import wall_mm
from gradedesign.mechanics.homogenise.mix_factors import MixFactors
from gradedesign.mechanics.material.law_field import LawField
from gradedesign.mechanics.material.scaling_law import ScalingLaw


@dataclass(frozen=True, slots=True, kw_only=True)
class Zone:
    """Cell, law and bounds of one zone."""

    name: str
    cell: int  #: Number of its cell.
    #: Intersection of the density windows of user, cell, law and printer.
    bounds: tuple[float, float]
    elements_per_wall: float  #: Elements of the explicit analysis across the thinnest wall.
    members: bool  #: Whether solid members may lie in it.


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Zoning:
    """Zones with their weights; the first is the lattice outside every zone."""

    zones: tuple[Zone, ...]
    cells: Cells  #: Different ones, that of the first zone first.
    laws: tuple[ScalingLaw, ...]  #: Of the cells.
    weights: Field  #: Points ``(3, ...)`` mm to weights of the zones ``(Z, ...)``, together 1.
    factors: Mapping[tuple[int, int], MixFactors]  #: Of the cells that meet.
    #: Each ``(M,)``. Density bounds of every tetrahedron; None where they are the same everywhere.
    windows: tuple[FloatArray, FloatArray] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "factors", MappingProxyType(dict(self.factors)))
        if self.windows is not None:
            low, high = (locked(end, (None,), name="windows") for end in self.windows)
            object.__setattr__(self, "windows", (low, high))

    @property
    def member_weight(self) -> Field | None:
        """Weight of the zones that may hold solid members, which end where it is a half.

        Points ``(3, m)`` mm to ``(m,)``; None: members may lie everywhere.
        """
        may = np.array([float(zone.members) for zone in self.zones])
        return None if may.all() else lambda points: may @ self.weights(points)


def weights_of_cells(number: Sequence[int], weights: FloatArray) -> FloatArray:
    """Weights of cells ``(n, ...)`` from those of zones ``(Z, ...)`` and numbers of their cells."""
    total = np.zeros((1 + max(number), *weights.shape[1:]))
    for n, weight in zip(number, weights, strict=True):
        total[n] += weight
    return total


def zone_windows(zoning: Zoning, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Density bounds at points ``(3, m)`` mm, two ``(m,)``; empty ones where low exceeds high.

    Means of those of the zones by their weights; between different cells also within the windows
    of both laws and of the nearest mixes that were computed.
    """
    weights = zoning.weights(points)
    ends = np.array([zone.bounds for zone in zoning.zones])
    low, high = weights.T @ ends[:, 0], weights.T @ ends[:, 1]
    first, second, share = largest_two(weights_of_cells([z.cell for z in zoning.zones], weights))
    for (i, j), factors in zoning.factors.items():
        at = np.flatnonzero((first == i) & (second == j) & (share > 0) & (share < 1))
        below = _interval(factors, share[at])
        for n in (below, below + 1):
            low[at] = np.maximum(low[at], factors.low[n])
            high[at] = np.minimum(high[at], factors.high[n])
    return low, high


def node_windows(zoning: Zoning, nodes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Density bounds at the nodes of a grid ``(3, nx, ny, nz)`` mm, two ``(nx, ny, nz)``.

    Within those of the neighbours too, so that what lies between nodes keeps its bounds, unless
    that leaves nothing; beyond the part, where bounds may be empty, their middle.
    """
    low, high = (end.reshape(nodes.shape[1:]) for end in zone_windows(zoning, nodes.reshape(3, -1)))
    middle = 0.5 * (low + high)
    low, high = np.where(low > high, middle, low), np.where(low > high, middle, high)
    inner_low, inner_high = maximum_filter(low, size=3), minimum_filter(high, size=3)
    fits = inner_low <= inner_high
    return np.where(fits, inner_low, low), np.where(fits, inner_high, high)


def require_windows(
    zoning: Zoning, points: FloatArray, windows: tuple[FloatArray, FloatArray]
) -> None:
    """Refuse places where no density is allowed.

    Raises `DensityError`.
    """
    low, high = windows
    empty = low > high
    if not empty.any():
        return
    at = int(np.argmax(low - high))
    weights = zoning.weights(points[:, at : at + 1])[:, 0]
    names = [zone.name for zone, w in zip(zoning.zones, weights, strict=True) if w > 0]
    x, y, z = points[:, at]
    raise DensityError(
        f"between the zones {' and '.join(names)}, such as at ({x:.4g}, {y:.4g}, {z:.4g}) mm, "
        f"cells need a density of {low[at]:.3g} at least and {high[at]:.3g} at most; widen the "
        f"densities of these zones, or take cells that mix better"
    )


def zoned_laws(zoning: Zoning, points: FloatArray) -> LawField:
    """Laws of elements with their centres at points ``(3, M)`` mm."""
    if zoning.cells.weights is None:
        return LawField(laws=zoning.laws)
    weights = zoning.cells.weights(points)
    first, second, share = largest_two(weights)
    stiffness, strength = np.ones(share.size), np.ones(share.size)
    for (i, j), factors in zoning.factors.items():
        at = (first == i) & (second == j)
        stiffness[at] = np.interp(share[at], factors.share, factors.stiffness)
        strength[at] = np.interp(share[at], factors.share, factors.strength)
    return LawField(
        laws=zoning.laws, weights=weights, stiffness_factor=stiffness, strength_factor=strength
    )


def thinnest_feature(
    zoning: Zoning, points: FloatArray, density: FloatArray, size: float
) -> tuple[float, float]:
    """Thinnest wall or strut of a design, and the same over its elements, both mm.

    ``points (3, m)``, mm: that fill the lattice. ``density (m,)``: there. ``size``, mm: shortest
    extent of a cell.

    Returns
    -------
    (float, float)
        Thickness; element size with which the explicit analysis has its elements across every one.
        Between cells that of the nearest mixes counts, with the elements of the cell that needs
        more.
    """
    per_wall = [
        max(z.elements_per_wall for z in zoning.zones if z.cell == n)
        for n in range(len(zoning.laws))
    ]
    first, second, share = largest_two(zoning.cells.weights_at(points))
    alone = np.where(share > 0.5, second, first)
    walls = []
    for n, cell in enumerate(zoning.cells.members):
        pure = ((share <= 0) | (share >= 1)) & (alone == n)
        if pure.any():
            walls.append((_wall(cell, float(density[pure].min()), size), per_wall[n]))
    for (i, j), factors in zoning.factors.items():
        at = (first == i) & (second == j) & (share > 0) & (share < 1)
        below = _interval(factors, share)
        line = (zoning.cells.members[i], *factors.cells, zoning.cells.members[j])
        for n in np.unique(below[at]):
            least = float(density[at & (below == n)].min())
            thin = min(_wall(cell, least, size) for cell in line[n : n + 2])
            walls.append((thin, max(per_wall[i], per_wall[j])))
    return min(wall for wall, _ in walls), min(wall / count for wall, count in walls)


def _wall(cell: Cell, rho: float, size: float) -> float:
    """Thinnest wall at a density, mm; where a mix does not exist yet, at its least density."""
    return float(wall_mm(cell, float(np.clip(rho, *cell.window)), size))


def _interval(factors: MixFactors, share: FloatArray) -> np.ndarray:
    """Interval between shares that were computed."""
    interval = np.searchsorted(factors.share, share, side="right") - 1
    return np.clip(interval, 0, factors.share.size - 2)
