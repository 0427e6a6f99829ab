"""Sampling a field on a regular grid, in slabs, so that memory stays bounded."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.errors import LatticeError

Shape = tuple[int, int, int]

#: Nodes that a slab holds, and that are evaluated at once, about. Chosen, not measured.
NODES, BATCH = 1 << 21, 1 << 16


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Slab:
    """Field values on neighbouring planes of grid nodes."""

    first: int  #: Grid index along x of the first plane.
    values: FloatArray  #: ``(a, ny, nz)``. Field at the nodes, negative inside.


def grid_points(lower: ArrayLike, start: Shape, shape: Shape, h: float) -> FloatArray:
    """Nodes ``lower + h (start + index)``, ``(3, *shape)``, mm."""
    lower = np.asarray(lower, dtype=np.float64)
    points = np.zeros((3, *shape))
    for axis in range(3):
        line = lower[axis] + h * (start[axis] + np.arange(shape[axis]))
        points[axis] = np.expand_dims(line, tuple(n for n in range(3) if n != axis))
    return points


def checked_values(field: Field, points: FloatArray) -> FloatArray:
    """Field at points, float64.

    Raises
    ------
    LatticeError
        If the field returns another shape or values that are not finite.

    Examples
    --------
    >>> checked_values(lambda points: points[0] - 1.0, np.zeros((3, 2)))
    array([-1., -1.])
    """
    values = np.asarray(field(points), dtype=np.float64)
    if values.shape != points.shape[1:]:
        raise LatticeError(
            f"the field returned shape {values.shape} for points {points.shape}, expected "
            f"{points.shape[1:]}; a field maps points (3, ...) to values (...)"
        )
    finite = np.isfinite(values)
    if not finite.all():
        where = points[:, ~finite].reshape(3, -1)[:, 0]
        raise LatticeError(
            f"the field is not finite at {np.count_nonzero(~finite)} of {finite.size} points, "
            f"first at ({where[0]:g}, {where[1]:g}, {where[2]:g}) mm; check the cell's shape "
            f"function, its map and the density there"
        )
    return values


def sample_slabs(
    field: Field, lower: ArrayLike, shape: Shape, h: float, *, nodes: int = NODES
) -> Iterator[Slab]:
    """Sample a field slab by slab along x; neighbouring slabs share a plane of nodes.

    Every node is evaluated once and its value handed on, so slabs agree on shared nodes to the
    last bit even where a field's rounding depends on the batch it is evaluated in.

    - ``field``: points ``(3, ...)`` mm to values ``(...)``
    - ``lower (3,)``, mm: first node
    - ``shape``: number of nodes along x, y, z
    - ``h``, mm: spacing
    - ``nodes``: about as many are held at once; two planes at least

    Yields
    ------
    Slab
        In order along x.
    """
    nx, ny, nz = shape
    if min(shape) < 2 or not h > 0 or nodes < 1:
        raise LatticeError(
            f"a sampling grid needs at least 2 nodes along each axis, a positive spacing and "
            f"room for a node; got {shape} nodes, {h:g} mm, {nodes} at once"
        )
    planes = max(nodes // (ny * nz), 1)
    last = None
    for i in range(0, nx - 1, planes):
        report_step("field on the grid", i / (nx - 1))
        a = min(planes, nx - 1 - i) + 1
        values = np.zeros((a, ny, nz))
        if last is not None:
            values[0] = last
        fresh = int(last is not None)
        # Cubes of nodes rather than lines: their neighbours lie near each other.
        side = max(round((BATCH / (a - fresh)) ** 0.5), 1)
        for j in range(0, ny, side):
            for k in range(0, nz, side):
                size = (a - fresh, min(side, ny - j), min(side, nz - k))
                values[fresh:, j : j + side, k : k + side] = checked_values(
                    field, grid_points(lower, (i + fresh, j, k), size, h)
                )
        last = values[-1].copy()
        yield Slab(first=i, values=values)
