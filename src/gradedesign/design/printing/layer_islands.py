"""Islands of a print: regions of a layer that nothing below them holds."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import binary_dilation, label

from gradedesign.arrays import BoolArray, IntArray
from gradedesign.geometry.triangles.grid_classifier import VoxelGrid

#: Pixels that touch by an edge or a corner hold each other, in a layer and from the one below.
_TOUCHING = np.ones((3, 3), dtype=bool)


@dataclass(frozen=True, slots=True, kw_only=True)
class WorstIsland:
    """The island of the largest volume until something held joins it."""

    at_mm: tuple[float, float, float]  #: Middle of its first layer.
    area_mm2: float  #: Of that layer.
    height_mm: float  #: Up to the layer that joins it to what stands on the plate.
    volume_mm3: float  #: Up to there.


@dataclass(frozen=True, slots=True, kw_only=True)
class LayerIslands:
    """Islands of all layers."""

    #: Height of a layer and edge of a pixel: one pixel is how far a layer may reach out.
    step_mm: float
    count: int
    area_mm2: float  #: Of the first layers of all of them.
    worst: WorstIsland | None


@dataclass(slots=True)
class _Island:
    """An island while the layers above it are built."""

    first: int
    area: int
    middle: tuple[float, float]
    volume: int = 0
    last: int = 0
    into: int = field(default=0)


def layer_islands(solid: BoolArray, grid: VoxelGrid) -> LayerIslands:
    """Find regions of a layer without material below them, or beside that within one pixel.

    All of the lowest layer stands on the plate.

    ``solid``, (nx, ny, nz) bool array: layers along the last axis.
    """
    islands: list[_Island] = []
    before = np.zeros(solid.shape[:2], dtype=np.int64)  # -1 held, n the n-th island
    started = False
    for k in range(solid.shape[2]):
        layer = solid[:, :, k]
        if not layer.any():
            before[:] = 0
            continue
        if not started:
            started, before = True, np.where(layer, -1, 0)
            continue
        before = _next_layer(layer, before, islands, k)
    return _summary(islands, grid)


def _next_layer(layer: BoolArray, before: IntArray, islands: list[_Island], k: int) -> IntArray:
    """Owner of every pixel of a layer: -1 supported, n in the n-th island, 0 in voids."""
    regions, count = label(layer, structure=_TOUCHING)
    supported = np.zeros(count + 1, dtype=bool)
    supported[np.unique(regions[binary_dilation(before == -1, structure=_TOUCHING)])] = True
    owner = np.where(supported, -1, 0)
    owner[0] = 0
    touched: dict[int, set[int]] = {}
    for n in np.unique(before[before > 0]).tolist():
        near = binary_dilation(before == n, structure=_TOUCHING)
        for region in np.unique(regions[near & layer]).tolist():
            touched.setdefault(region, set()).add(n)
    size = np.bincount(regions.ravel(), minlength=count + 1)
    loose = set(np.flatnonzero(~supported[1:]) + 1)
    for region, islands_below in touched.items():
        if region in loose:
            first = min(islands_below)
            owner[region] = first
            islands[first - 1].volume += int(size[region])
            islands[first - 1].last = k
            for other in islands_below - {first}:
                islands[other - 1].into = first
            loose.discard(region)
    for region in sorted(loose):
        x, y = np.nonzero(regions == region)
        islands.append(
            _Island(
                first=k,
                area=len(x),
                middle=(float(x.mean()), float(y.mean())),
                volume=len(x),
                last=k,
            )
        )
        owner[region] = len(islands)
    return np.asarray(owner[regions])


def _summary(islands: list[_Island], grid: VoxelGrid) -> LayerIslands:
    h = grid.step
    for island in reversed(islands):
        if island.into:
            islands[island.into - 1].volume += island.volume
    worst = max(islands, key=lambda island: island.volume, default=None)
    return LayerIslands(
        step_mm=h,
        count=len(islands),
        area_mm2=sum(island.area for island in islands) * h**2,
        worst=None
        if worst is None
        else WorstIsland(
            at_mm=grid.place(np.array([*worst.middle, worst.first])),
            area_mm2=worst.area * h**2,
            height_mm=(worst.last + 1 - worst.first) * h,
            volume_mm3=worst.volume * h**3,
        ),
    )
