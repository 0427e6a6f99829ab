"""Cubes of a grid by the side of a part on which they lie, and a field where they matter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from gradedesign.arrays import Field, FloatArray
from gradedesign.geometry.contour import _side_kernels as kernels
from gradedesign.geometry.contour.sample import Shape
from gradedesign.geometry.contour.surface import BoxedGrid
from gradedesign.geometry.contour.true_volume import VolumeFit
from gradedesign.geometry.triangles.grid_classifier import mark_near, marked_inside
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points

#: Cubes that come this near to the part's surface count as near, in grid spacings. Chosen, not
#: measured.
CLEARANCE = 0.1


def cube_sides(part: SurfaceMesh, origin: FloatArray, shape: Shape, h: float) -> NDArray[np.uint8]:
    """Where every cube of a grid lies: `NEAR`, `DEEP`, `BESIDE` or `BEYOND` of `_side_kernels`.

    Near are the cubes that a triangle of the part comes to, by separating axes. Of the
    others their middles tell the side. Cubes that would touch another one along an edge only, near
    ones between, count as near too, so that the border of the near ones is a manifold along its
    edges.

    Returns (a, b, c) uint8 array: deep cubes lie inside, those beside and beyond outside, all of
    them farther than `CLEARANCE` spacings from the surface; those beside touch a near one.

    - ``part``: closed
    - ``origin (3,)``, mm: first node of the grid
    - ``shape``: number of nodes
    - ``h``, mm: spacing
    """
    corners = (corner_points(part) - origin) / h
    cubes = tuple(n - 1 for n in shape)
    sides = marked_inside(corners - 0.5, cubes, kernels.DEEP, kernels.BEYOND)
    mark_near(corners, CLEARANCE, kernels.NEAR, sides)
    while kernels.take_out_edges(sides):
        pass
    around_near = binary_dilation(sides == kernels.NEAR, np.ones((3, 3, 3)))
    sides[around_near & (sides == kernels.BEYOND)] = kernels.BESIDE
    return sides


def room_in_part(sides: NDArray[np.uint8], grid: BoxedGrid, fit: VolumeFit) -> FloatArray:
    """Share of every cell of a fit that lies in the part, ``(p, q, r)``, by the cubes of a grid.

    Half of the cubes that the part's surface passes counts.
    """
    twice = np.zeros(4, dtype=np.uint8)
    twice[[kernels.NEAR, kernels.DEEP]] = 1, 2
    held, count = twice[sides], 2 * np.ones(1)
    for axis, cells in enumerate(fit.shape):
        middles = grid.origin[axis] + grid.h * (np.arange(sides.shape[axis]) + 0.5)
        first = np.searchsorted(middles, fit.lower[axis] + fit.cell * np.arange(cells))
        end = int(np.searchsorted(middles, fit.upper[axis]))
        held = np.add.reduceat(held.take(range(end), axis), first, axis, dtype=np.float64)
        count = np.multiply.outer(count, np.diff(first, append=end))
    return np.asarray(held / count[0])


def where_wanted(field: Field, sides: NDArray[np.uint8], origin: FloatArray, h: float) -> Field:
    """The field at points that touch a cube not beyond the part, and ``h`` elsewhere."""

    def wanted(points: FloatArray) -> FloatArray:
        flat = np.ascontiguousarray(np.asarray(points, dtype=np.float64).reshape(3, -1))
        near = kernels.touching(sides, flat, origin, h)
        if near.all():
            return field(points)
        values = np.full(flat.shape[1], h)
        if near.any():
            values[near] = field(flat[:, near])
        return values.reshape(np.shape(points)[1:])

    return wanted
