"""Level of a mix of cells where its share changes within a cell.

A mix that is calibrated for every share has its density over cells of one share. Where the share
changes within a cell, its two ends belong to different mixes, and a cell whose solid lies at one
end and not in its middle comes out denser or lighter: by 7 % over two cells. So the level is found
from place to place. How much of every small block of a cell is solid at a level, for every share,
is tabulated once. With the share of every block of the lattice the table gives the solid of every
cell, and the levels in their middles, linear in between, are changed until it is what was stated.

That holds for whole cells. Half cells keep what the mix makes of them, and so do cells that begin
elsewhere: a level that changes slowly over a cell cannot say how a cell's halves share its solid.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from gradedesign.arrays import BoolArray, FloatArray, IntArray, lock
from gradedesign.errors import ResourceError
from gradedesign.geometry.cell.shape import spread_points
from gradedesign.geometry.lattice._density_kernels import trilinear

log = logging.getLogger(__name__)

#: Blocks along an edge of a cell, and of one of a long period, whose table is as many times larger.
#: With 8, layers of two cells from `diamond-network` to `octet` at 0.15 kept 1.1 % of error.
BLOCKS, _BLOCKS_OF_LONG_PERIODS = 12, 4
#: Samples along an edge of a block; levels and shares between 0 and 1 that are tabulated. Chosen,
#: not measured.
SAMPLES, LEVELS, SHARES = 4, 257, 17
#: Rounds in which levels are changed, at most, and the error at which they end. Chosen, not
#: measured.
ROUNDS, SETTLED = 60, 1e-3
#: Growth of a cell's solid with its level, 1 on the whole, that a change counts on at least.
#: Chosen, not measured.
_LEAST_RISE = 0.1
#: Memory of a block while levels are found, bytes.
_BYTES_PER_BLOCK = 160


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LocalLevel:
    """By how much the level of a mix differs from the stated density."""

    origin: FloatArray  #: ``(3,)``, cells. Middle of the first cell.
    spacing: float  #: cells. From one middle to the next.
    #: ``(p, q, r)``. Level less density in the middle of every cell, linear in between.
    excess: FloatArray
    #: Largest error of the density of a cell, relative to the stated one: with the density as
    #: level, and with these levels.
    before: float
    error: float  #: As `before`.

    def __post_init__(self) -> None:
        lock(self, origin=(3,), excess=(None, None, None))

    def at(self, u: FloatArray) -> FloatArray:
        """Excess at cell coordinates ``(3, ...)``, trilinear, ``(...)``."""
        flat = np.ascontiguousarray(u.reshape(3, -1), dtype=np.float64)
        return trilinear(self.excess, self.origin, self.spacing, flat).reshape(u.shape[1:])


def local_level(
    shape: Callable[[FloatArray, FloatArray], FloatArray],
    period: int,
    places: tuple[FloatArray, FloatArray, FloatArray],
    *,
    memory_limit_bytes: float,
) -> LocalLevel:
    """Find the level of a mix from place to place.

    Raises ResourceError if the lattice has too many cells for the memory.

    - ``shape``: cell coordinates ``(3, n)`` and share ``(n,)`` to the density at which points
      become solid
    - ``period``: cells after which it repeats; the density is held over so many
    - ``places``: cell coordinates ``(3, n)``, share and stated density ``(n,)`` at points all over
      the lattice, several in every block
    - ``memory_limit_bytes``: that it may take
    """
    u, share, density = places
    low = np.floor(u.min(axis=1)).astype(np.int64) - period
    cells = np.floor(u.max(axis=1)).astype(np.int64) + 1 + period - low
    each = BLOCKS if period == 1 else _BLOCKS_OF_LONG_PERIODS
    blocks = each * period * np.ceil(cells / period).astype(np.int64)
    need = float(blocks.prod()) * _BYTES_PER_BLOCK
    if need > memory_limit_bytes:
        raise ResourceError(
            f"the levels of a mix of cells on {blocks.prod() / 1e6:.3g} M blocks take "
            f"{need / 1e9:.3g} GB, but [run] memory is {memory_limit_bytes / 1e9:.3g} GB; raise "
            f"[run] memory, or take larger cells"
        )
    number = np.floor((u - low[:, None]) * each).astype(np.int64)
    flat = np.ravel_multi_index(tuple(number), tuple(blocks))
    count = np.bincount(flat, minlength=int(blocks.prod())).reshape(blocks)
    nearest = distance_transform_edt(count == 0, return_distances=False, return_indices=True)
    shares, meant = (
        (np.bincount(flat, weights=v, minlength=count.size).reshape(blocks) / np.maximum(count, 1))[
            tuple(nearest)
        ]
        for v in (share, density)
    )
    within = count > 0
    table = _solid_of_blocks(shape, period, each)
    solid = _Solid(table, shares, each * low, each * period)
    excess, before, error = _settled(solid, meant, within, each * period)
    log.info("levels of a mix: cells off by %.2g before, %.2g now", before, error)
    return LocalLevel(
        origin=low + 0.5 * period,
        spacing=float(period),
        excess=excess,
        before=before,
        error=error,
    )


def _solid_of_blocks(
    shape: Callable[[FloatArray, FloatArray], FloatArray], period: int, each: int
) -> NDArray[np.float32]:
    """Solid share of every block of a period at every share and level, ``(SHARES, b, LEVELS)``.

    ``each`` is the number of blocks along a cell.
    """
    edge = period * each
    u = period * spread_points((edge * SAMPLES) ** 3)
    number = np.ravel_multi_index(tuple((u * each).astype(np.int64)), (edge,) * 3)
    count = np.bincount(number, minlength=edge**3)
    table = np.zeros((SHARES, edge**3, LEVELS), dtype=np.float32)
    for n, share in enumerate(np.linspace(0.0, 1.0, SHARES)):
        rank = shape(u, np.full(u.shape[1], share))
        upper = np.ceil(np.clip(rank, 0.0, 1.0) * (LEVELS - 1)).astype(np.int64)
        first = np.bincount(number * LEVELS + upper, minlength=edge**3 * LEVELS)
        table[n] = np.cumsum(first.reshape(edge**3, LEVELS), axis=1) / count[:, None]
    return table


class _Solid:
    """Solid of the blocks of a lattice at levels, by a table."""

    def __init__(
        self, table: NDArray[np.float32], share: FloatArray, low: IntArray, edge: int
    ) -> None:
        """``low`` is the number of the first block, ``edge`` how many a period has."""
        lines = [(np.arange(n) + first) % edge for n, first in zip(share.shape, low, strict=True)]
        block = np.ravel_multi_index(np.ix_(*lines), (edge,) * 3)
        place = np.clip(share, 0.0, 1.0) * (SHARES - 1)
        below = np.minimum(place.astype(np.int64), SHARES - 2)
        self._part = place - below
        self._table = table.reshape(-1)
        self._row = (below * edge**3 + block) * LEVELS
        self._next = edge**3 * LEVELS

    def at(self, level: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Solid share of every block, and how it grows with the level."""
        place = np.clip(level, 0.0, 1.0) * (LEVELS - 1)
        below = np.minimum(place.astype(np.int64), LEVELS - 2)
        ends = []
        for k in (0, 1):
            low = self._table[self._row + below + k]
            high = self._table[self._row + self._next + below + k]
            ends.append(np.asarray(low + self._part * (high - low), dtype=np.float64))
        rise = ends[1] - ends[0]
        return np.asarray(ends[0] + (place - below) * rise), np.asarray(rise * (LEVELS - 1))


