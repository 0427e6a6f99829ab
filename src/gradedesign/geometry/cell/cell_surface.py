"""Surface of a cell's solid and its curvature, from which the elements that it touches follow.

Counted on samples of one period: a line that runs through the period along an axis crosses the
surface as often as the surface's projection along this axis covers it (Cauchy-Crofton). The solid
grows by the area of its surface for every unit that this moves outward, and the area by twice the
integral of mean curvature (Steiner), so that this integral follows from how the area changes with
density: ``M = S / 2  dS / d rho`` per volume of the cell.

References
----------
L. A. Santalo (1976), Integral Geometry and Geometric Probability, chapters III.13 and III.14.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from gradedesign.arrays import FloatArray
from gradedesign.common.system.cache import content_key, load_arrays, store_arrays
from gradedesign.geometry.cell.cell import Cell, cell_key
from gradedesign.geometry.cell.shape import evaluate_shape

KIND = "cell-surfaces"
#: Samples along an edge of a cell, and at most along a period. Chosen, not measured.
SAMPLES, MOST_SAMPLES = 96, 160
#: Densities of the table. Chosen, not measured.
_STEPS = 25
#: Projected area along three axes over the area of a surface whose normals point everywhere alike.
PROJECTED = 1.5
#: Off faces of walls and struts, which often lie on even fractions of a cell; samples.
_OFF = np.array([0.137, 0.271, 0.419])


class CellSurface(NamedTuple):
    """Of a lattice, for every volume that it fills."""

    #: ``(...)``, 1/mm. Area of the surface projected along each of three axes, together: the
    #: integral of ``|n_x| + |n_y| + |n_z|``.
    projections: FloatArray
    #: ``(...)``, 1/mm^2. Integral of mean curvature over the surface, positive where the solid is
    #: convex.
    curvature: FloatArray


def cell_surface(cell: Cell, rho: FloatArray | float, cell_size: float) -> CellSurface:
    """Surface of a cell's solid and its mean curvature per volume of the cell.

    ``rho (...)``: relative density; beyond the cell's window, what is at its end. ``cell_size``,
    mm.
    """
    projections, curvature = _tables(cell)
    density = np.clip(np.asarray(rho, dtype=np.float64), *cell.window)
    return CellSurface(
        projections=np.asarray(projections(density)) / cell_size,
        curvature=np.asarray(curvature(density)) / cell_size**2,
    )


@lru_cache(maxsize=64)
def _tables(cell: Cell) -> tuple[PchipInterpolator, PchipInterpolator]:
    """Projections and curvature in cell units against density, kept in the user's cache."""
    key = content_key(KIND, cell_key(cell))
    stored = load_arrays(KIND, key)
    low, high = cell.window
    density = low + (high - low) * np.linspace(0.0, 1.0, _STEPS) ** 2
    projections = _projections(cell, density) if stored is None else stored["projections"]
    if stored is None:
        store_arrays(KIND, key, projections=projections)
    area = projections / PROJECTED
    curvature = 0.5 * area * np.gradient(area, density)
    return PchipInterpolator(density, projections), PchipInterpolator(density, curvature)


def _projections(cell: Cell, density: FloatArray) -> FloatArray:
    """Crossings of lines along the axes through a period, in cell units, ``(n,)``."""
    period = cell.family.period
    count = min(SAMPLES * period, MOST_SAMPLES)
    edge = period / count
    lines = [edge * (np.arange(count + 1) + off) for off in _OFF]
    points = np.stack(np.meshgrid(*lines, indexing="ij"))
    values = evaluate_shape(cell.family, cell.parameters, points)
    crossings = []
    for level in cell.level_of(density):
        inside = values < level
        changes = (
            np.diff(inside, axis=axis)[tuple(np.s_[: count + (k == axis)] for k in range(3))]
            for axis in range(3)
        )
        crossings.append(sum(map(np.count_nonzero, changes)))
    return np.array(crossings) * edge**2 / period**3
