"""From a field to a closed, manifold triangle surface.

Above 300 lines: the contour of slabs and what closes, places and joins their triangles.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray
from gradedesign.common.system.progress import report_step
from gradedesign.errors import LatticeError
from gradedesign.geometry.contour._diagonal_kernels import (
    fitted_normals,
    flip_diagonals,
    opposite_triangles,
)
from gradedesign.geometry.contour._marching_kernels import count_slab, edge_points, march_slab
from gradedesign.geometry.contour._marching_table import marching_table
from gradedesign.geometry.contour._side_kernels import NEAR
from gradedesign.geometry.contour._surface_kernels import cut_at_box, nudge, unpaired_edges
from gradedesign.geometry.contour._volume_kernels import count_inside
from gradedesign.geometry.contour.resolution import require_room
from gradedesign.geometry.contour.sample import BATCH, NODES, Shape, checked_values, sample_slabs
from gradedesign.geometry.contour.true_volume import VolumeFit, fitted_vertices
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, enclosed_volume

log = logging.getLogger(__name__)

#: Node values closer to zero than this, in grid spacings, count as just outside. So that no vertex
#: falls onto a node, where faces would collapse. Chosen, not measured.
_NUDGE = 1e-6
#: Vertices keep this distance from the ends of their grid edge, in grid spacings. So that no two
#: vertices of a node coincide. Chosen, not measured.
END_GAP = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Contour:
    """Contour of a field on a cubic grid, the triangles of deep cubes apart."""

    #: ``(n, 3)``, mm. On the grid edges, then the inside nodes that are corners of caps.
    vertices: FloatArray
    deep: NDArray[np.int32]  #: ``(m, 3)``. Triangles of deep and of near cubes; outward oriented.
    near: NDArray[np.int32]  #: As `deep`.
    #: ``(m, 3)``. Triangles over the faces between near and deep cubes, and between near cubes and
    #: others, where they are inside. They close ``near``.
    inner: NDArray[np.int32]
    outer: NDArray[np.int32]  #: As `inner`.
    #: ``(p, q, r)``. Estimated error of the volume of the cells of a `VolumeFit`, relative to their
    #: solid; none without one.
    volume_errors: FloatArray

    @property
    def count(self) -> int:
        """Number of triangles without the caps."""
        return len(self.deep) + len(self.near)


def extract_surface(
    field: Field, lower: ArrayLike, upper: ArrayLike, h: float, *, nodes: int = NODES
) -> SurfaceMesh:
    """Closed, manifold surface of ``field <= 0`` inside a box, outward oriented.

    The field is sampled on a cubic grid in slabs of bounded memory and contoured with marching
    cubes; vertices are numbered by the grid edge they lie on, plane by plane. Each vertex is
    then moved along its grid edge by one secant step to the field's own zero, and of the two
    diagonals of neighbouring triangles that is taken whose middle is nearer to the surface. Node
    values within
    ``1e-6 h`` of zero count as ``+1e-6 h``, and vertices stay ``1e-3 h`` away from grid nodes, so
    no triangle degenerates and none has to be removed.

    Returns SurfaceMesh: every edge is shared by exactly two opposed triangles; the volume is
    positive. Raises LatticeError if the field has no solid on the grid, is not finite, or the
    surface is not closed.

    - ``field``: points ``(3, ...)`` mm to values, negative inside, roughly a distance in mm
    - ``lower (3,)``, ``upper (3,)``, mm: the solid is cut at this box, so it is always closed. The
      grid is laid half a spacing outside ``lower``: faces of the box lie between nodes.
    - ``h``, mm: grid spacing
    - ``nodes``: grid nodes held at once, about
    """
    grid = boxed_grid(lower, upper, h)
    mesh = contour(field, grid, nodes=nodes)
    surface = SurfaceMesh(vertices=mesh.vertices, faces=mesh.near.astype(np.int64))
    report_step("checking the surface")
    require_closed(surface)
    return surface


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BoxedGrid:
    """A cubic grid of nodes and the box at which a solid on it ends."""

    lower: FloatArray  #: ``(3,)``, mm. The box; its faces lie between nodes.
    upper: FloatArray  #: ``(3,)``, mm. The box; its faces lie between nodes.
    shape: Shape  #: Number of nodes.
    h: float  #: mm. Spacing.

    @property
    def origin(self) -> FloatArray:
        """First node, ``(3,)``, mm."""
        return self.lower - 0.5 * self.h


def boxed_grid(lower: ArrayLike, upper: ArrayLike, h: float) -> BoxedGrid:
    """The grid of spacing ``h`` mm that covers a box.

    Raises LatticeError if the box is empty or the spacing not positive.
    """
    lower, upper = (np.array(end, dtype=np.float64) for end in (lower, upper))
    if not (upper > lower).all() or not h > 0:
        raise LatticeError(f"box {lower} to {upper} mm with spacing {h:g} mm is empty")
    x, y, z = (int(n) for n in np.floor((upper - lower) / h + 0.5 + 1e-9) + 2)
    return BoxedGrid(lower=lower, upper=upper, shape=(x, y, z), h=h)


def contour(
    field: Field,
    grid: BoxedGrid,
    *,
    sides: NDArray[np.uint8] | None = None,
    fit: VolumeFit | None = None,
    nodes: int = NODES,
) -> Contour:
    """Contour a field on a grid as `extract_surface` does, some cubes apart.

    Raises LatticeError if the field has no solid on the grid, or is not finite. Raises
    ResourceError if it takes more than the memory of the fit.

    ``sides (a, b, c)``: of the cubes, see `cube_sides`; all are near by default. ``fit``: vertices
    then move along their grid edges until the triangles hold the field's volume. ``nodes``: grid
    nodes held at once, about.
    """
    began = perf_counter()
    boxed = _cut_at_box(field, grid.lower, grid.upper)
    h, (_, ny, nz) = grid.h, grid.shape
    if sides is None:
        sides = np.full([n - 1 for n in grid.shape], NEAR, dtype=np.uint8)
    number = np.full((2, 3, ny, nz), -1, dtype=np.int32)
    corner = np.zeros((2, ny, nz), dtype=np.int32)
    table = marching_table()
    vertices: list[FloatArray] = []
    corners: list[FloatArray] = []
    faces: tuple[list[NDArray[np.int32]], ...] = ([], [], [], [], [])
    axes: list[NDArray[np.int8]] = []
    inside = np.zeros((0, 0, 0) if fit is None else fit.shape, dtype=np.int64)
    count, cornered = 0, 0
    for piece in sample_slabs(boxed, grid.origin, grid.shape, h, nodes=nodes):
        values = piece.values
        nudge(values, _NUDGE * h)
        total = count_slab(values, piece.first, table[1], sides)
        edges, ends, nodes_of_caps, *triangles = march_slab(
            values, piece.first, table, sides, total, (count, cornered), number, corner
        )
        first = grid.origin + np.array([h * piece.first, 0.0, 0.0])
        vertices.append(_placed(boxed, edges, ends, first, h))
        axes.append(edges[:, 3].astype(np.int8))
        if fit is not None:
            count_inside(values, first, h, (fit.lower, fit.upper, fit.cell), inside)
        corners.append(first + h * nodes_of_caps)
        for some, more in zip(faces, triangles, strict=True):
            some.append(more)
        count, cornered = count + len(edges), cornered + len(nodes_of_caps)
        if fit is not None:
            done = (piece.first + len(values) - 1) / (grid.shape[0] - 1)
            require_room(count, done, sides.size, fit.memory, h)
    if not count:
        raise LatticeError(
            f"no solid on a grid of {grid.shape[0]} x {ny} x {nz} nodes at {h:g} mm: "
            f"the lattice misses the part, or its walls are thinner than the grid"
        )
    if count + cornered >= 2**31:
        raise LatticeError(
            f"the surface has {count + cornered} vertices, at most {2**31 - 1} can be numbered; "
            f"use a coarser grid or a smaller part"
        )
    places, edge_axes = np.concatenate(vertices + corners), np.concatenate(axes)
    del vertices, corners
    result = _joined(boxed, places, edge_axes, faces, grid, (fit, inside))
    log.info(
        "surface: %d x %d x %d nodes at %g mm, %d triangles, %.1f s",
        *(*grid.shape, h, result.count, perf_counter() - began),
    )
    return result


def _joined(
    field: Field,
    places: FloatArray,
    axes: NDArray[np.int8],
    faces: tuple[list[NDArray[np.int32]], ...],
    grid: BoxedGrid,
    fit: tuple[VolumeFit | None, IntArray],
) -> Contour:
    """The contour of the slabs' triangles, with better diagonals and vertices moved by the fit.

    ``faces`` lists deep and near triangles, those beside, and both caps. ``fit`` comes with the
    nodes inside by cell.
    """
    inner, outer = (np.concatenate(some) for some in faces[3:])
    for caps in (inner, outer):
        caps[caps < 0] = len(axes) - 1 - caps[caps < 0]
    ends = np.cumsum([sum(map(len, some)) for some in faces[:3]])
    triangles = np.concatenate(faces[0] + faces[1] + faces[2])
    for some in faces:
        some.clear()
    flips = _with_better_diagonals(places, triangles, ends[:2], grid)
    log.info("%d diagonals flipped", flips)
    errors = np.zeros((0, 0, 0))
    how, inside = fit
    if how is not None:
        lattice = (grid.origin, grid.h)
        errors = fitted_vertices(field, places, triangles, axes, lattice, END_GAP, how, inside)
    deep, near, _ = np.split(triangles, ends[:2])
    return Contour(
        vertices=places, deep=deep, near=near, inner=inner, outer=outer, volume_errors=errors
    )


def _with_better_diagonals(
    vertices: FloatArray, faces: NDArray[np.int32], ends: IntArray, grid: BoxedGrid
) -> int:
    """Flip diagonals of triangles in place, each group with an end by itself; how many."""
    report_step("diagonals of the triangles")
    opposite = opposite_triangles(faces, len(vertices))
    normals = fitted_normals(vertices, faces, opposite, grid.h)
    return flip_diagonals(vertices, faces, opposite, normals, ends, grid.origin, grid.h)


def require_closed(surface: SurfaceMesh) -> float:
    """Enclosed volume, mm^3, of a surface that is closed, manifold and outward oriented.

    Raises LatticeError if an edge is not shared by exactly two opposed triangles, or the volume is
    not positive.
    """
    torn, overloaded = unpaired_edges(surface.faces, len(surface.vertices))
    if torn or overloaded:
        raise LatticeError(
            f"the surface is not closed: {torn} open or misoriented edges and {overloaded} "
            f"edges with more than two triangles, expected none; use a finer grid"
        )
    volume = enclosed_volume(surface)
    if not volume > 0:
        raise LatticeError(
            f"the surface encloses {volume:g} mm^3, expected a positive volume; a field is "
            f"negative inside the solid"
        )
    return volume


def _cut_at_box(field: Field, lower: FloatArray, upper: FloatArray) -> Field:
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)

    def boxed(points: FloatArray) -> FloatArray:
        values = np.array(field(points), dtype=np.float64, order="C")
        if values.shape == points.shape[1:]:  # else the caller refuses it
            flat = np.ascontiguousarray(points, dtype=np.float64).reshape(3, -1)
            cut_at_box(values.reshape(-1), flat, middle, half)
        return values

    return boxed


def _placed(
    field: Field, edges: IntArray, ends: FloatArray, first: FloatArray, h: float
) -> FloatArray:
    """Zero of the field on every grid edge, ``(n, 3)``, mm: linear, then one secant step."""
    vertices = np.zeros((len(edges), 3))
    for low in range(0, len(edges), BATCH):
        part = slice(low, low + BATCH)
        a, b = ends[part].T
        at = np.clip(a / (a - b), END_GAP, 1 - END_GAP)
        value = checked_values(field, edge_points(edges[part], at, first, h))
        at = _secant(at, value, a, b)
        vertices[part] = edge_points(edges[part], at, first, h).T
    return vertices


def _secant(at: FloatArray, value: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    """Zero of the chord between a trial and the end of opposite sign, as a share of the edge."""
    before: BoolArray = (value < 0) == (a < 0)  # the trial has the sign of the edge's start
    x0, f0 = np.where(before, at, 0.0), np.where(before, value, a)
    x1, f1 = np.where(before, 1.0, at), np.where(before, b, value)
    return np.clip(x0 + (x1 - x0) * f0 / (f0 - f1), END_GAP, 1 - END_GAP)
