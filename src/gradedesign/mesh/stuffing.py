"""Tetrahedra straight from an implicit field: isosurface stuffing.

A body-centred cubic lattice is laid over the field, lattice points too close to the surface are
pulled onto it, and every lattice tetrahedron is cut by one of a few stencils (Labelle & Shewchuk,
"Isosurface stuffing: fast tetrahedral meshes with good dihedral angles", ACM Transactions on
Graphics 26(3), 57, 2007). Features thinner than about 0.8 h are lost or broken: tie h to the wall
thickness and check pieces and volume of the result.
"""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gradedesign.arrays import Field, FloatArray, IntArray
from gradedesign.errors import MeshError
from gradedesign.mesh import _stuffing_kernels as kernels
from gradedesign.mesh import _stuffing_tets_kernels as tets_kernels
from gradedesign.mesh._stuffing_lattice import (
    Lattice,
    bricks,
    evaluate,
    lay_lattice,
    outside_grid,
    require_enclosed,
    sample,
)
from gradedesign.mesh._stuffing_pinches import find_pinches, separate_pinches
from gradedesign.mesh.tet_mesh import TetMesh
from gradedesign.workspace.progress import report_step

log = logging.getLogger(__name__)

#: Smallest tetrahedron that is accepted, over h^3. The smallest stencil at the worst cuts is
#: about 1e-3; less means that a field value was not a number or the lattice was inverted.
LEAST_VOLUME = 1e-7


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Cuts:
    """Every cut edge: its owner, direction and the share of its length up to the surface."""

    mask: NDArray[np.uint16]
    start: NDArray[np.int32]
    owner: NDArray[np.int32]
    direction: NDArray[np.int8]
    share: FloatArray


def stuff(
    field: Field,
    lower: ArrayLike,
    shape: tuple[int, int, int],
    h: float,
    *,
    brick: int = 64,
    refine: int = 1,
) -> TetMesh:
    """Mesh the inside of a field by isosurface stuffing.

    Parameters
    ----------
    field : callable
        Points ``(3, ...)`` in mm to values ``(...)``, negative inside. Called once per lattice
        point, and ``refine`` times per edge that the surface crosses.
    lower : (3,) array_like, mm
        Lower corner of the grid.
    shape : (3,) ints
        Grid cells per axis. The solid must lie in the grid; one more layer around it closes the
        solid there, so a flat face on the grid's limit is met exactly.
    h : float, mm
        Grid spacing; the edges of tetrahedra are about 0.87 h to h.
    brick : int
        The field never sees more than about ``brick**3`` points at once.
    refine : int
        Regula falsi steps on each cut after the first linear interpolation.

    Returns
    -------
    TetMesh
        The same for any number of threads, its boundary closed and two facets at every edge.
        Dihedral angles lie within 10 and 165 degrees (20 and 138 on a smooth surface).

    Raises
    ------
    MeshError
        If the field is nowhere negative, not finite, of the wrong shape, or the solid reaches
        out of the grid.
    ResourceError
        If the lattice has more than 2**31 points.
    """
    begin = time.perf_counter()
    lattice = lay_lattice(np.asarray(lower, dtype=np.float64), shape, float(h))
    values = sample(field, lattice, brick)
    sign = np.zeros(len(values), dtype=np.int8)
    kernels.signs_of(values, sign)
    require_enclosed(sign, values, lattice)
    sampled = time.perf_counter()
    report_step("cutting the grid")
    cuts = _find_cuts(field, values, sign, lattice, brick**3, refine)
    del values
    located = time.perf_counter()
    report_step("tetrahedra")
    warp = _warp(sign, cuts, lattice)
    points, tets, pinches = _connect(sign, warp, cuts, lattice)
    if len(pinches):
        log.info("%d pinches of the solid were taken apart", len(pinches))
        points, tets = separate_pinches(points, tets, pinches)
    mesh = TetMesh(points=points.T, tets=tets.T)
    log.info(
        "stuffed %d tets at h = %.4g mm: field %.2f s, cuts %.2f s, tets %.2f s",
        len(tets),
        h,
        sampled - begin,
        located - sampled,
        time.perf_counter() - located,
    )
    return mesh


