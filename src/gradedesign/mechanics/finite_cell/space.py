"""Nodes of the active elements: 27 of the quadratic element, eight of the linear one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import ResourceError
from gradedesign.mechanics.finite_cell import _node_kernels as kernels
from gradedesign.mechanics.finite_cell._hanging_kernels import attach_small
from gradedesign.mechanics.finite_cell.elements import Elements
from gradedesign.mechanics.finite_cell.hanging import Hanging, hanging_nodes

#: Numbers of a node in its element along x, y and z, ``(3, 27)``.
LOCAL = np.stack([np.arange(27) % 3, np.arange(27) // 3 % 3, np.arange(27) // 9])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BrickSpace:
    """Numbered nodes."""

    #: ``(n, 27) or (n, 8)`` int32. Of quadratic or linear functions, of every element, x fastest.
    nodes: NDArray[np.int32]
    #: ``(N, 3)`` int32. Of every node, in halves of the grid's edges from its lower corner.
    place: NDArray[np.int32]
    #: Nodes of small elements that a large neighbour holds; they are numbered last.
    hanging: Hanging | None = None


def unknown_count(space: BrickSpace) -> int:
    """Displacements that are solved for: three a node that does not hang."""
    return 3 * (len(space.place) - (0 if space.hanging is None else space.hanging.values.shape[0]))


def brick_space(elements: Elements) -> BrickSpace:
    """Number the quadratic nodes of elements, x fastest; further nodes at a place come last.

    Neighbours share the nodes of their face where the solid goes through it. Where one is large and
    the other small, nodes of the small one hang.
    """
    position, size = elements.position.astype(np.int64), elements.size.astype(np.int64)
    dims = 2 * (position + size[:, None]).max(axis=0) + 1
    if int(np.prod(dims)) >= 2**31:
        raise ResourceError(
            f"a grid of {'x'.join(map(str, dims))} nodes is beyond what can be numbered; use a "
            "larger spacing"
        )
    x, y, z = (2 * position[:, [d]] + size[:, None] * np.arange(3) for d in range(3))
    key = (z[:, :, None, None] * dims[1] + y[:, None, :, None]) * dims[0] + x[:, None, None, :]
    key = key.reshape(len(position), -1)
    used = np.zeros(int(np.prod(dims)), dtype=bool)
    used[key] = True
    number = np.cumsum(used, dtype=np.int32) - 1
    keys = np.flatnonzero(used)
    place = np.stack([keys % dims[0], keys // dims[0] % dims[1], keys // (dims[0] * dims[1])], 1)
    nodes = number[key]
    del key, used, number
    shape = np.array(elements.grid.shape)
    bricks = np.ravel_multi_index(tuple(position.T), elements.grid.shape)
    order = np.argsort(bricks, kind="stable")
    bricks = bricks[order]
    sets = np.arange(nodes.size, dtype=np.int32)
    kernels.join_neighbours(
        bricks, order, elements.position, elements.size, shape, elements.faces, _opposite_nodes(),
        sets,
    )  # fmt: skip
    held = np.zeros((0, 2), np.int64)
    if len(np.unique(elements.size)) > 1:
        held = attach_small(
            bricks, order, elements.position, elements.size, shape, elements.faces, sets
        )
    further = kernels.number_nodes(sets, nodes, len(keys))
    place = np.concatenate([place, place[further]]).astype(np.int32)
    if not len(held):
        return BrickSpace(nodes=nodes, place=place)
    nodes, new, hanging = hanging_nodes(elements, nodes, place, held)
    return BrickSpace(nodes=nodes, place=place[new], hanging=hanging)


def linear_space(space: BrickSpace, nodes: NDArray[np.int32]) -> BrickSpace:
    """Nodes of linear elements, given ``(n, 8)`` among those of quadratic ones."""
    used = np.zeros(len(space.place), dtype=bool)
    used[nodes] = True
    number = np.cumsum(used, dtype=np.int32) - 1
    return BrickSpace(nodes=number[nodes], place=space.place[used])


def _opposite_nodes() -> IntArray:
    """Nodes of the far and the near face across each axis, ``(3, 2, 9)``, place by place."""
    return np.stack(
        [[np.flatnonzero(LOCAL[d] == 2), np.flatnonzero(LOCAL[d] == 0)] for d in range(3)]
    )


def node_points(elements: Elements, space: BrickSpace) -> FloatArray:
    """Coordinates of the nodes, ``(3, N)``, mm."""
    grid = elements.grid
    return (grid.lower + space.place * (grid.edges / 2.0)).T
