"""Range of levels in which the solid of a cell is one connected component and its void is open."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.geometry.cell._percolation_kernels import (
    LARGEST,
    LARGEST_INDEX,
    SPANNING_TOTAL,
    flood,
)

#: Share of the solid, or of the void, that may lie in components of its own: grid noise. Chosen,
#: not measured.
_FLOATING_SHARE = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Percolation:
    """Levels between which solid and void percolate, and where the last neck closes."""

    floor: float  #: Levels of the shape function; ``floor`` may be minus infinity.
    ceiling: float  #: As `floor`.
    #: Point, in periods, at which the solid connects in all three directions as the level rises.
    neck: tuple[float, float, float]
    #: The same where it becomes one piece, apart from a share of `_FLOATING_SHARE`: in a random
    #: cell, large parts join the solid long after it connects.
    last_neck: tuple[float, float, float]


def percolation(values: FloatArray, *, open_void: bool = True) -> Percolation | None:
    """Find the levels between which a periodic cell can be used.

    At a level ``t`` the cell is usable when

    - the solid ``g <= t`` is one piece that connects the cell to its copies in all three
      directions, apart from a share of `_FLOATING_SHARE`: nothing floats, and no second lattice
      stands unconnected inside the first;
    - the void ``g > t`` consists of components that each lead through the cell in three directions
      (one for a network, two for a sheet), apart from the same share: no powder is locked in.

    Returns Percolation or None: the widest range of densities over which both hold; None where they
    never do.

    ``values (n, n, n)``: shape function at the nodes ``i / n`` of its period. ``open_void``: False:
    the second condition need not hold.

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
        filled - solid[:, LARGEST] <= _FLOATING_SHARE * filled
    )
    usable = solid_ok[:-1]
    if open_void:
        void = np.zeros((count, 3), dtype=np.int64)
        flood(order[::-1].copy(), n, void)
        void_ok = (void[:, SPANNING_TOTAL] > 0) & (
            filled - void[:, SPANNING_TOTAL] <= _FLOATING_SHARE * filled
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
    broken = np.flatnonzero(~solid_ok[:start])
    whole = int(broken[-1]) + 1 if broken.size else 0
    return Percolation(
        floor=float(flat[order[start]]),
        ceiling=float(flat[order[stop]]),
        neck=_place(int(order[connected]), n),
        last_neck=_place(int(order[whole]), n),
    )


def _place(node: int, n: int) -> tuple[float, float, float]:
    """Place of a node of the grid, in periods."""
    return node // n**2 / n, node // n % n / n, node % n / n
