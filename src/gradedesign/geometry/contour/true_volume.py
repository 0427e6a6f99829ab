"""Vertices of a contour placed so that its triangles hold the volume of the field.

Triangles with their corners on a surface lie inside it where it is convex: a round strut loses
``0.41 (h / d)^2`` of its volume on a grid of ``h`` for a diameter ``d``, 18 % at 1.5 steps across.
The volume between a triangle and the surface is its area times the mean height of the surface above
it, and a quadratic height that is zero at the corners has three quarters of its value at the
centroid as its mean. That volume is shared out to the corners, which move along their grid edges
until they have gained it: so none leaves its cube, and the topology of the contour holds.

A second round takes heights at three points, for at edges they are no quadratics. The estimate of
the error that remains is the square of the share of volume that the first round moved, as what
remains at smooth surfaces is of the next order; the volume that the second round still found; the
volume that vertices at the ends of their grid edges could not gain; and, for edges, by how much
more the second round's heights come to than they do at smooth surfaces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray
from gradedesign.common.system.progress import report_step
from gradedesign.geometry.contour import _volume_kernels as kernels
from gradedesign.geometry.contour.resolution import Boxes
from gradedesign.geometry.contour.sample import BATCH, Shape, checked_values

#: Mean over the value at the centroid of a quadratic that is zero at the corners of a triangle:
#: every product of two barycentric coordinates has 1/12 and 1/9.
_MEAN_OVER_CENTROID = 0.75
_CENTROID = np.full((1, 3), 1 / 3)
#: Three points whose mean height is that of any quadratic, zero at the corners or not.
_INTERIOR = np.array([[4.0, 1.0, 1.0], [1.0, 4.0, 1.0], [1.0, 1.0, 4.0]]) / 6
#: Where vertices move by at most this share of every cell's solid, no second round follows: of what
#: was moved at edges of struts, whose heights are no quadratics, up to six tenths were not right.
SETTLED = 0.01
#: Of the heights, whatever their sign, that the first round finds at smooth surfaces the second one
#: finds at most this share again: round struts 0.3 to 0.6, networks 0.6, square and triangular ones
#: 0.8 to 1.1.
SMOOTH = 0.6
#: Surface farther from a triangle than this is another one; grid spacings. Chosen, not measured.
_FARTHEST = 0.5
#: The second point at which the field is evaluated lies this far from the centroid at least: the
#: rounding of single precision does not matter then; grid spacings.
_LEAST_APART = 0.05
#: Vertices with a smaller share of their area across their edge gain no volume by moving along it.
#: Chosen, not measured.
_LEAST_LEANING = 1e-3
#: Vertices closer to a solid layer than this lie on it, and stay there; grid spacings. Chosen, not
#: measured.
_ON_LAYER = 0.01
#: Cells of which less lies in the part belong to those beside them, as at the ends of the box.
_LEAST_ROOM = 0.5
#: Cells with less solid than this share of the median cell's are slivers that the part's faces
#: leave; chosen, not measured: their error is as small a share of a cell's volume.
_SLIVER = 0.05


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VolumeFit:
    """How vertices of a contour are placed for true volume."""

    lower: FloatArray  #: ``(3,)``, mm. Box around the part.
    upper: FloatArray  #: ``(3,)``, mm. Box around the part.
    #: mm. Edge of the cubic cells of the box in each of which the error is estimated; what is less
    #: than half a cell at its end belongs to the one before. The lattice beyond the box, which the
    #: part cuts off, does not count.
    cell: float
    #: Solid layers beside the lattice, points ``(3, n)`` mm to signed distances ``(n,)`` mm:
    #: vertices on them stay there, and none moves into them.
    solids: Field | None = None
    #: ``(p, q, r)``. Share of every cell that lies in the part; None: all of it.
    room: FloatArray | None = None
    memory: float = np.inf  #: bytes. That the contour and what is made of it may take.

    @property
    def shape(self) -> Shape:
        """Cells along each axis."""
        p, q, r = np.maximum(np.floor((self.upper - self.lower) / self.cell + 0.5), 1).astype(int)
        return int(p), int(q), int(r)

    def worst_cells(self, error: FloatArray, most: int) -> Boxes:
        """Boxes, lower and upper ``(3,)`` mm, of the cells ``(p, q, r)`` of the largest errors."""
        worst = np.argsort(error, axis=None, kind="stable")[::-1][:most]
        cells = np.stack(np.unravel_index(worst[error.ravel()[worst] > 0], self.shape), axis=1)
        last = np.array(self.shape) - 1
        return tuple(
            (
                self.lower + self.cell * cell,
                np.where(cell == last, self.upper, self.lower + self.cell * (cell + 1)),
            )
            for cell in cells
        )


def fitted_vertices(
    field: Field,
    vertices: FloatArray,
    faces: NDArray[np.int32],
    axes: NDArray[np.int8],
    grid: tuple[FloatArray, float],
    gap: float,
    fit: VolumeFit,
    counts: IntArray,
) -> FloatArray:
    """Move the vertices of a contour in place; return the estimated error of every cell.

    Returns (p, q, r) array: relative to the solid of the cell, 0 of slivers. Where less than half a
    cell lies in the part, relative to what half of it would hold: as at the ends of the box, it
    belongs to what is beside it.

    - ``field``: of which the vertices lie on the zero, about mm
    - ``vertices (n, 3)``, mm
    - ``faces (m, 3)``: outward oriented
    - ``axes (k,)``: of the grid edges on which the first vertices lie; no triangle has others
    - ``grid``: first node ``(3,)`` and spacing, mm
    - ``gap``: how far from the ends of its edge a vertex stays, in grid spacings
    - ``counts (p, q, r)``: grid nodes inside, by cell
    """
    h = grid[1]
    slope = np.zeros(len(faces), dtype=np.float32)
    held = np.abs(_above_layers(fit, vertices[: len(axes)])) <= _ON_LAYER * h
    target = (vertices, faces, axes, held, grid, gap, fit)
    solid = np.asarray(counts * h**3, dtype=np.float64)
    if fit.room is not None:
        solid = solid * np.maximum(_LEAST_ROOM / np.maximum(fit.room, _SLIVER), 1.0)
    moved, _, short = _move(field, target, (_CENTROID, _MEAN_OVER_CENTROID), slope, counts.shape)
    first = _shares(moved, solid)
    if first.max() <= SETTLED:
        return np.asarray(first**2 + np.abs(_shares(short, solid)))
    again, left, short = _move(field, target, (_INTERIOR, 1.0), slope, counts.shape)
    sharp = np.maximum(_shares(again, solid) - SMOOTH * first, 0.0)
    rest = np.abs(_shares(left, solid)) + np.abs(_shares(short, solid))
    return np.asarray(first**2 + rest + sharp)


def _move(
    field: Field,
    target: tuple[
        FloatArray,
        NDArray[np.int32],
        NDArray[np.int8],
        BoolArray,
        tuple[FloatArray, float],
        float,
        VolumeFit,
    ],
    rule: tuple[FloatArray, float],
    slope: NDArray[np.float32],
    shape: Shape,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Move vertices in place by the volume between their triangles and the surface.

    Returns ``size``, ``volume``, ``short``, each (p, q, r), mm^3: of what lies between triangles
    and surface by cell, without and with its sign, and what of it the vertices could not gain
    within their cubes.

    - ``target``: vertices, faces, axes, held vertices, grid, gap and fit of `fitted_vertices`
    - ``rule``: barycentric coordinates ``(k, 3)`` of the points at which heights are taken, and the
      mean height over the mean of these
    - ``slope (m,)``: of the field across every triangle; measured where it is 0, else used
    - ``shape``: number of cells
    """
    vertices, faces, axes, held, grid, gap, fit = target
    (bary, over), cells = rule, (fit.lower, fit.upper, fit.cell)
    leaning, area = np.zeros(len(axes)), np.zeros(len(axes))
    kernels.add_leaning(vertices, faces, axes, leaning, area)
    missing, off, short = np.zeros(len(axes)), np.zeros((2, *shape)), np.zeros(shape)
    for low in range(0, len(faces), BATCH):
        report_step("volume of the triangles", low / len(faces))
        some, known = faces[low : low + BATCH], slope[low : low + BATCH]
        mean = np.zeros(len(some))
        for weights in bary:
            middles, normals = np.zeros((3, len(some))), np.zeros((3, len(some)))
            kernels.points_and_normals(vertices, some, weights, middles, normals)
            mean += _heights(field, middles, normals, grid[1], known)
        mean *= over / len(bary)
        kernels.share_out(vertices, some, mean, held, leaning, area, cells, missing, off)
    before = vertices[: len(axes)].copy() if fit.solids is not None else vertices[:0]
    limits = (_LEAST_LEANING, _FARTHEST, gap)
    kernels.move_along_edges(vertices, axes, missing, leaning, area, grid, limits, cells, short)
    if fit.solids is not None:
        inside = np.flatnonzero(_above_layers(fit, vertices[: len(axes)]) < 0)
        vertices[inside] = before[inside]
    return off[0], off[1], short


