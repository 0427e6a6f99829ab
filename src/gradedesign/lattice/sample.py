"""Sampling a field on a regular grid, in bricks, so that memory stays bounded."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import Field, FloatArray
from gradedesign.errors import LatticeError
from gradedesign.workspace.progress import report_step

Shape = tuple[int, int, int]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Brick:
    """Field values on a box of grid nodes.

    Attributes
    ----------
    start : (int, int, int)
        Grid index of the first node.
    values : (a, b, c) array
        Field at the nodes, negative inside.
    """

    start: Shape
    values: FloatArray


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


def sample_bricks(
    field: Field, lower: ArrayLike, shape: Shape, h: float, *, brick: int = 64
) -> Iterator[Brick]:
    """Sample a field brick by brick; neighbouring bricks share their border nodes.

    Every node is evaluated once and its value handed on, so bricks agree on shared nodes to the
    last bit even where a field's rounding depends on the batch it is evaluated in.

    Parameters
    ----------
    field : callable
        Points ``(3, ...)`` mm to values ``(...)``.
    lower : (3,) array_like, mm
        First node.
    shape : (int, int, int)
        Number of nodes along x, y, z.
    h : float, mm
        Spacing.
    brick : int
        Cubes along the edge of a brick; a brick holds up to ``(brick + 1)^3`` nodes.

    Yields
    ------
    Brick
        In order of their start, z fastest.
    """
    _check_grid(shape, h, brick)
    nx, ny, nz = shape
    plane_x = np.zeros((ny, nz))
    for i in range(0, nx - 1, brick):
        report_step("field on the grid", i / (nx - 1))
        a = min(brick, nx - 1 - i) + 1
        plane_y = np.zeros((a, nz))
        for j in range(0, ny - 1, brick):
            b = min(brick, ny - 1 - j) + 1
            plane_z = np.zeros((a, b))
            for k in range(0, nz - 1, brick):
                c = min(brick, nz - 1 - k) + 1
                values = np.zeros((a, b, c))
                # This order: lines shared by two planes hold stale values in the earlier one.
                if i:
                    values[0] = plane_x[j : j + b, k : k + c]
                if j:
                    values[:, 0] = plane_y[:, k : k + c]
                if k:
                    values[:, :, 0] = plane_z
                fresh = (int(i > 0), int(j > 0), int(k > 0))
                start = (i + fresh[0], j + fresh[1], k + fresh[2])
                size = (a - fresh[0], b - fresh[1], c - fresh[2])
                values[fresh[0] :, fresh[1] :, fresh[2] :] = checked_values(
                    field, grid_points(lower, start, size, h)
                )
                plane_x[j : j + b, k : k + c] = values[-1]
                plane_y[:, k : k + c] = values[:, -1]
                plane_z = values[:, :, -1].copy()
                yield Brick(start=(i, j, k), values=values)


def _check_grid(shape: Shape, h: float, brick: int) -> None:
    if min(shape) < 2 or not h > 0 or brick < 1:
        raise LatticeError(
            f"a sampling grid needs at least 2 nodes along each axis, a positive spacing and "
            f"bricks of at least one cube; got {shape} nodes, {h:g} mm, brick {brick}"
        )