def _settled(
    solid: _Solid, meant: FloatArray, within: BoolArray, size: int
) -> tuple[FloatArray, float, float]:
    """Excess of the level in the middle of every cell, the largest error before, and now.

    Cells have ``size`` blocks along an edge.
    """
    filled = _means(within.astype(np.float64), size)
    whole = filled >= 0.5 * filled.max()
    wanted = _means(meant, size)
    excess, best = np.zeros(wanted.shape), np.zeros(wanted.shape)
    least, before = np.inf, 0.0
    for n in range(ROUNDS):
        filled, rise = solid.at(meant + _on_blocks(excess, size))
        off = wanted - _means(filled, size)
        error = float(np.abs(off / wanted)[whole].max())
        before = error if n == 0 else before
        if error < least:
            best, least = excess, error
        if least <= SETTLED:
            break
        excess = excess + off / np.maximum(_means(rise, size), _LEAST_RISE)
    return best, before, least


def _means(values: FloatArray, size: int) -> FloatArray:
    """Means over cells of blocks ``(p, q, r)``."""
    p, q, r = (n // size for n in values.shape)
    return np.asarray(values.reshape(p, size, q, size, r, size).mean(axis=(1, 3, 5)))


def _on_blocks(values: FloatArray, size: int) -> FloatArray:
    """Values in the middle of cells, linear in between, in the middle of every block."""
    for axis in range(3):
        count = values.shape[axis]
        place = (np.arange(count * size) + 0.5) / size - 0.5
        low = np.clip(np.floor(place), 0, max(count - 2, 0)).astype(np.int64)
        high = np.minimum(low + 1, count - 1)
        part = np.clip(place - low, 0.0, 1.0)
        part = part.reshape([-1 if k == axis else 1 for k in range(3)])
        below = values.take(low, axis=axis)
        values = below + part * (values.take(high, axis=axis) - below)
    return values
