"""Connected components and narrowest neck of a transition between two cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt, label
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.errors import LatticeError
from gradedesign.geometry.cell.blend import Scale
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.cells import Cells, cell_pair

#: Pieces below this share of the solid are fragments that the grid makes. Chosen, not measured.
FRAGMENT_SHARE = 1e-3
#: Least area of solid across a transition, over its density, that is no bottleneck. Chosen, not
#: measured.
_LEAST_AREA = 0.15
_SHIFTS = (
    (0.0, 0.0, 0.0),
    (0.25, 0.25, 0.25),
    *((x, y, z) for x in (0.0, 0.5) for y in (0.0, 0.5) for z in (0.0, 0.5) if x + y + z),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Neck:
    """A transition measured on a bar of cells, periodic across."""

    #: Connected components of the solid, without fragments and without what only the ends cut off.
    components: int
    floating: float  #: Share of the solid in components that touch no end.
    #: cells. Diameter of the largest ball that passes from one pure end to the other inside the
    #: solid; 0 where the ends are not joined.
    width: float
    first_width: float  #: cells. The same of the pure families.
    second_width: float  #: cells. The same of the pure families.
    area: float  #: Smallest area of solid in a plane across the bar, over the specified density.
    place: float  #: cells. Where that plane lies, from the begin of the transition.


def measure_neck(
    pair: Cells,
    density: float,
    *,
    length: float = 2.0,
    resolution: int = 32,
) -> Neck:
    """Build a bar that passes from one family to the other, and measure it.

    A cell of each pure family stands before and after the transition.

    Raises LatticeError if a length is not positive.

    - ``pair``: two that pass into each other
    - ``density``: relative density
    - ``length``, cells: of the transition; the weight rises by 3 s^2 - 2 s^3
    - ``resolution``: grid points along a cell; a multiple of 4; widths are right to one grid step
    """
    if not (length > 0 and resolution >= 8):
        raise LatticeError(
            f"a bar of 1 + {length:g} + 1 cells at {resolution} points per cell cannot "
            f"be measured; expected positive lengths and at least 8 points"
        )
    x = np.arange(int(np.ceil((2 + length) * resolution)) + 1) / resolution
    values = _bar(pair, x, (x - 1) / length, resolution)
    solid = values <= pair.level_of(density)
    labels, count = _labels(solid)
    sizes = np.bincount(labels.ravel(), minlength=count + 1)[1:]
    at_ends = np.unique(np.concatenate([labels[0].ravel(), labels[-1].ravel()]))
    inner = np.setdiff1d(np.arange(1, count + 1), at_ends)
    total = int(sizes.sum())
    big = np.flatnonzero(sizes > FRAGMENT_SHARE * total) + 1
    main = int(np.argmax(sizes)) + 1 if count else 0
    through = _through(labels, main)
    # What the cut at an end parts from the rest is whole in the bar's continuation.
    cut_off = [n for n in big if n != main and not through and n in at_ends]
    disconnected = [n for n in big if n != main and n in inner]
    area = solid.mean(axis=(1, 2)) / density
    widths = [
        _width(_pure(pair, weight, resolution) <= density, resolution) for weight in (0.0, 1.0)
    ]
    return Neck(
        components=1 + len(disconnected) + len(cut_off),
        floating=float(sizes[inner - 1].sum() / total) if inner.size else 0.0,
        width=_width(solid, resolution),
        first_width=widths[0],
        second_width=widths[1],
        area=float(area.min()),
        place=float(x[int(area.argmin())] - 1),
    )


def joining_shift(
    first: Cell,
    second: Cell,
    density: float,
    *,
    scale: Scale = "rank",
    length: float = 2.0,
    resolution: int = 24,
) -> tuple[float, float, float]:
    """Shift of the second family, in cells, with which the transition is one connected component.

    None where that joins them well: a neck of at least half the thinner family's, through planes
    with at least `_LEAST_AREA` of the specified solid. Else the one of half or quarter cells with
    the widest neck.

    Raises LatticeError if no shift makes one piece.
    """
    best: tuple[float, float, float] | None = None
    widest = (False, 0.0, 0.0)
    for shift in _SHIFTS:
        pair = cell_pair(first, second, scale=scale, shift=shift)
        neck = measure_neck(pair, density, length=length, resolution=resolution)
        if neck.components == 1 and neck.width > 0:
            thinner = min(neck.first_width, neck.second_width)
            if not any(shift) and neck.width >= 0.5 * thinner and neck.area >= _LEAST_AREA:
                return shift
            rank = (neck.area >= _LEAST_AREA, neck.width, neck.area)
            if rank > widest:
                best, widest = shift, rank
    if best is None:
        raise LatticeError(
            f"a transition of {length:g} cells from '{first.name}' to "
            f"'{second.name}' at density {density:.3g} falls apart however they are moved; "
            f"use a higher density, a longer transition or other families"
        )
    return best


def _bar(pair: Cells, x: FloatArray, share: FloatArray, resolution: int) -> FloatArray:
    """Values of a bar of one cell across, ``(nx, n, n)``."""
    s = np.clip(share, 0.0, 1.0)
    # Nodes at simple fractions of the cell, where struts and sheets have their middle.
    across = np.arange(resolution) / resolution
    nodes = np.stack(np.meshgrid(x, across, across, indexing="ij"))
    weight = np.broadcast_to((s**2 * (3 - 2 * s))[:, None, None], nodes.shape[1:])
    return pair.shape(np.concatenate([nodes, 1 - weight[None], weight[None]]))


def _pure(pair: Cells, weight: float, resolution: int) -> FloatArray:
    x = np.arange(2 * resolution + 1) / resolution
    return _bar(pair, x, np.full(len(x), weight), resolution)


def _labels(solid: BoolArray) -> tuple[IntArray, int]:
    """Number of the connected component of every voxel of a bar that is periodic across."""
    labels, count = label(solid)
    sides = ((labels[:, 0], labels[:, -1]), (labels[:, :, 0], labels[:, :, -1]))
    low, high = (np.concatenate([pair[k].ravel() for pair in sides]) for k in (0, 1))
    both = (low > 0) & (high > 0)
    joined = csr_array((both[both], (low[both], high[both])), shape=(count + 1, count + 1))
    count, component = connected_components(joined, directed=False)
    return component[labels].astype(np.int64), int(count) - 1  # 0, the void, is joined to nothing


def _through(labels: IntArray, piece: int) -> bool:
    return bool(piece and (labels[0] == piece).any() and (labels[-1] == piece).any())


def _width(solid: BoolArray, resolution: int) -> float:
    """Diameter of the largest ball that passes from one end to the other, cells."""
    n = solid.shape[1] // 2
    around = np.pad(solid, ((0, 0), (n, n), (n, n)), mode="wrap")
    depth = distance_transform_edt(np.pad(around, ((1, 1), (0, 0), (0, 0)), mode="edge"))
    depth = depth[1:-1, n:-n, n:-n]
    levels = np.unique(depth[solid])
    low, high = -1, len(levels)  # joined at levels[low], parted at levels[high]
    while high - low > 1:
        middle = (low + high) // 2
        labels, count = _labels(depth >= levels[middle])
        ends = np.intersect1d(labels[0], labels[-1])
        joined = count > 0 and bool((ends > 0).any())
        low, high = (middle, high) if joined else (low, middle)
    return 0.0 if low < 0 else float(2 * levels[low] - 1) / resolution
