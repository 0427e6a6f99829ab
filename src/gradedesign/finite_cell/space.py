"""Nodes of the active elements: 27 of the quadratic element, eight of the linear one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import ResourceError
from gradedesign.finite_cell import _tree_kernels as kernels
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


def brick_space(elements: Elements) -> BrickSpace:
    """Number the quadratic nodes of elements, x fastest; further nodes at a place come last.

    Neighbours share the nodes of their face where the solid goes through it.
    """
    position = elements.position
    dims = 2 * (position.max(axis=0).astype(np.int64) + 1) + 1
    if int(np.prod(dims)) >= 2**31:
        raise ResourceError(
            f"a grid of {'x'.join(map(str, dims))} nodes is beyond what can be numbered; use a "
            "larger spacing"
        )
    x, y, z = (2 * position[:, [d]].astype(np.int64) + np.arange(3) for d in range(3))
    key = (z[:, :, None, None] * dims[1] + y[:, None, :, None]) * dims[0] + x[:, None, None, :]
    key = key.reshape(len(position), -1)
    used = np.zeros(int(np.prod(dims)), dtype=bool)
    used[key] = True
    number = np.cumsum(used, dtype=np.int32) - 1
    keys = np.flatnonzero(used)
    place = np.stack([keys % dims[0], keys // dims[0] % dims[1], keys // (dims[0] * dims[1])], 1)
    nodes = number[key]
    del key, used, number
    bricks = np.ravel_multi_index(tuple(position.T), elements.grid.shape)
    order = np.argsort(bricks, kind="stable")
    further = kernels.number_nodes(
        bricks[order], order, position, np.array(elements.grid.shape), elements.faces,
        _opposite_nodes(), nodes, len(keys),
    )  # fmt: skip
    return BrickSpace(
        order=2, nodes=nodes, place=np.concatenate([place, place[further]]).astype(np.int32)
    )


def linear_space(space: BrickSpace) -> BrickSpace:
    """The corners of quadratic elements."""
    corners = space.nodes[:, [0, 2, 6, 8, 18, 20, 24, 26]]
    used = np.zeros(len(space.place), dtype=bool)
    used[corners] = True
    number = np.cumsum(used, dtype=np.int32) - 1
    return BrickSpace(order=1, nodes=number[corners], place=space.place[used] // 2)


def _opposite_nodes() -> IntArray:
    """Nodes of the far and the near face across each axis, ``(3, 2, 9)``, place by place."""
    local = np.stack([np.arange(27) % 3, np.arange(27) // 3 % 3, np.arange(27) // 9])
    return np.stack(
        [[np.flatnonzero(local[d] == 2), np.flatnonzero(local[d] == 0)] for d in range(3)]
    )


def node_points(elements: Elements, space: BrickSpace) -> FloatArray:
    """Coordinates of the nodes, ``(3, N)``, mm."""
    grid = elements.grid
    return (grid.lower + space.place * (grid.edges / space.order)).T
