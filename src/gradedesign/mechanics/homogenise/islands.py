"""Connected components of the solid voxels of a periodic grid, and those that carry load."""

from __future__ import annotations

import logging
from collections import defaultdict

import numpy as np
from scipy.ndimage import label

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import LatticeError

log = logging.getLogger(__name__)

#: Share of the solid that may be disconnected: noise of the grid, removed and reported. Chosen, not
#: measured.
DISCONNECTED_SHARE = 1e-3

_Offset = tuple[int, int, int]


def connected_fill(fill: FloatArray) -> tuple[FloatArray, float]:
    """Remove disconnected components of a periodic grid, and refuse one that carries no load.

    Voxels hang together across faces; what touches at an edge or a corner only is a hinge. Raises
    `LatticeError` if no component connects the cell to its neighbours in three directions, two
    unconnected ones do, or more than `DISCONNECTED_SHARE` is disconnected. Returns
    ``fill (nx, ny, nz)``: with void in place of the components that do not connect the cell to its
    neighbours; ``share``: of the solid voxels removed.

    ``fill (nx, ny, nz)``: solid where positive.

    Examples
    --------
    >>> kept, lost = connected_fill(np.ones((3, 3, 3)))
    >>> float(kept.sum()), lost
    (27.0, 0.0)
    """
    values = np.asarray(fill, dtype=np.float64)
    solid = values > 0
    total = int(np.count_nonzero(solid))
    if total == 0:
        raise LatticeError("the cell is empty: no voxel is solid; raise the density")
    components, count = label(solid)
    group, directions = _merge(components, count)
    volume = np.bincount(group[components[solid]], minlength=count + 1)
    spanning = [g for g in range(1, count + 1) if volume[g] and directions[g] == 3]
    if not spanning:
        raise LatticeError(
            f"the solid ({total / solid.size:.4f} of the cell on {solid.shape} voxels) does not "
            f"connect the cell to its neighbours in three directions, so it carries no load; "
            f"raise the density or take more voxels"
        )
    largest = max(spanning, key=lambda g: volume[g])
    share = 1 - float(volume[largest]) / total
    if share > DISCONNECTED_SHARE:
        raise LatticeError(
            f"{100 * share:.2f} % of the solid is not connected to the rest "
            f"({count} components on {solid.shape} voxels), at most "
            f"{100 * DISCONNECTED_SHARE:g} % is taken for noise of the "
            f"grid; raise the density or take more voxels"
        )
    if share == 0:
        return values, 0.0
    log.warning("removed disconnected voxels: %.2g of the solid", share)
    return np.where(group[components] == largest, values, 0.0), share


def connected_wall(fill: FloatArray) -> FloatArray:
    """Remove unconnected material from a wall across z that repeats along x and y.

    A face that cuts the cells leaves fragments that no other part of the wall holds; they carry
    nothing, and an equation system with them has no solution. Raises `LatticeError` if no component
    does. Returns ``(nx, ny, nz)``: with void in place of every component that does not connect the
    wall to its neighbours along both x and y.

    ``fill (nx, ny, nz)``: solid where positive; void below and above it.
    """
    values = np.asarray(fill, dtype=np.float64)
    # A layer of void keeps the faces from meeting.
    components, count = label(np.pad(values > 0, ((0, 0), (0, 0), (0, 1))))
    group, directions = _merge(components, count)
    spanning = directions[group] == 2
    spanning[0] = False
    if not spanning.any():
        raise LatticeError(
            f"the wall ({count} components on {values.shape} voxels) does not hang together: none "
            f"of them connects it to its neighbours along both directions of its plane; take a "
            f"higher density or whole cells across it"
        )
    return np.where(spanning[components[:, :, :-1]], values, 0.0)


def _merge(components: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Join components that touch across the periodic faces of the cell.

    Returns the group ``(count + 1,)`` of each piece, and for each group in how many independent
    directions its closed paths wind around the cell.
    """
    neighbours: dict[int, list[tuple[int, _Offset]]] = defaultdict(list)
    for axis in range(3):
        last = np.take(components, -1, axis).ravel()
        start = np.take(components, 0, axis).ravel()
        touching = (last > 0) & (start > 0)
        step: _Offset = (int(axis == 0), int(axis == 1), int(axis == 2))
        back: _Offset = (-step[0], -step[1], -step[2])
        for a, b in {
            (int(i), int(j)) for i, j in zip(last[touching], start[touching], strict=True)
        }:
            neighbours[a].append((b, step))
            neighbours[b].append((a, back))
    group = np.zeros(count + 1, dtype=np.int64)
    directions = np.zeros(count + 1, dtype=np.int64)
    for seed in range(1, count + 1):
        if group[seed]:
            continue
        place: dict[int, _Offset] = {seed: (0, 0, 0)}
        waiting, windings = [seed], [(0, 0, 0)]
        while waiting:
            a = waiting.pop()
            group[a] = seed
            for b, step in neighbours[a]:
                there = (place[a][0] + step[0], place[a][1] + step[1], place[a][2] + step[2])
                if b not in place:
                    place[b] = there
                    waiting.append(b)
                else:
                    first_offset = place[b]
                    windings.append(
                        (
                            there[0] - first_offset[0],
                            there[1] - first_offset[1],
                            there[2] - first_offset[2],
                        )
                    )
        directions[seed] = np.linalg.matrix_rank(np.array(sorted(set(windings))))
    return group, directions
