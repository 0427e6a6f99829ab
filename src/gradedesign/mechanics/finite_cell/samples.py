"""Samples of a field on the corners of sub-cells, and which bricks they leave whole or cut."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from gradedesign.arrays import BoolArray, Field, FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.common.system.threads import in_ranges
from gradedesign.errors import LatticeError
from gradedesign.mechanics.finite_cell import _sample_kernels as kernels
from gradedesign.mechanics.finite_cell.grid import Grid

#: A field this close to 0, over the shortest edge of an element, counts as inside: where an edge of
#: the solid runs along corners of sub-cells, all corners of a tetrahedron inside may be 0.
_ON_SURFACE = 1e-10
#: Points per call of the field. Chosen, not measured.
POINTS = 2**18


def classify(
    field: Field, grid: Grid, subcells: int, wanted: BoolArray | None = None
) -> tuple[BoolArray, NDArray[np.int32], NDArray[np.int32], FloatArray]:
    """Sample the field layer by layer, where only some bricks are wanted only around those.

    Returns
    -------
    solid : (Z, Y, X) bool array
        At every corner of a sub-cell.
    whole, cut : (k, 3) int32 array
        Places of elements.
    samples : (k, s+1, s+1, s+1) array
        Of cut elements, [element, z, y, x].
    """
    x, y, z = (
        grid.lower[d] + np.arange(grid.shape[d] * subcells + 1) * (grid.edges[d] / subcells)
        for d in range(3)
    )
    solid = np.zeros((z.size, y.size, x.size), dtype=bool)
    # Planes of a layer of elements with one more on either side.
    raw = np.zeros((subcells + 3, y.size, x.size))
    chosen_bricks = None if wanted is None else wanted.T
    raw[-2:] = _sample(field, x, y, z[:2], _around(chosen_bricks, 0, subcells))
    layer = np.zeros((subcells + 1, y.size, x.size))
    near = _ON_SURFACE * float(grid.edges.min())
    window = (subcells + 1,) * 3
    whole: list[NDArray[np.int32]] = []
    cut: list[NDArray[np.int32]] = []
    samples: list[FloatArray] = []
    for k in range(grid.shape[2]):
        report_step("finite cells of the field", k / grid.shape[2])
        raw[:3] = raw[-3:]
        ahead = slice(k * subcells + 2, (k + 1) * subcells + 2)
        raw[3 : 3 + z[ahead].size] = _sample(
            field, x, y, z[ahead], _around(chosen_bricks, k, subcells)
        )
        in_ranges(kernels.unbias, range(y.size), raw, kernels.EDGES, kernels.EDGES_PER_TET, layer)
        if k == 0:
            layer[:2] = raw[1:3]
        if k == grid.shape[2] - 1:
            layer[-2:] = raw[-3:-1]
        layer[np.abs(layer) <= near] = -near
        solid[k * subcells : (k + 1) * subcells + 1] = layer < 0.0
        view = sliding_window_view(layer, window)[0, ::subcells, ::subcells]
        inside = sliding_window_view(layer < 0.0, window)[0, ::subcells, ::subcells]
        some, every = inside.any(axis=(2, 3, 4)), inside.all(axis=(2, 3, 4))
        if chosen_bricks is not None:
            some, every = some & chosen_bricks[k], every & chosen_bricks[k]
        for chosen, places in ((every, whole), (some & ~every, cut)):
            j, i = np.nonzero(chosen)
            places.append(np.stack([i, j, np.full_like(i, k)], axis=1).astype(np.int32))
        samples.append(view[some & ~every])
    return solid, np.concatenate(whole), np.concatenate(cut), np.concatenate(samples)


def _around(wanted: BoolArray | None, layer: int, subcells: int) -> BoolArray | None:
    """Sample points, ``(Y, X)``, of the wanted bricks of a layer and the next, and one beyond."""
    if wanted is None:
        return None
    bricks = wanted[layer : layer + 2].any(axis=0)
    near = np.zeros([n * subcells + 1 for n in bricks.shape], dtype=bool)
    for j, i in np.argwhere(bricks) * subcells:
        near[max(j - 1, 0) : j + subcells + 2, max(i - 1, 0) : i + subcells + 2] = True
    return near


def _sample(
    field: Field, x: FloatArray, y: FloatArray, z: FloatArray, near: BoolArray | None = None
) -> FloatArray:
    """Field on a small grid, ``(Z, Y, X)``, in calls of bounded size.

    Where it is not ``near``, ``(Y, X)``, it is not asked for and counts as empty.
    """
    if near is not None:
        j, i = np.nonzero(near)
        values = np.ones((z.size, y.size, x.size))
        step = max(1, POINTS // z.size)
        for first in range(0, j.size, step):
            row, column = j[first : first + step], i[first : first + step]
            shape = (z.size, row.size)
            points = np.stack([np.broadcast_to(x[column], shape), np.broadcast_to(y[row], shape),
                               np.broadcast_to(z[:, None], shape)])  # fmt: skip
            values[:, row, column] = field(points)
        _require_finite(values)
        return values
    values = np.zeros((z.size, y.size, x.size))
    step = max(1, POINTS // (x.size * z.size))
    for first in range(0, y.size, step):
        part = slice(first, first + step)
        points = np.stack(np.meshgrid(z, y[part], x, indexing="ij")[::-1])
        values[:, part] = field(points)
    _require_finite(values)
    return values


def _require_finite(values: FloatArray) -> None:
    """Refuse samples that are not finite."""
    if not np.isfinite(values).all():
        bad = int(np.count_nonzero(~np.isfinite(values)))
        raise LatticeError(f"the field of the solid is not finite at {bad} of its sample points")
