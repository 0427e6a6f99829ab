"""Cells of graded size without shear: the map from three phase fields."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.fft import dctn, idctn
from scipy.ndimage import spline_filter

from gradedesign.arrays import Field, FloatArray, read_only
from gradedesign.errors import CaseError, DensityError, ResourceError
from gradedesign.geometry.maps._phase_kernels import centre_gradients, divergence, nearest_rotations
from gradedesign.geometry.maps._spline_kernels import PAD, spline_gradients, spline_values
from gradedesign.geometry.maps.cell_map import CellMap
from gradedesign.geometry.maps.size_law import within_tolerance

log = logging.getLogger(__name__)

#: Largest grid, nodes: 3 GB and minutes.
MOST_NODES = 8_000_000
#: Least number of grid steps in the smallest cell. A wave needs two samples a period at least.
_LEAST_STEPS = 2.0

#: Nodes added at each end before the spline filter, which errs there by 0.27 a node. 0.27^22 is
#: 3e-13, a rounding of the coordinates.
_BEYOND = 22


def graded_size_map(
    size_of: Field,
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    spacing: float,
    frame_of: Field | None = None,
    iterations: int = 3,
    origin: Sequence[float] | None = None,
) -> CellMap:
    """Map of cells whose size follows a field.

    Minimises the integral of ``|grad(u) - R(x) / L(x)|^2`` over the box: with ``R`` given, three
    Poisson problems with natural boundaries. Then ``R`` is set to the rotation nearest to ``L
    grad(u)`` and the problems are solved again: cells may turn in order to shear less and keep
    their size better. Where sizes can nearly be followed, cells are then brought within a tolerance
    of size and angles, see :mod:`gradedesign.geometry.maps.size_law`.

    Raises CaseError if the box is empty, the grid too coarse for the smallest cell, or the number
    of iterations negative. Raises DensityError if a size is not positive and finite. Raises
    ResourceError if the grid has more than `MOST_NODES` nodes. Returns CellMap: twice continuously
    differentiable (cubic B-splines). Sizes are met only as well as the field allows: see
    :func:`gradedesign.geometry.maps.map_report.map_report`.

    - ``size_of``: points ``(3, ...)`` mm to the size wanted ``(...)``, mm
    - ``lower (3,)``, ``upper (3,)``, mm: box around the part. Beyond it the map continues linearly.
    - ``spacing``, mm: longest step of the grid; each axis of the box gets a whole number of steps
    - ``frame_of``: points ``(3, ...)`` to rotations ``(3, 3, ...)`` whose row i is the direction in
      which coordinate i grows, such as principal directions of stress. By default the axes of the
      box. Rotation-free iterations leave these frames: use 0 to hold them.
    - ``iterations``: rotation-free iterations; with 0 nothing is brought within tolerances either
    - ``origin (3,)``, mm: a corner of a cell lies here; by default at ``lower``

    Notes
    -----
    A field L has an exact solution only where 1/L is the scale of a conformal map, which in three
    dimensions leaves inversions; everything else is a compromise. The alternation is that of
    Sorkine and Alexa, "As-rigid-as-possible surface modeling", 2007, section 3, for volumes.
    """
    if iterations < 0:
        raise CaseError(f"{iterations} rotation-free iterations are impossible; use 0 or more")
    began = time.perf_counter()
    start, steps, count = _grid(lower, upper, spacing)
    centres = _element_centres(start, steps, count)
    size = _checked_sizes(size_of, centres, steps)
    rotation = np.zeros((*count, 3, 3))
    rotation[:] = np.eye(3) if frame_of is None else np.moveaxis(frame_of(centres), (0, 1), (3, 4))
    solve = box_solver((count[0] + 1, count[1] + 1, count[2] + 1), steps)
    loads = divergence(rotation / size[..., None, None], steps)
    phases = np.stack([solve(load) for load in loads])
    for _ in range(iterations):
        matrix = centre_gradients(phases, steps) * size[..., None, None]
        rotation = nearest_rotations(matrix.reshape(-1, 3, 3), rotation.reshape(-1, 3, 3))
        rotation = rotation.reshape(*count, 3, 3)
        loads = divergence(rotation / size[..., None, None], steps)
        phases = np.stack([solve(load) for load in loads])
    if iterations:
        phases = within_tolerance(phases, rotation, size, steps, solve)
    log.info(
        "phase fields: %d nodes, %d rotation-free iterations, %.1f s",
        phases[0].size,
        iterations,
        time.perf_counter() - began,
    )
    typical = float(np.median(size))
    return _spline_map(phases, start, steps, start if origin is None else origin, typical)


def default_spacing(lower: ArrayLike, upper: ArrayLike, smallest: float) -> float:
    """Grid step for a smallest cell size, mm: a quarter of it, or what half a million nodes allow.

    Never more than half of the smallest cell, which `graded_size_map` needs.
    """
    volume = float(np.prod(np.asarray(upper, dtype=np.float64) - np.asarray(lower)))
    return min(max(0.25 * smallest, (volume / 5e5) ** (1 / 3)), smallest / _LEAST_STEPS)


def _grid(
    lower: ArrayLike, upper: ArrayLike, spacing: float
) -> tuple[FloatArray, FloatArray, tuple[int, int, int]]:
    """First node, step of each axis and number of elements."""
    start = np.asarray(lower, dtype=np.float64)
    extent = np.asarray(upper, dtype=np.float64) - start
    if extent.shape != (3,) or not (np.isfinite(extent).all() and (extent > 0).all()):
        raise CaseError(
            f"the box of the cell map has edges {extent.tolist()} mm; use positive ones"
        )
    if not (np.isfinite(spacing) and spacing > 0):
        raise CaseError(f"the grid step of the cell map is {spacing:g} mm; use a positive length")
    # Three elements at least: the ends are continued through three nodes.
    elements = np.maximum(np.ceil(extent / spacing - 1e-9), 3).astype(np.int64)
    nodes = float(np.prod(elements + 1.0))
    if nodes > MOST_NODES:
        raise ResourceError(
            f"a cell map with a grid step of {spacing:g} mm needs {nodes:.3g} nodes, more than "
            f"{MOST_NODES:.3g}; use a step of at least "
            f"{spacing * (nodes / MOST_NODES) ** (1 / 3):.3g} mm"
        )
    return start, extent / elements, (int(elements[0]), int(elements[1]), int(elements[2]))


def _element_centres(start: FloatArray, steps: FloatArray, count: tuple[int, ...]) -> FloatArray:
    """Centres of elements, ``(3, ex, ey, ez)``, mm."""
    lines = [o + h * (np.arange(n) + 0.5) for o, h, n in zip(start, steps, count, strict=True)]
    return np.stack(np.meshgrid(*lines, indexing="ij"))


def _checked_sizes(size_of: Field, centres: FloatArray, steps: FloatArray) -> FloatArray:
    """Sizes at element centres, positive and resolved by the grid, ``(ex, ey, ez)``."""
    size = np.asarray(size_of(centres), dtype=np.float64)
    if size.shape != centres.shape[1:]:
        raise DensityError(
            f"the size field returned shape {size.shape} for points {centres.shape}, expected "
            f"{centres.shape[1:]}"
        )
    bad = ~(np.isfinite(size) & (size > 0))
    if bad.any():
        x, y, z = centres[:, bad][:, 0]
        raise DensityError(
            f"the size field is {size[bad][0]:g} mm at ({x:.4g}, {y:.4g}, {z:.4g}) mm and not "
            f"positive at {np.count_nonzero(bad)} of {bad.size} points; expected positive sizes"
        )
    if steps.max() * _LEAST_STEPS > size.min() * (1 + 1e-9):
        raise CaseError(
            f"a grid step of {steps.max():.4g} mm is too coarse for cells of {size.min():.4g} mm; "
            f"use at most {size.min() / _LEAST_STEPS:.4g} mm"
        )
    return size


def _spline_map(
    phases: FloatArray,
    start: FloatArray,
    steps: FloatArray,
    origin: Sequence[float] | FloatArray,
    typical: float,
) -> CellMap:
    """Map that interpolates node values of the phases ``(3, nx, ny, nz)``."""
    crop = (slice(_BEYOND - PAD, PAD - _BEYOND),) * 3
    filtered = (spline_filter(_continued(p), order=3, mode="mirror")[crop] for p in phases)
    table = np.stack(list(filtered), axis=-1)
    table.flags.writeable = False
    start, steps = read_only(start), read_only(steps)

    def raw(points: FloatArray) -> FloatArray:
        x = np.asarray(points, dtype=np.float64)
        flat = read_only(x.reshape(3, -1))
        return spline_values(table, start, steps, flat).reshape(x.shape)

    shift = raw(np.asarray(origin, dtype=np.float64).reshape(3, 1))[:, 0]

    def coordinates(points: FloatArray) -> FloatArray:
        u = raw(points)
        return np.asarray(u - shift.reshape(3, *[1] * (u.ndim - 1)))

    def jacobian(points: FloatArray) -> FloatArray:
        x = np.asarray(points, dtype=np.float64)
        flat = read_only(x.reshape(3, -1))
        return spline_gradients(table, start, steps, flat).reshape(3, *x.shape)

    return CellMap(name="graded size", coordinates=coordinates, jacobian=jacobian, size=typical)


def _continued(values: FloatArray) -> FloatArray:
    """Node values with `_BEYOND` more on every side, on the parabola through the last three.

    The filter assumes values mirrored at the ends, where phases have their full slope.
    """
    steps = np.arange(_BEYOND, 0, -1.0)
    for axis in range(3):
        first = np.moveaxis(values, axis, 0)
        ends = []
        for a, b, c in ((first[0], first[1], first[2]), (first[-1], first[-2], first[-3])):
            k = steps.reshape(-1, *[1] * a.ndim)
            ends.append(a + k * (1.5 * a - 2 * b + 0.5 * c) + 0.5 * k**2 * (a - 2 * b + c))
        joined = np.concatenate([ends[0], first, ends[1][::-1]])
        values = np.moveaxis(joined, 0, axis)
    return np.ascontiguousarray(values)


def box_solver(shape: tuple[int, int, int], spacing: FloatArray) -> Callable[..., FloatArray]:
    """Direct solver on the whole box.

    Returns callable: loads ``(nx, ny, nz)`` that sum to 0, to the solution of mean 0 (weighted by
    the trapezoidal rule).

    ``shape``: nodes. ``spacing (3,)``, mm.

    Notes
    -----
    On a uniform line of linear elements with natural ends both the stiffness and the mass matrix,
    rows of the end nodes doubled, have the eigenvectors ``cos(pi k i / (n - 1))``; so the box is
    diagonalised by the type-1 cosine transform.
    """
    stiff, mass = [], []
    for count, h in zip(shape, spacing, strict=True):
        cosine = np.cos(np.pi * np.arange(count) / (count - 1))
        stiff.append((2 - 2 * cosine) / h)
        mass.append(h * (2 + cosine) / 3)
    (kx, ky, kz), (mx, my, mz) = stiff, mass
    eigen = (
        np.einsum("i,j,k->ijk", kx, my, mz)
        + np.einsum("i,j,k->ijk", mx, ky, mz)
        + np.einsum("i,j,k->ijk", mx, my, kz)
    )
    eigen[0, 0, 0] = np.inf  # the constant, which no load drives
    ends = [np.where(np.isin(np.arange(n), (0, n - 1)), 2.0, 1.0) for n in shape]
    doubled = np.einsum("i,j,k->ijk", *ends)

    def solve(load: FloatArray) -> FloatArray:
        return np.asarray(idctn(dctn(load * doubled, type=1) / eigen, type=1))

    return solve
