"""Inside and outside of closed surfaces, at points and on grids, by the triangles above a place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import BoolArray, FloatArray, IntArray, lock
from gradedesign.common.system.threads import in_ranges
from gradedesign.errors import MeshError
from gradedesign.geometry.triangles import _grid_kernels as kernels
from gradedesign.geometry.triangles.surface_mesh import (
    SurfaceMesh,
    corner_points,
    enclosed_volume,
    unbalanced_edge_count,
)

#: Columns per triangle, at most. Chosen, not measured.
_MOST_COLUMNS = 4
#: Points that are worth a thread. Chosen, not measured.
_AT_ONCE = 1024

#: Rays along each of the three axes, unless said otherwise.
RAYS = 128 * 128
#: Where in its cell of the grid a ray passes, and a turn of half a radian of the grid about the
#: rays: off the round numbers and the directions at which parts have edges.
_OFFSET = (0.5 + 1.0 / np.pi**3, 0.5 - 1.0 / np.e**3)
_TURN = np.array([[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GridClassifier:
    """Triangles of a closed surface sorted into columns along the shortest side of its box."""

    corners: FloatArray  #: ``(m, 3, 3)``, mm. Coordinates in the order of ``axes``.
    tops: FloatArray  #: ``(m,)``, mm. Largest last coordinate of every triangle.
    axes: IntArray  #: ``(3,)``. Columns run along the last of them.
    lower: FloatArray  #: ``(2,)``, mm.
    step: float  #: mm. Edge of a column.
    shape: IntArray  #: ``(2,)``.
    #: Triangles of column c are ``member[first[c]:first[c + 1]]``, from the top down.
    first: IntArray
    member: IntArray  #: As `first`.


def build_classifier(surface: SurfaceMesh) -> GridClassifier:
    """Sort the triangles of a closed surface into columns.

    Raises MeshError if the surface is empty, open or turned inside out.
    """
    open_edges = unbalanced_edge_count(surface)
    if len(surface.faces) == 0 or open_edges:
        raise MeshError(
            f"inside and outside: the surface has {len(surface.faces)} triangles and {open_edges} "
            "edges that are not passed equally often from both sides; expected a closed, "
            "consistently oriented surface, repair it"
        )
    volume = enclosed_volume(surface)
    if not volume > 0:
        raise MeshError(
            f"inside and outside: the surface encloses {volume:.6g} mm^3; expected a positive "
            "volume, turn its triangles around"
        )
    corners = corner_points(surface)
    extent = np.ptp(corners, axis=(0, 1))
    last = int(np.argmin(extent))
    axes = np.array([(last + 1) % 3, (last + 2) % 3, last])
    corners = np.ascontiguousarray(corners[:, :, axes])
    lower, extent = corners.min(axis=(0, 1))[:2], extent[axes[:2]]
    least = np.sqrt(extent.prod() / (_MOST_COLUMNS * len(corners)))
    step = float(max(np.ptp(corners[:, :, :2], axis=1).mean(), least))
    shape = np.floor(extent / step).astype(np.int64) + 1
    tops = corners[:, :, 2].max(axis=1)
    order = np.argsort(-tops, kind="stable")
    first = np.zeros(int(shape.prod()) + 1, dtype=np.int64)
    grid = (corners, order, lower, step, shape)
    kernels.fill_columns(*grid, first, np.zeros(0, dtype=np.int64))
    np.cumsum(first, out=first)
    member = np.zeros(int(first[-1]), dtype=np.int64)
    kernels.fill_columns(*grid, first[:-1].copy(), member)
    return GridClassifier(
        corners=corners,
        tops=tops,
        axes=axes,
        lower=lower,
        step=step,
        shape=shape,
        first=first,
        member=member,
    )


def winding_at(
    classifier: GridClassifier, points: FloatArray, clearance: FloatArray | None = None
) -> IntArray:
    """Winding number of a closed surface about points.

    ``points (3, n)``, mm. ``clearance (n,)``, mm: lower bounds of the points' distances to the
    surface: consecutive points that the surface cannot separate are evaluated together. Returns
    ``(n,)``: 1 inside an outward surface and 0 outside; more where it overlaps itself, negative
    where it is turned inside out. Of a point on the surface, that of either side.
    """
    n = points.shape[1]
    result = np.zeros(n, dtype=np.int64)
    in_ranges(
        kernels.windings,
        range(0, n, _AT_ONCE),
        classifier.corners,
        classifier.tops,
        classifier.lower,
        classifier.step,
        classifier.shape,
        classifier.first,
        classifier.member,
        np.ascontiguousarray(points, dtype=np.float64),
        classifier.axes,
        np.zeros(n) if clearance is None else clearance,
        result,
    )
    return result


def _lines(corners: FloatArray, shape: IntArray) -> tuple[IntArray, FloatArray, IntArray]:
    """Crossings of lines along the third axis, line by line; see `kernels.cross_lines`."""
    first = np.zeros(int(shape.prod()) + 1, dtype=np.int64)
    none = (np.zeros(0), np.zeros(0, dtype=np.int64))
    kernels.cross_lines(corners, shape, first, *none)
    np.cumsum(first, out=first)
    # One more than there are: no heights would mean to count.
    height, turn = np.zeros(first[-1] + 1), np.zeros(first[-1] + 1, dtype=np.int64)
    kernels.cross_lines(corners, shape, first[:-1].copy(), height, turn)
    return first, height, turn


def marked_inside(
    corners: FloatArray, shape: tuple[int, ...], inside: int = 1, outside: int = 0
) -> NDArray[np.uint8]:
    """Marks of the places of a grid by whether they lie inside a closed surface.

    Returns (nx, ny, nz) uint8 array: ``inside`` where the winding number is at least 1, else
    ``outside``.

    ``corners (m, 3, 3)``: in steps of the grid from its first place.
    """
    marks = np.zeros(shape, dtype=np.uint8)
    lines = _lines(np.ascontiguousarray(corners), np.array(shape[:2]))
    in_ranges(kernels.fill_inside, range(shape[0]), *lines, inside, outside, marks)
    return marks


def mark_near(corners: FloatArray, clearance: float, mark: int, marks: NDArray[np.uint8]) -> None:
    """Mark the cubes of a grid that triangles come close to, by separating axes.

    ``corners (m, 3, 3)``: in cubes from the corner of the first. ``clearance``, cubes: along each
    axis. ``marks (nx, ny, nz)``: changed in place.
    """
    kernels.mark_near(np.ascontiguousarray(corners), clearance, mark, marks)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VoxelGrid:
    """A cubic grid in axes of its own."""

    frame: FloatArray  #: ``(3, 3)``. Rows are its axes, a rotation.
    first: FloatArray  #: ``(3,)``, mm. Centre of the first voxel along these axes.
    step: float  #: mm.
    shape: tuple[int, int, int]

    def __post_init__(self) -> None:
        lock(self, frame=(3, 3), first=(3,))

    def place(self, index: FloatArray) -> tuple[float, float, float]:
        """Place of an index ``(3,)``, which need not be whole, in the axes of the part, mm."""
        x, y, z = ((self.first + self.step * np.asarray(index)) @ self.frame).tolist()
        return x, y, z


def grid_around(surface: SurfaceMesh, frame: FloatArray, step: float, margin: int) -> VoxelGrid:
    """The grid around a surface with ``margin`` empty voxels on every side.

    The lowest of its layers that may be solid begins where the surface does.
    """
    turned = surface.vertices @ frame.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    nx, ny, nz = (int(n) + 2 * margin for n in np.maximum(np.ceil((high - low) / step - 1e-9), 1))
    return VoxelGrid(frame=frame, first=low + (0.5 - margin) * step, step=step, shape=(nx, ny, nz))


def solid_voxels(surface: SurfaceMesh, grid: VoxelGrid) -> BoolArray:
    """Voxels whose centre lies inside a closed surface, where its winding number is at least 1."""
    turned = (surface.vertices @ grid.frame.T - grid.first) / grid.step
    return marked_inside(turned[surface.faces], grid.shape).view(np.bool_)


class WindingVolumes(NamedTuple):
    """Answer of :func:`winding_volumes`."""

    solid: float  #: mm^3. Volume with a winding number of at least 1.
    #: mm^3. Integral of the winding number beyond 1: what the enclosed volume counts too often.
    excess: float
    #: mm^3. Integral of the magnitude of negative winding numbers: what it takes off.
    reversed: float


def winding_volumes(corners: FloatArray, rays: int = RAYS) -> WindingVolumes:
    """Volumes by winding number, from rays along the three axes.

    The enclosed volume of a closed surface is ``solid + excess - reversed``; a surface that
    neither overlaps itself nor turns inside out has neither excess nor reversed volume.

    Raises MeshError if the surface is open.

    ``corners (m, 3 corners, 3 coordinates)``, mm: of a closed, consistently oriented surface.
    ``rays``: along each axis, about.
    """
    enclosed = np.zeros((3, 3))
    for axis in range(3):
        turned = np.roll(corners, 2 - axis, axis=2)
        turned = turned - turned.min(axis=(0, 1))
        turned[:, :, :2] @= _TURN
        turned -= turned.min(axis=(0, 1))
        extent = turned.max(axis=(0, 1))[:2]
        share = np.sqrt(rays / np.prod(extent)) if extent.all() else 1.0
        shape = np.clip(np.ceil(extent * share), 16, max(16, rays // 16)).astype(np.int64)
        step = np.maximum(extent, 1e-300) / shape
        turned[:, :, :2] = turned[:, :, :2] / step - _OFFSET
        *lengths, torn = kernels.line_lengths(*_lines(turned, shape))
        if torn:
            raise MeshError(
                f"volumes by winding number: {torn} of {shape.prod()} rays enter and leave the "
                "surface unequally often; expected a closed, consistently oriented surface"
            )
        enclosed[axis] = np.array(lengths) * np.prod(step)
    return WindingVolumes(*enclosed.mean(axis=0).tolist())