def _find_cuts(
    field: Field,
    values: FloatArray,
    sign: NDArray[np.int8],
    lattice: Lattice,
    chunk: int,
    refine: int,
) -> _Cuts:
    """List the edges that the surface crosses and where, in chunks of field calls."""
    X, Y, Z = lattice.dims
    mask = np.zeros(len(sign), dtype=np.uint16)
    first = np.zeros(X, dtype=np.int64)
    kernels.mark_cuts(sign, X, Y, Z, lattice.ahead, mask, first[1:])
    np.cumsum(first, out=first)
    count = int(first[-1])
    start = np.zeros(len(sign), dtype=np.int32)
    owner = np.zeros(count, dtype=np.int32)
    direction = np.zeros(count, dtype=np.int8)
    share = np.zeros(count)
    kernels.list_cuts(values, mask, X, Y, Z, lattice.ahead, first, start, owner, direction, share)
    for part in bricks(count if refine > 0 else 0, chunk):
        report_step("cutting the grid", part.start / count)
        ends = owner[part], direction[part]
        near, far = np.zeros(len(ends[0])), np.ones(len(ends[0]))
        near_value = values[ends[0]]
        far_value = values[ends[0] + lattice.ahead[ends[0] & 1, ends[1]]]
        points = np.zeros((3, len(near)))
        for _ in range(refine):
            kernels.cut_points(*ends, share[part], Y, Z, lattice.lower, lattice.h, points)
            value = evaluate(field, points)
            kernels.tighten(share[part], value, near, far, near_value, far_value)
    outer = kernels.count_outer_violations(owner, direction, share, X, Y, Z, lattice.ahead)
    if outer:
        raise outside_grid(lattice, f"the surface passes close to {outer} points around it")
    return _Cuts(mask=mask, start=start, owner=owner, direction=direction, share=share)


def _warp(sign: NDArray[np.int8], cuts: _Cuts, lattice: Lattice) -> NDArray[np.int8]:
    """Pull lattice points onto the surface in four colours; marks them as 0 in sign."""
    warp = np.full(len(sign), -1, dtype=np.int8)
    for kind in range(2):
        for parity in range(2):
            kernels.warp_nodes(
                kind,
                parity,
                sign,
                cuts.mask,
                cuts.start,
                cuts.share,
                *lattice.dims,
                lattice.offsets,
                warp,
            )
    return warp


def _connect(
    sign: NDArray[np.int8], warp: NDArray[np.int8], cuts: _Cuts, lattice: Lattice
) -> tuple[FloatArray, IntArray, IntArray]:
    """Number and place the vertices, and cut every lattice tetrahedron.

    Returns
    -------
    points : (n, 3) array, mm
    tets : (m, 4) int array
    pinches : (k,) int array
        Vertices where parts of the solid touch in a point or along an edge.
    """
    X, Y, Z = lattice.dims
    layout = sign, cuts.mask, cuts.start
    node_vertex = np.full(len(sign), -1, dtype=np.int32)
    cut_vertex = np.full(len(cuts.share), -1, dtype=np.int32)
    first = np.zeros(X, dtype=np.int64)
    steps = X, Y, Z, lattice.ahead, lattice.offsets
    kernels.number_vertices(False, *layout, *steps, first[1:], node_vertex, cut_vertex)
    np.cumsum(first, out=first)
    kernels.number_vertices(True, *layout, *steps, first, node_vertex, cut_vertex)
    points = np.zeros((int(first[-1]), 3))
    kernels.place_vertices(
        node_vertex,
        cut_vertex,
        warp,
        cuts.mask,
        cuts.start,
        cuts.owner,
        cuts.direction,
        cuts.share,
        Y,
        Z,
        lattice.offsets,
        lattice.lower,
        lattice.h,
        points,
    )
    rows, added = np.zeros(X, dtype=np.int64), np.zeros(X, dtype=np.int64)
    tables = *layout, node_vertex, cut_vertex, X, Y, Z
    tets = np.zeros((0, 4), dtype=np.int64)
    least = np.zeros(X - 1)
    tets_kernels.make_tets(False, *tables, points, tets, rows[1:], added[1:], least)
    np.cumsum(rows, out=rows)
    added = np.cumsum(added) + len(points)
    if added[-1] > len(points):
        points = np.concatenate([points, np.zeros((int(added[-1]) - len(points), 3))])
    tets = np.zeros((int(rows[-1]), 4), dtype=np.int64)
    tets_kernels.make_tets(True, *tables, points, tets, rows, added, least)
    if not least.min() / 6.0 > LEAST_VOLUME * lattice.h**3:
        raise MeshError(
            f"stuffing made a tetrahedron of {least.min() / 6.0:.3g} mm^3 at h = {lattice.h} mm; "
            "please report the field"
        )
    pinches = find_pinches(node_vertex, sign, lattice.offsets, X, len(points))
    return points, tets, pinches