def _heights(
    field: Field,
    points: FloatArray,
    normals: FloatArray,
    h: float,
    slope: NDArray[np.float32],
) -> FloatArray:
    """Height of the surface above points ``(3, m)`` along normals, ``(m,)``, mm.

    By the slope of the field, which a second point finds, and which is kept, where it is 0.
    """
    most = _FARTHEST * h
    value = checked_values(field, points)
    plain = np.clip(-value, -most, most)
    if not slope.any():
        step = np.where(plain < 0, -1.0, 1.0) * np.maximum(np.abs(plain), _LEAST_APART * h)
        slope[:] = (checked_values(field, points + step * normals) - value) / step
    # Where the field does not grow outward it is no surface of this triangle.
    rises = slope * most > np.abs(value)
    return np.where(rises, -value / np.where(rises, slope, 1.0), plain)


def _above_layers(fit: VolumeFit, vertices: FloatArray) -> FloatArray:
    """Distance of vertices ``(n, 3)`` from the solid layers, ``(n,)``, mm; infinite without any."""
    above = np.full(len(vertices), np.inf)
    if fit.solids is not None:
        for low in range(0, len(vertices), BATCH):
            some = slice(low, low + BATCH)
            above[some] = fit.solids(vertices[some].T)
    return above


def _shares(volume: FloatArray, solid: FloatArray) -> FloatArray:
    """Shares of the solid of every cell, 0 of slivers and empty cells, ``(p, q, r)``."""
    filled = solid > 0
    if not filled.any():
        return np.zeros(solid.shape)
    whole = filled & (solid >= _SLIVER * np.median(solid[filled]))
    return np.divide(volume, solid, out=np.zeros(solid.shape), where=whole)
