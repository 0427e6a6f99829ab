"""Faces between large and small elements: which nodes are one, and which hang."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from gradedesign.mechanics.finite_cell._node_kernels import join, root_of


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
def _join_masters(
    sets: Any, position: Any, first: int, second: int, x: int, y: int, z: int
) -> None:
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
                    place = 2 * position[first, axis] + 2 * at[axis]
                    if p % 2 == 0 and place != p:
                        inside = False
                    back = place - 2 * position[second, axis]
                    if back < 0 or back > 4:
                        inside = False
                    slots[0] += factor * at[axis]
                    slots[1] += factor * (back // 2)
                    factor *= 3
                if inside:
                    join(sets, 27 * first + slots[0], 27 * second + slots[1])


@njit(cache=True, nogil=True)
def _join_ends(position: Any, size: Any, sets: Any) -> bool:
    """Unite the ends of edges, and the corners of faces, of large elements whose middle is shared.

    A small element may hold the middle of a large one's edge through a neighbour, but not the end
    of its own half, across a gap: linear functions would have three values along one edge.

    Returns
    -------
    bool
        Whether anything was united.
    """
    n = position.shape[0]
    holder = np.full(sets.size, -1, np.int32)
    changed = False
    for e in range(n):
        if size[e] != 2:
            continue
        for a in range(27):
            local = (a % 3, a // 3 % 3, a // 9)
            middles = (local[0] == 1) + (local[1] == 1) + (local[2] == 1)
            if middles == 0 or middles == 3:
                continue
            r = root_of(sets, 27 * e + a)
            if holder[r] < 0:
                holder[r] = e
                continue
            c = holder[r]
            x = 2 * (position[e, 0] + local[0])
            y = 2 * (position[e, 1] + local[1])
            z = 2 * (position[e, 2] + local[2])
            changed |= _join_span(position, size, sets, e, c, x, y, z)
    for e in range(n):
        if size[e] != 1:
            continue
        for a in range(8):
            x = 2 * (position[e, 0] + (a & 1))
            y = 2 * (position[e, 1] + ((a >> 1) & 1))
            z = 2 * (position[e, 2] + (a >> 2))
            c = holder[root_of(sets, 27 * e + 2 * (a & 1) + 6 * ((a >> 1) & 1) + 18 * (a >> 2))]
            if c >= 0:
                changed |= _join_span(position, size, sets, e, c, x, y, z)
    return changed


@njit(cache=True, nogil=True)
def _join_span(
    position: Any, size: Any, sets: Any, element: int, large: int, x: int, y: int, z: int
) -> bool:
    """Unite nodes of an element with those of a large one at the same places.

    The places span the edge or the face of the large element whose middle lies at x, y and z, in
    half edges of the grid.
    """
    changed = False
    spanned = (x - 2 * position[large, 0] == 2, y - 2 * position[large, 1] == 2,
               z - 2 * position[large, 2] == 2)  # fmt: skip
    for k in range(27):
        local = (k % 3, k // 3 % 3, k // 9)
        slot = 0
        factor = 1
        for axis in range(3):
            p = x if axis == 0 else (y if axis == 1 else z)
            place = 2 * position[element, axis] + size[element] * local[axis]
            back = place - 2 * position[large, axis]
            if back < 0 or back > 4 or back & 1 or (place != p and not spanned[axis]):
                slot = -1
                break
            slot += factor * (back // 2)
            factor *= 3
        if slot >= 0 and root_of(sets, 27 * element + k) != root_of(sets, 27 * large + slot):
            join(sets, 27 * element + k, 27 * large + slot)
            changed = True
    return changed


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
    while _join_ends(position, size, sets):
        pass
    held = np.zeros((len(owner) - 1, 2), np.int64)
    row = 0
    for key in owner:
        if key >= 0:
            held[row, 0] = key
            held[row, 1] = owner[key]
            row += 1
    return held
