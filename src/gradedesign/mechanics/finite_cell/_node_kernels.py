"""Nodes of elements: which are one, and their numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def root_of(parent: Any, i: Any) -> Any:
    """Representative of a set, with path halving."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = np.int64(parent[i])
    return i


@njit(cache=True, nogil=True)
def join(parent: Any, i: int, j: int) -> None:
    """Unite two sets."""
    a = root_of(parent, i)
    b = root_of(parent, j)
    if a != b:
        parent[max(a, b)] = min(a, b)


@njit(cache=True, nogil=True)
def join_neighbours(
    bricks: Any, order: Any, position: Any, size: Any, shape: Any, faces: Any, opposite: Any,
    sets: Any,
) -> None:  # fmt: skip
    """Unite the nodes of faces of neighbours of equal size where solid goes through.

    Parameters
    ----------
    bricks, order : (n,) int arrays
        Flat places of the elements in ascending order, and the elements there.
    position : (n, 3) int32 array
    size : (n,) int8 array
    shape : (3,) int array
        Of the grid.
    faces : (n, 6) int array
        Of `Elements`.
    opposite : (3, 2, 9) int array
        Local nodes of the far and the near face across each axis.
    sets : (27 n,) int32 array
        Parents of the sets of nodes, written.
    """
    n = position.shape[0]
    strides = np.array([shape[1] * shape[2], shape[2], 1])
    for axis in range(3):
        for k in range(n):
            e = order[k]
            if position[e, axis] + size[e] >= shape[axis]:
                continue
            beyond = bricks[k] + size[e] * strides[axis]
            m = np.searchsorted(bricks, beyond)
            while m < n and bricks[m] == beyond:
                other = order[m]
                if size[other] == size[e] and (faces[e, 2 * axis + 1] & faces[other, 2 * axis]):
                    for q in range(9):
                        join(sets, 27 * e + opposite[axis, 0, q], 27 * other + opposite[axis, 1, q])
                m += 1


@njit(cache=True, nogil=True)
def number_nodes(sets: Any, nodes: Any, count: int) -> Any:
    """Number nodes from the sets that are one.

    Parameters
    ----------
    sets : (27 n,) int32 array
    nodes : (n, 27) int32 array
        Number of every place; the first set of nodes at a place keeps it, others are numbered
        from `count` on.

    Returns
    -------
    (m,) int array
        Place of every further node.
    """
    taken = np.zeros(count, np.bool_)
    flat = nodes.reshape(-1)
    further = []
    for i in range(sets.size):
        r = root_of(sets, i)
        if r != i:
            flat[i] = flat[r]
        elif taken[flat[i]]:
            further.append(flat[i])
            flat[i] = count + len(further) - 1
        else:
            taken[flat[i]] = True
    places = np.zeros(len(further), np.int64)
    for k in range(len(further)):
        places[k] = further[k]
    return places
