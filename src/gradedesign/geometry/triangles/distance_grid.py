"""Signed distance to triangles on a regular grid: exact near them, swept far away."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gradedesign.arrays import BoolArray, FloatArray, IntArray, locked
from gradedesign.errors import MeshError
from gradedesign.geometry.triangles import _distance_grid_kernels as kernels
from gradedesign.geometry.triangles.closest import build_triangle_tree
from gradedesign.geometry.triangles.fast_winding import WindingTree, agreeing, winding_tree
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points
from gradedesign.geometry.triangles.unbalanced_edges import unbalanced_edge_count

#: Nodes along the edge of a brick.
SIDE = kernels.SIDE
#: Spacings from the triangles beyond which neighbours on the grid lie on one side of them: half of
#: one; more where the triangles leave holes.
_APART, _APART_OPEN = 0.5 + 1e-6, 0.75
#: Even nodes within so many spacings of the triangles hand their closest points on. Chosen, not
#: measured.
_SEEDS = 2.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DistanceBricks:
    """Signed distance on a regular grid, stored near the surface only.

    Attributes
    ----------
    lower : (3,) array, mm
        First node.
    spacing : float, mm
    shape : (int, int, int)
        Nodes along x, y, z.
    band : float, mm
        Distances are exact up to here.
    slot : (a, b, c) int array
        By brick of 8 x 8 x 8 nodes its place in ``values``; -1 where no triangle is within the
        band.
    values : (n, 8, 8, 8) float32 array, mm
        Negative inside; ``band`` with the sign beyond it.
    inside : (a, b, c) bool array
        Whether a brick without values lies inside.
    """

    lower: FloatArray
    spacing: float
    shape: tuple[int, int, int]
    band: float
    slot: IntArray
    values: NDArray[np.float32]
    inside: BoolArray


def distance_bricks(
    surface: SurfaceMesh,
    lower: ArrayLike,
    spacing: float,
    shape: tuple[int, int, int],
    *,
    band: float = 3.0,
) -> DistanceBricks:
    """Signed distance of the nodes of a grid near triangles, by bricks; the sign everywhere.

    Inside is where the winding number is above one half. Triangles may be missing, doubled, turned
    around or pass through each other: where an edge is open or passed unequally often, triangles
    that disagree with those about them count turned around.

    Parameters
    ----------
    surface : SurfaceMesh
        Closed or not.
    lower : (3,) array_like, mm
        First node.
    spacing : float, mm
    shape : (int, int, int)
        Nodes along x, y, z.
    band : float
        Spacings from the triangles up to which distances are exact, at least 2.

    Returns
    -------
    DistanceBricks
        In about 4 kB for every brick near the surface and 9 bytes for every other.

    Raises
    ------
    MeshError
        If there is no triangle, or the grid cannot be used.

    References
    ----------
    Barill, Dickson, Schmidt, Levin & Jacobson, "Fast winding numbers for soups and clouds", ACM
    Transactions on Graphics 37(4), 43, 2018.
    """
    return _bricks(surface, lower, spacing, shape, band)[0]


def distance_grid(
    surface: SurfaceMesh,
    lower: ArrayLike,
    spacing: float,
    shape: tuple[int, int, int],
    *,
    band: float = 3.0,
) -> NDArray[np.float32]:
    """Signed distance at every node of a grid, mm, negative inside.

    Exact up to ``band`` spacings from the triangles, as :func:`distance_bricks` finds it. Beyond,
    closest points are swept over every second node along each axis, and the others take the
    nearer of two of those about them: never too small, and off by 0.1 of a spacing on average and
    1.3 at most on a bumpy ball.

    Parameters
    ----------
    surface, lower, spacing, shape, band
        As for :func:`distance_bricks`.

    Returns
    -------
    (nx, ny, nz) float32 array, mm
        5 bytes a node are held at once, beside the bricks.

    Raises
    ------
    MeshError
        If no triangle is near the grid, or the grid cannot be used.

    References
    ----------
    Danielsson, "Euclidean distance mapping", Computer Graphics and Image Processing 14, 227-248,
    1980.
    """
    bricks, winding, near = _bricks(surface, lower, spacing, shape, band)
    tree = winding.tree
    values = bricks.values.reshape(near.shape) / np.float32(spacing)
    number = np.flatnonzero(bricks.slot.ravel() >= 0)
    count = np.zeros(len(number), dtype=np.int64)
    kernels.count_seeds(values, _SEEDS, count)
    if not count.any():
        raise MeshError(
            f"distance on a grid: no triangle is within {_SEEDS * spacing:g} mm of its nodes; "
            f"expected a grid around the surface"
        )
    first = np.concatenate([[0], np.cumsum(count)])
    points = np.zeros((first[-1], 3), dtype=np.float32)
    even = tuple((n + 1) // 2 for n in shape)
    seed = np.full(even, -1, dtype=np.int32)
    square = np.full(even, np.inf, dtype=np.float32)
    bands = np.array(bricks.slot.shape)
    kernels.place_seeds(
        tree.triangles, tree.flat, number, bands, values, near, _SEEDS, first, points, seed, square
    )
    for forward_x, forward_y in ((True, True), (False, False), (True, False), (False, True)):
        kernels.sweep(points, seed, square, forward_x, forward_y)
    result = np.zeros(shape, dtype=np.float32)
    kernels.finish(
        bricks.slot.ravel(),
        bands,
        values,
        bricks.inside.ravel(),
        band,
        points,
        seed,
        spacing,
        result,
    )
    return result


def _bricks(
    surface: SurfaceMesh, lower: ArrayLike, spacing: float, shape: tuple[int, int, int], band: float
) -> tuple[DistanceBricks, WindingTree, NDArray[np.int32]]:
    """Bricks, the triangles in spacings of the grid, and which is nearest to every node."""
    lower = locked(lower, (3,), name="lower")
    if min(shape) < 1 or not spacing > 0 or not band >= _SEEDS:
        raise MeshError(
            f"distance on a grid: found {shape} nodes, a spacing of {spacing:g} mm and a band of "
            f"{band:g} spacings; expected at least one node, a positive spacing and a band of 2"
        )
    tree = build_triangle_tree((corner_points(surface) - lower) / spacing)
    winding = winding_tree(tree)
    several = bool(unbalanced_edge_count(surface))
    if several:
        winding = agreeing(winding)
    bands = np.array([-(-n // SIDE) for n in shape])
    slot, start, member = _sorted(winding, bands, band)
    brick = np.flatnonzero(slot >= 0)
    values = np.zeros((len(brick), kernels.NODES), dtype=np.float32)
    near = np.zeros(values.shape, dtype=np.int32)
    kernels.fill_bands(tree.triangles, tree.flat, brick, bands, start, member, band, values, near)
    sums = (tree.triangles, winding.turn, tree.right, tree.first, tree.count, winding.moments)
    kernels.sign_bands(*sums, brick, bands, values, _APART_OPEN if several else _APART, several)
    inside = np.zeros(len(slot), dtype=bool)
    kernels.sign_rest(*sums, slot, bands, inside)
    values *= np.float32(spacing)
    found = DistanceBricks(
        lower=lower,
        spacing=spacing,
        shape=shape,
        band=band * spacing,
        slot=slot.reshape(bands),
        values=values.reshape(-1, SIDE, SIDE, SIDE),
        inside=inside.reshape(bands),
    )
    return found, winding, near


def _sorted(
    winding: WindingTree, bands: IntArray, band: float
) -> tuple[IntArray, IntArray, NDArray[np.int32]]:
    """Place of every brick near triangles, and its triangles."""
    tree = winding.tree
    count = np.zeros(len(tree.order), dtype=np.int64)
    kernels.count_bricks(tree.triangles, tree.flat, bands, band, count)
    first = np.concatenate([[0], np.cumsum(count)])
    pairs = np.zeros(first[-1], dtype=np.int64)
    kernels.list_bricks(tree.triangles, tree.flat, bands, band, first, pairs)
    most = np.bincount(pairs, minlength=int(bands.prod()))
    slot = np.full(len(most), -1, dtype=np.int64)
    slot[most > 0] = np.arange(np.count_nonzero(most))
    start = np.concatenate([[0], np.cumsum(most[most > 0])])
    member = np.zeros(len(pairs), dtype=np.int32)
    kernels.sort_pairs(pairs, first, slot, start, member)
    return slot, start, member
