"""Faces between large and small elements: which nodes are one, and which hang."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from gradedesign.finite_cell._tree_kernels import join, root_of


@njit(cache=True, nogil=True)
def _meet(large: int, small: int, first: int, second: int) -> bool:
    """Whether the solid of a large element goes on in a small one across a quarter of its face.

    Bits are those of 5 by 5 corners of sub-cells; `first` and `second` say which quarter. The large
    element has a corner for every second one of the small: it counts as reached where one beside
    it is.
    """
    for b in range(3):
        for a in range(3):
            if not (large >> (5 * (b + 2 * second) + a + 2 * first)) & 1:
                continue
            for d in range(max(2 * b - 1, 0), min(2 * b + 2, 5)):
                for c in range(max(2 * a - 1, 0), min(2 * a + 2, 5)):
                    if (small >> (5 * d + c)) & 1:
                        return True
    return False


@njit(cache=True, nogil=True)
def _join_masters(sets: Any, position: Any, one: int, other: int, x: int, y: int, z: int) -> None:
    """Unite the nodes of two large elements that hold one node, at x, y and z in half edges."""
    for k in range(3):
        for j in range(3):
            for i in range(3):
                inside = True
                at = (i, j, k)
                slots = np.zeros(2, np.int64)
                factor = 1
                for axis in range(3):
                    p = x if axis == 0 else (y if axis == 1 else z)
                    place = 2 * position[one, axis] + 2 * at[axis]
                    if p % 2 == 0 and place != p:
                        inside = False
                    back = place - 2 * position[other, axis]
                    if back < 0 or back > 4:
                        inside = False
                    slots[0] += factor * at[axis]
                    slots[1] += factor * (back // 2)
                    factor *= 3
                if inside:
                    join(sets, 27 * one + slots[0], 27 * other + slots[1])


@njit(cache=True, nogil=True)
def attach_small(
    bricks: Any, order: Any, position: Any, size: Any, shape: Any, faces: Any, sets: Any
) -> Any:
    """Unite nodes of small and large elements at one place, and list those that hang.

    Parameters
    ----------
    bricks, order, position, size, shape, faces, sets
        As for `join_neighbours`, after it.

    Returns
    -------
    (m, 2) int array
        A node of a small element as 27 element + local number, and a large element that holds it.
    """
    n = position.shape[0]
    owner = {np.int64(-1): np.int64(-1)}
    brick = np.zeros(3, np.int64)
    for f in range(n):
        if size[f] != 1:
            continue
        for axis in range(3):
            for side in range(2):
                # The large neighbour begins at even places; a sibling lies in the same block.
                if (position[f, axis] & 1) != side:
                    continue
                for d in range(3):
                    brick[d] = position[f, d] - (position[f, d] & 1)
                brick[axis] += 2 if side else -2
                if brick[axis] < 0 or brick[axis] >= shape[axis]:
                    continue
                flat = (brick[0] * shape[1] + brick[1]) * shape[2] + brick[2]
                first, second = (axis + 1) % 3, (axis + 2) % 3
                if first > second:
                    first, second = second, first
                m = np.searchsorted(bricks, flat)
                while m < n and bricks[m] == flat:
                    c = order[m]
                    m += 1
                    if size[c] != 2 or not _meet(
                        faces[c, 2 * axis + 1 - side],
                        faces[f, 2 * axis + side],
                        position[f, first] & 1,
                        position[f, second] & 1,
                    ):
                        continue
                    for a in range(27):
                        local = (a % 3, a // 3 % 3, a // 9)
                        if local[axis] != 2 * side:
                            continue
                        x = 2 * position[f, 0] + local[0]
                        y = 2 * position[f, 1] + local[1]
                        z = 2 * position[f, 2] + local[2]
                        if x % 2 == 0 and y % 2 == 0 and z % 2 == 0:
                            slot = (
                                (x - 2 * position[c, 0]) // 2
                                + 3 * ((y - 2 * position[c, 1]) // 2)
                                + 9 * ((z - 2 * position[c, 2]) // 2)
                            )
                            join(sets, 27 * f + a, 27 * c + slot)
                            continue
                        key = np.int64(root_of(sets, 27 * f + a))
                        if key in owner:
                            _join_masters(sets, position, owner[key], c, x, y, z)
                        else:
                            owner[key] = np.int64(c)
    held = np.zeros((len(owner) - 1, 2), np.int64)
    row = 0
    for key in owner:
        if key >= 0:
            held[row, 0] = key
            held[row, 1] = owner[key]
            row += 1
    return held
