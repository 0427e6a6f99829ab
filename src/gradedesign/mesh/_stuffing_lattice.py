"""The lattice of isosurface stuffing and the field's values on it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import Field, FloatArray, IntArray
from gradedesign.errors import MeshError, ResourceError
from gradedesign.workspace.progress import report_step


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lattice:
    """The padded lattice: corners per axis, where it lies and how it is stepped through."""

    dims: tuple[int, int, int]
    lower: FloatArray
    h: float
    offsets: IntArray
    ahead: IntArray


def lay_lattice(lower: FloatArray, shape: tuple[int, int, int], h: float) -> Lattice:
    """Pad the grid by one cell on every side and lay out its neighbours."""
    if lower.shape != (3,) or len(shape) != 3 or min(shape) < 1 or not (0.0 < h < np.inf):
        raise MeshError(
            f"stuffing grid: lower {lower}, shape {shape}, h = {h} mm; expected three "
            "coordinates, three counts of at least 1 and a positive h"
        )
    dims = (int(shape[0]) + 3, int(shape[1]) + 3, int(shape[2]) + 3)
    if 2 * math.prod(dims) >= 2**31:
        raise ResourceError(
            f"stuffing grid of {math.prod(dims):.3g} cells exceeds 2**30; "
            f"use a larger h than {h} mm"
        )
    step = (2 * dims[1] * dims[2], 2 * dims[2], 2)
    offsets = np.zeros((2, 14), dtype=np.int64)
    ahead = np.zeros((2, 11), dtype=np.int64)
    for axis in range(3):
        offsets[:, 2 * axis] = -step[axis]
        offsets[:, 2 * axis + 1] = step[axis]
        ahead[:, axis] = step[axis]
    for q in range(8):
        up = sum(step[axis] for axis in range(3) if (q >> axis) & 1)
        offsets[0, 6 + q] = 1 - (sum(step) - up)
        offsets[1, 6 + q] = ahead[1, 3 + q] = up - 1
    return Lattice(dims=dims, lower=lower - h, h=h, offsets=offsets, ahead=ahead)


def evaluate(field: Field, points: FloatArray) -> FloatArray:
    """Call the field and refuse what is not one finite number per point."""
    values = np.asarray(field(points), dtype=np.float64)
    if values.shape != points.shape[1:]:
        raise MeshError(
            f"field returned shape {values.shape} for points {points.shape}; "
            f"expected {points.shape[1:]}"
        )
    if not np.isfinite(values).all():
        bad = np.flatnonzero(~np.isfinite(values))
        where = points.reshape(3, -1)[:, bad[0]]
        raise MeshError(
            f"field is not finite at {len(bad)} of {values.size} points, first at "
            f"({where[0]:.6g}, {where[1]:.6g}, {where[2]:.6g}) mm"
        )
    return values


def bricks(n: int, brick: int) -> Iterator[slice]:
    """Ranges of at most brick indices that cover n."""
    for begin in range(0, n, brick):
        yield slice(begin, min(begin + brick, n))


def sample(field: Field, lattice: Lattice, brick: int) -> FloatArray:
    """Field values at corners and centres, interleaved; unused centres count as outside."""
    values = np.full((*lattice.dims, 2), np.inf)
    for kind in range(2):
        axes = [
            lattice.lower[a] + lattice.h * (np.arange(lattice.dims[a] - kind) + 0.5 * kind)
            for a in range(3)
        ]
        for sx in bricks(len(axes[0]), brick):
            report_step("field on the grid", 0.5 * (kind + sx.start / len(axes[0])))
            for sy in bricks(len(axes[1]), brick):
                for sz in bricks(len(axes[2]), brick):
                    points = np.stack(
                        np.meshgrid(axes[0][sx], axes[1][sy], axes[2][sz], indexing="ij")
                    )
                    values[sx, sy, sz, kind] = evaluate(field, points)
    return values.ravel()


def require_enclosed(sign: NDArray[np.int8], values: FloatArray, lattice: Lattice) -> None:
    """Refuse a field without solid, or with solid on the outermost layer."""
    if sign.min() >= 0:
        raise MeshError(
            f"field has no solid in the grid: its least value is {values.min():.4g} "
            "(negative is inside); check the sign, the place and the size of the grid"
        )
    grid = sign.reshape(*lattice.dims, 2)
    for kind in range(2):
        part = grid[..., kind]
        used = part[tuple(slice(0, d - kind) for d in lattice.dims)]
        for axis in range(3):
            ends = np.take(used, (0, -1), axis=axis)
            if ends.min() <= 0:
                raise outside_grid(
                    lattice, f"{np.count_nonzero(ends <= 0)} points around it are inside"
                )


def outside_grid(lattice: Lattice, reason: str) -> MeshError:
    """Error of a solid that leaves the grid."""
    low = lattice.lower + lattice.h
    high = low + lattice.h * (np.array(lattice.dims) - 3)
    return MeshError(
        f"the solid reaches out of the stuffing grid {low} to {high} mm: {reason}; enlarge the "
        "grid or trim the field"
    )
