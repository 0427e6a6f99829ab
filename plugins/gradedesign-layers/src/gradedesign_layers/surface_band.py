"""Signed distance to a closed surface in a narrow band, for many points near it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from gradedesign import LatticeError, SurfaceDistance, in_ranges
from gradedesign.fields import BoolArray, FloatArray, IntArray, compiled_values
from gradedesign_layers import _band_list_kernels as kernels
from gradedesign_layers._surface_band_kernels import BandArrays, banded_distances

#: Cubes whose lists are made at once, with room for all triangles of their parents. Chosen, not
#: measured.
_AT_ONCE = 1 << 18
#: Most cubes of the last level: about 100 MB are taken.
_MOST_CUBES = 12_000_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurfaceBand:
    """Triangles that may be nearest in small cubes around a surface.

    Attributes
    ----------
    outer : float, mm
        Half width of the band outside the surface.
    """

    arrays: BandArrays
    outer: float

    def __call__(self, points: FloatArray) -> FloatArray:
        """Signed distance at points ``(3, ...)`` mm, ``(...)``, mm, negative inside.

        Beyond the band a value of the right sign, beyond the band too and nearer to zero than
        the distance.
        """
        return compiled_values(
            banded_distances, np.asarray(points, dtype=np.float64), self.arrays, self.outer
        )


def surface_band(
    surface: SurfaceDistance, edge: float, *, inner: float, outer: float
) -> SurfaceBand:
    """List the nearest triangles of a surface in cubes, large ones first.

    Parameters
    ----------
    edge : float, mm
        Of the cubes; larger where they would be too many.
    inner, outer : float, mm
        Half widths of the band in which distances are exact.

    Raises
    ------
    LatticeError
        If edge or band are not positive.
    """
    if not (edge > 0 and inner > 0 and outer > 0):
        raise LatticeError(
            f"band of {inner:g} mm and {outer:g} mm in cubes of {edge:g} mm is impossible; "
            f"expected all above 0 mm"
        )
    tree = surface.tree
    lower, upper = tree.box[0, :3] - 1.01 * outer, tree.box[0, 3:] + 1.01 * outer
    edge = max(edge, float((np.prod(upper - lower) / _MOST_CUBES) ** (1 / 3)))
    size = np.ceil((upper - lower) / edge).astype(np.int64)
    origin = 0.5 * (lower + upper) - 0.5 * edge * size
    normals, ball = (
        np.ascontiguousarray(surface.normals[tree.order]),
        _balls(tree.triangles, tree.flat),
    )
    # One cube around all of them at first; it may be nearest to any triangle.
    wide = 1 << int(size.max() - 1).bit_length()
    cubes, parent = np.zeros((1, 3), dtype=np.int64), np.zeros(1, dtype=np.int64)
    every = len(tree.triangles)
    lists = (np.array([0, every]), np.arange(every, dtype=np.int32))
    # Cubes of one height lie together, as samples of one layer do.
    last, first, middle = np.roll(size, 1)
    grid = np.zeros((last, first, middle), dtype=np.float32).transpose(1, 2, 0)
    slot = np.full((last, first, middle), -1, dtype=np.int32).transpose(1, 2, 0)
    none = np.zeros((0, 0, 0), dtype=np.int32)
    while True:
        fixed = (tree.triangles, tree.flat, ball, normals, lists, origin, edge * wide)
        bound, count, member = _settled(fixed, cubes, parent, (inner, outer))
        unsettled = np.flatnonzero(count)
        number = np.full(len(cubes), -1, dtype=np.int64)
        number[unsettled] = np.arange(len(unsettled))
        kernels.paint(cubes, bound, wide, number, slot if wide == 1 else none, grid)
        lists = (np.append(0, np.cumsum(count[unsettled])), member)
        if wide == 1:
            break
        wide //= 2
        halves, parent = _halved(cubes[unsettled]), np.repeat(np.arange(len(unsettled)), 8)
        within = (halves * wide < size).all(axis=1)
        cubes, parent = halves[within], parent[within]
    arrays = BandArrays(tree.triangles, tree.flat, ball, normals, origin, edge, slot, grid, *lists)
    return SurfaceBand(arrays=arrays, outer=1.01 * outer)


def _settled(
    fixed: tuple[object, ...], cubes: IntArray, parent: IntArray, reach: tuple[float, float]
) -> tuple[NDArray[np.float32], IntArray, NDArray[np.int32]]:
    """Bounds of cubes, the lengths of their lists, and all lists; see `kernels.settle`."""
    first = cast("tuple[IntArray, NDArray[np.int32]]", fixed[4])[0]
    bound = np.zeros(len(cubes), dtype=np.float32)
    count = np.zeros(len(cubes), dtype=np.int64)
    members = []
    for low in range(0, len(cubes), _AT_ONCE):
        some = slice(low, low + _AT_ONCE)
        start = np.append(0, np.cumsum(np.diff(first)[parent[some]]))
        out = np.zeros(int(start[-1]), dtype=np.int32)
        in_ranges(kernels.settle, range(0, len(count[some]), kernels.CUBES), *fixed, cubes[some],
                  parent[some], reach, bound[some], start, out, count[some])  # fmt: skip
        ends = np.append(0, np.cumsum(count[some]))
        members.append(np.zeros(int(ends[-1]), dtype=np.int32))
        kernels.gather(start, count[some], out, ends, members[-1])
    return bound, count, np.concatenate(members)


def _balls(triangles: FloatArray, flat: BoolArray) -> FloatArray:
    """Balls around triangles and their planes as `BandArrays` holds them, ``(m, 8)``, mm."""
    a, b, c = triangles[:, :3], triangles[:, 3:6], triangles[:, 6:]
    centre = (b + c) / 3.0
    radius = np.max([np.linalg.norm(p - centre, axis=1) for p in (0.0 * b, b, c)], axis=0)
    normal = np.cross(b, c)
    normal[flat] = 0.0
    normal /= np.where(flat, 1.0, np.linalg.norm(normal, axis=1))[:, None]
    along = np.einsum("ij,ij->i", a, normal)
    return np.column_stack([a + centre, radius * (1.0 + 1e-9), normal, along])


def _halved(cubes: IntArray) -> IntArray:
    """The eight halves of cubes, ``(8 n, 3)``."""
    corner = np.stack(np.meshgrid(*[np.arange(2)] * 3, indexing="ij"), axis=-1).reshape(8, 3)
    return np.ascontiguousarray((2 * cubes[:, None] + corner).reshape(-1, 3))
