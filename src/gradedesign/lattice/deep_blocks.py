"""Blocks of a grid that lie wholly inside a part, away from its surface."""

from __future__ import annotations

import numpy as np
from numba import njit

from gradedesign.arrays import BoolArray, Field, FloatArray
from gradedesign.lattice.sample import BATCH, Shape, checked_values

#: Cubes along the edge of the blocks that are distinguished, and of the first, coarse ones.
BLOCK, COARSEST = 2, 16
#: Marked blocks keep this distance from the surface, in grid spacings.
CLEARANCE = 0.25


def deep_blocks(distance: Field, origin: FloatArray, shape: Shape, h: float) -> BoolArray:
    """Blocks of ``BLOCK`` cubes along each axis that lie deep inside a part.

    A distance changes by at most 1 mm per mm, so that its value at the centre of a block settles
    most blocks at once; the others are divided. Blocks that would touch another one along an edge
    only are taken out again, so that the surface of the marked blocks is a manifold along its
    edges.

    Parameters
    ----------
    distance : callable
        A true distance, points ``(3, ...)`` mm to ``(...)`` mm, negative inside.
    origin : (3,) array, mm
        First node of the grid.
    shape : (int, int, int)
        Number of nodes.
    h : float, mm
        Spacing.

    Returns
    -------
    (a, b, c) bool array
        Every point of a marked block is more than ``CLEARANCE`` spacings inside.
    """
    marks = np.zeros([-(-(n - 1) // BLOCK) for n in shape], dtype=bool)
    size = COARSEST
    open_blocks = np.indices([-(-(n - 1) // size) for n in shape]).reshape(3, -1)
    while size >= BLOCK and open_blocks.size:
        values = np.concatenate(
            [
                checked_values(distance, origin[:, None] + h * size * (some + 0.5))
                for some in np.array_split(open_blocks, -(-open_blocks.shape[1] // BATCH), axis=1)
            ]
        )
        reach = 0.5 * np.sqrt(3.0) * size * h
        per = size // BLOCK
        for i, j, k in (per * open_blocks[:, values < -reach - CLEARANCE * h]).T:
            marks[i : i + per, j : j + per, k : k + per] = True
        unsure = (values >= -reach - CLEARANCE * h) & (values < reach - CLEARANCE * h)
        size //= 2
        halves = np.indices((2, 2, 2)).reshape(3, 1, 8)
        open_blocks = (2 * open_blocks[:, unsure, None] + halves).reshape(3, -1)
        fits = (open_blocks * size < np.array(shape)[:, None] - 1).all(axis=0)
        open_blocks = open_blocks[:, fits]
    while _take_out_edges(marks):
        pass
    return marks


@njit(cache=True)
def _take_out_edges(marks: BoolArray) -> int:
    """Take out one of two marked blocks that share an edge and no marked neighbour."""
    taken = 0
    nx, ny, nz = marks.shape
    for axis in range(3):
        u = (int(axis != 0), int(axis == 0), 0)  # the two other axes
        v = (0, int(axis == 2), int(axis != 2))
        for i in range(nx - u[0] - v[0]):
            for j in range(ny - u[1] - v[1]):
                for k in range(nz - u[2] - v[2]):
                    here = marks[i, j, k]
                    across = marks[i + u[0] + v[0], j + u[1] + v[1], k + u[2] + v[2]]
                    one = marks[i + u[0], j + u[1], k + u[2]]
                    other = marks[i + v[0], j + v[1], k + v[2]]
                    if here and across and not one and not other:
                        marks[i, j, k] = False
                        taken += 1
                    elif one and other and not here and not across:
                        marks[i + u[0], j + u[1], k + u[2]] = False
                        taken += 1
    return taken
