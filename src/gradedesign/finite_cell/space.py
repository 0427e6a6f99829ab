"""Nodes of the active elements: 27 of the quadratic element, eight of the linear one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray
from gradedesign.errors import ResourceError
from gradedesign.finite_cell.elements import Elements


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BrickSpace:
    """Numbered nodes.

    Attributes
    ----------
    order : int
        1 or 2.
    nodes : (n, (order + 1)^3) int32 array
        Of every element, x fastest.
    place : (N, 3) int32 array
        Of every node, in edges over the order, from the grid's lower corner.
    """

    order: int
    nodes: NDArray[np.int32]
    place: NDArray[np.int32]


def brick_space(position: NDArray[np.int32], order: int) -> BrickSpace:
    """Number the nodes of elements at places of a grid, x fastest."""
    side = np.arange(order + 1)
    dims = order * (position.max(axis=0).astype(np.int64) + 1) + 1
    if int(np.prod(dims)) >= 2**31:
        raise ResourceError(
            f"a grid of {'x'.join(map(str, dims))} nodes is beyond what can be numbered; use a "
            "larger spacing"
        )
    first = order * position.astype(np.int64)
    x, y, z = (first[:, [d]] + side for d in range(3))
    key = (z[:, :, None, None] * dims[1] + y[:, None, :, None]) * dims[0] + x[:, None, None, :]
    key = key.reshape(len(position), -1)
    used = np.zeros(int(np.prod(dims)), dtype=bool)
    used[key] = True
    number = np.cumsum(used, dtype=np.int32) - 1
    keys = np.flatnonzero(used)
    place = np.stack([keys % dims[0], keys // dims[0] % dims[1], keys // (dims[0] * dims[1])], 1)
    return BrickSpace(order=order, nodes=number[key].astype(np.int32), place=place.astype(np.int32))


def node_points(elements: Elements, space: BrickSpace) -> FloatArray:
    """Coordinates of the nodes, ``(3, N)``, mm."""
    grid = elements.grid
    return (grid.lower + space.place * (grid.edges / space.order)).T
