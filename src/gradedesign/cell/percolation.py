"""Between which levels a cell is one connected solid with an open void."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.cell._percolation_kernels import LARGEST, LARGEST_INDEX, SPANNING_TOTAL, flood

#: Share of the solid, or of the void, that may lie in pieces of its own: grid noise.
FLOATING_SHARE = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Percolation:
    """Levels between which solid and void percolate, and where the last neck closes.

    Attributes
    ----------
    floor, ceiling : float
        Levels of the shape function; ``floor`` may be minus infinity.
    neck : (float, float, float)
        Point, in periods, at which the last connection of the solid forms as the level rises.
    """

    floor: float
    ceiling: float
    neck: tuple[float, float, float]


def percolation(values: FloatArray, *, open_void: bool = True) -> Percolation | None:
    """Find the levels between which a periodic cell can be used.

    At a level ``t`` the cell is usable when

    - the solid ``g <= t`` is one piece that connects the cell to its copies in all three
      directions, apart from a share of `FLOATING_SHARE`: nothing floats, and no second lattice
      stands unconnected inside the first;
    - the void ``g > t`` consists of pieces that each lead through the cell in three directions
      (one for a network, two for a sheet), apart from the same share: no powder is locked in.

    Parameters
    ----------
    values : (n, n, n) array
        Shape function at the nodes ``i / n`` of its period.
    open_void : bool
        False: the second condition need not hold.

    Returns
    -------
    Percolation or None
        The widest range of densities over which both hold; None where they never do.

    Notes
    -----
    Pieces are those of the piecewise linear interpolant on the grid (see the kernel), and all
    levels are visited in one pass by adding nodes in order of value, once upwards for the solid
    and once downwards for the void. For smooth functions the levels converge with the square of
    the grid step.
    """
    n = values.shape[0]
    flat = np.ascontiguousarray(values, dtype=np.float64).ravel()
    order = np.argsort(flat, kind="stable")
    count = flat.size
    solid = np.zeros((count, 3), dtype=np.int64)
    flood(order, n, solid)
    filled = np.arange(1, count + 1)
    solid_ok = (solid[:, LARGEST_INDEX] == 1) & (
        filled - solid[:, LARGEST] <= FLOATING_SHARE * filled
    )
    usable = solid_ok[:-1]
    if open_void:
        void = np.zeros((count, 3), dtype=np.int64)
        flood(order[::-1].copy(), n, void)
        void_ok = (void[:, SPANNING_TOTAL] > 0) & (
            filled - void[:, SPANNING_TOTAL] <= FLOATING_SHARE * filled
        )
        # After adding k nodes from below, count - k remain above.
        usable &= void_ok[::-1][1:]
    if not usable.any():
        return None
    edges = np.flatnonzero(np.diff(np.concatenate([[False], usable, [False]]).astype(np.int8)))
    first, last = edges[::2], edges[1::2] - 1
    widest = int(np.argmax(last - first))
    start, stop = int(first[widest]), int(last[widest])
    connected = int(np.flatnonzero(solid[:, LARGEST_INDEX] == 1)[0])
    place = np.unravel_index(order[connected], values.shape)
    return Percolation(
        floor=float(flat[order[start]]),
        ceiling=float(flat[order[stop]]),
        neck=(float(place[0]) / n, float(place[1]) / n, float(place[2]) / n),
    )
