"""Samples of a field on the corners of sub-cells, and which bricks they leave whole or cut."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray, LipschitzField
from gradedesign.common.system.progress import report_step
from gradedesign.common.system.threads import in_ranges
from gradedesign.errors import LatticeError
from gradedesign.mechanics.finite_cell import _sample_kernels as kernels
from gradedesign.mechanics.finite_cell.grid import Grid

#: A field this close to 0, over the shortest edge of an element, counts as inside: where an edge of
#: the solid runs along corners of sub-cells, all corners of a tetrahedron inside may be 0.
_ON_SURFACE = 1e-10
#: Bounds of a field are taken larger by rounding, and by `_ON_SURFACE`.
_ROUNDING = 1.0 + 1e-6
#: Points per call of the field. Chosen, not measured.
POINTS = 2**18


def classify(
    field: Field, grid: Grid, subcells: int, wanted: BoolArray | None = None
) -> tuple[BoolArray, NDArray[np.int32], NDArray[np.int32], FloatArray]:
    """Sample the field layer by layer, where only some bricks are wanted only around those.

    A `LipschitzField` is sampled around the bricks that its surface may cut, with the same result.
    Returns ``solid (Z, Y, X)``: at every corner of a sub-cell; ``whole (k, 3)``, ``cut (k, 3)``:
    places of elements; ``samples (k, s+1, s+1, s+1)``: of cut elements, [element, z, y, x].
    """
    x, y, z = (
        grid.lower[d] + np.arange(grid.shape[d] * subcells + 1) * (grid.edges[d] / subcells)
        for d in range(3)
    )
    solid = np.zeros((z.size, y.size, x.size), dtype=bool)
    sampled, full = _to_sample(field, grid, subcells)
    if wanted is not None:
        sampled, full = sampled & wanted.T, full & wanted.T
    # Planes of a layer of elements with one more on either side.
    raw = np.zeros((subcells + 3, y.size, x.size))
    raw[-2:] = _sample(field, x, y, z[:2], _around(sampled, range(2), subcells))
    layer = np.zeros((subcells + 1, y.size, x.size))
    near = _ON_SURFACE * float(grid.edges.min())
    window = (subcells + 1,) * 3
    whole: list[NDArray[np.int32]] = []
    cut: list[NDArray[np.int32]] = []
    samples: list[FloatArray] = []
    for k in range(grid.shape[2]):
        report_step("finite cells of the field", k / grid.shape[2])
        raw[:3] = raw[-3:]
        ahead = range(k * subcells + 2, min((k + 1) * subcells + 2, z.size))
        raw[3 : 3 + len(ahead)] = _sample(
            field, x, y, z[ahead.start : ahead.stop], _around(sampled, ahead, subcells)
        )
        in_ranges(kernels.unbias, range(y.size), raw, kernels.EDGES, kernels.EDGES_PER_TET, layer)
        if k == 0:
            layer[:2] = raw[1:3]
        if k == grid.shape[2] - 1:
            layer[-2:] = raw[-3:-1]
        layer[np.abs(layer) <= near] = -near
        inside = np.where(_corners(sampled[k], subcells), layer < 0.0, _corners(full[k], subcells))
        solid[k * subcells : (k + 1) * subcells + 1] = inside
        j, i = np.nonzero(sampled[k])
        corners = sliding_window_view(inside, window)[0, ::subcells, ::subcells][j, i]
        some, every = full[k].copy(), full[k].copy()
        some[j, i], every[j, i] = corners.any(axis=(1, 2, 3)), corners.all(axis=(1, 2, 3))
        for chosen, places in ((every, whole), (some & ~every, cut)):
            j, i = np.nonzero(chosen)
            places.append(np.stack([i, j, np.full_like(i, k)], axis=1).astype(np.int32))
        view = sliding_window_view(layer, window)[0, ::subcells, ::subcells]
        samples.append(view[some & ~every])
    return solid, np.concatenate(whole), np.concatenate(cut), np.concatenate(samples)


def _to_sample(field: Field, grid: Grid, subcells: int) -> tuple[BoolArray, BoolArray]:
    """Bricks that the surface may cut, and full ones of the others, ``(nz, ny, nx)``.

    A field changes by its constant times half a brick's diagonal at most between the centre and
    the corners of sub-cells, and `kernels.unbias` by as much as twice the constant times an edge
    in each of its second differences.
    """
    shape = grid.shape[::-1]
    if not isinstance(field, LipschitzField):
        return np.ones(shape, dtype=bool), np.zeros(shape, dtype=bool)
    x, y, z = (grid.lower[d] + (np.arange(grid.shape[d]) + 0.5) * grid.edges[d] for d in range(3))
    lengths = np.linalg.norm(kernels.EDGES * (grid.edges / subcells), axis=1)
    correction = 2.0 * float(kernels.EDGES_PER_TET @ lengths) / kernels.DIFFERENCES
    reach = 0.5 * float(np.linalg.norm(grid.edges)) + correction
    value = _sample(field, x, y, z, np.ones((1, 1, 1), dtype=bool))
    sampled = np.abs(value) <= _ROUNDING * field.constant * reach
    return sampled, (value < 0.0) & ~sampled


def _around(bricks: BoolArray, planes: range, subcells: int) -> BoolArray:
    """Corners of sub-cells of bricks, and one beyond, in some planes, ``(Z, Y, X)``."""
    below, above = _beside(bricks.shape[0], subcells, 1)
    chosen = bricks[below[planes]] | bricks[above[planes]]
    return _corners(chosen, subcells, beyond=1)


def _corners(bricks: BoolArray, subcells: int, beyond: int = 0) -> BoolArray:
    """Corners of sub-cells of bricks ``(..., ny, nx)``, ``(..., Y, X)``."""
    for axis in (-2, -1):
        below, above = _beside(bricks.shape[axis], subcells, beyond)
        bricks = bricks.take(below, axis) | bricks.take(above, axis)
    return bricks


def _beside(count: int, subcells: int, beyond: int) -> tuple[IntArray, IntArray]:
    """First and last brick of a row that each corner of its sub-cells belongs to."""
    corner = np.arange(count * subcells + 1)
    first = -(-(corner - beyond) // subcells) - 1
    return np.maximum(first, 0), np.minimum((corner + beyond) // subcells, count - 1)


def _sample(
    field: Field, x: FloatArray, y: FloatArray, z: FloatArray, near: BoolArray
) -> FloatArray:
    """Field on a small grid, ``(Z, Y, X)``, in calls of bounded size.

    Where it is not ``near``, likewise, it is not asked for and counts as empty.
    """
    values = np.ones((z.size, y.size, x.size))
    if near.all():
        step = max(1, POINTS // (x.size * z.size))
        for first in range(0, y.size, step):
            part = slice(first, first + step)
            points = np.stack(np.meshgrid(z, y[part], x, indexing="ij")[::-1])
            values[:, part] = field(points)
    else:
        places = _in_blocks(near)
        for first in range(0, places.size, POINTS):
            k, j, i = np.unravel_index(places[first : first + POINTS], near.shape)
            values[k, j, i] = field(np.stack([x[i], y[j], z[k]]))
    if not np.isfinite(values).all():
        bad = int(np.count_nonzero(~np.isfinite(values)))
        raise LatticeError(f"the field of the solid is not finite at {bad} of its sample points")
    return values


def _in_blocks(near: BoolArray) -> NDArray[np.int32]:
    """Flat places where it is near, by cubes of 4 x 4 x 4 and in each by cubes of 2 x 2 x 2.

    Fields of many parts answer faster where points that follow each other are neighbours.
    """
    place = np.where(near, np.arange(near.size, dtype=np.int32).reshape(near.shape), -1)
    place = np.pad(place, [(0, -n % 4) for n in near.shape], constant_values=-1)
    z, y, x = (n // 4 for n in place.shape)
    place = place.reshape(z, 2, 2, y, 2, 2, x, 2, 2).transpose(3, 6, 0, 1, 4, 7, 2, 5, 8).ravel()
    return place[place >= 0]
