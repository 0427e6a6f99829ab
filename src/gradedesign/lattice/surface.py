"""From a field to a closed, manifold triangle surface."""

from __future__ import annotations

import logging
from time import perf_counter

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray
from gradedesign.errors import LatticeError
from gradedesign.lattice._marching_table import marching_table
from gradedesign.lattice._surface_kernels import (
    count_brick,
    cut_at_box,
    edge_points,
    edge_starts,
    march_brick,
    shell_volumes,
    unpaired_edges,
)
from gradedesign.lattice.sample import Shape, checked_values, sample_bricks
from gradedesign.mesh.surface_mesh import SurfaceMesh
from gradedesign.workspace.progress import report_step

log = logging.getLogger(__name__)

#: Node values closer to zero than this, in grid spacings, count as just outside.
NUDGE = 1e-6
#: Vertices keep this distance from the ends of their grid edge, in grid spacings.
END_GAP = 1e-3
#: Points per batch when vertices are moved to the true zero.
BATCH = 1 << 18


def extract_surface(
    field: Field, lower: ArrayLike, upper: ArrayLike, h: float, *, brick: int = 32
) -> SurfaceMesh:
    """Closed, manifold surface of ``field <= 0`` inside a box, outward oriented.

    The field is sampled on a cubic grid in bricks of bounded memory and contoured with marching
    cubes; vertices are named by the grid edge they lie on, so bricks join exactly. Each vertex is
    then moved along its grid edge by one secant step to the field's own zero. Node values within
    ``1e-6 h`` of zero count as ``+1e-6 h``, and vertices stay ``1e-3 h`` away from grid nodes, so
    no triangle degenerates and none has to be removed.

    Parameters
    ----------
    field : callable
        Points ``(3, ...)`` mm to values, negative inside, roughly a distance in mm.
    lower, upper : (3,) array_like, mm
        The solid is cut at this box, so it is always closed. The grid is laid half a spacing
        outside ``lower``: faces of the box lie between nodes.
    h : float, mm
        Grid spacing.
    brick : int
        Cubes along the edge of a brick.

    Returns
    -------
    SurfaceMesh
        Every edge is shared by exactly two opposed triangles; the volume is positive.

    Raises
    ------
    LatticeError
        If the field has no solid on the grid, is not finite, or the surface is not closed.
    """
    began = perf_counter()
    lower, upper = (np.array(end, dtype=np.float64) for end in (lower, upper))
    if not (upper > lower).all() or not h > 0:
        raise LatticeError(f"box {lower} to {upper} mm with spacing {h:g} mm is empty")
    boxed = _cut_at_box(field, lower, upper)
    origin = lower - 0.5 * h
    x, y, z = (int(n) for n in np.floor((upper - lower) / h + 0.5 + 1e-9) + 2)
    keys, ends, faces = _march(boxed, origin, (x, y, z), h, brick)
    vertices = _place_vertices(boxed, keys, ends, origin, (x, y, z), h)
    surface = SurfaceMesh(vertices=vertices, faces=faces)
    report_step("checking the surface")
    require_closed(surface)
    log.info(
        "surface: %d x %d x %d nodes at %g mm, %d triangles, %.1f s",
        *(x, y, z, h, len(faces), perf_counter() - began),
    )
    return surface


def require_closed(surface: SurfaceMesh) -> float:
    """Enclosed volume, mm^3, of a surface that is closed, manifold and outward oriented.

    Raises
    ------
    LatticeError
        If an edge is not shared by exactly two opposed triangles, or the volume is not positive.
    """
    torn, overloaded = unpaired_edges(surface.faces, len(surface.vertices))
    if torn or overloaded:
        raise LatticeError(
            f"the surface is not closed: {torn} open or misoriented edges and {overloaded} "
            f"edges with more than two triangles, expected none; use a finer grid"
        )
    shells = np.zeros(len(surface.vertices), dtype=np.int64)
    volume = float(shell_volumes(surface.vertices, surface.faces, shells, 1)[0])
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
        if values.shape == points.shape[1:]:  # else it is refused by whoever asks
            flat = np.ascontiguousarray(points, dtype=np.float64).reshape(3, -1)
            cut_at_box(values.reshape(-1), flat, middle, half)
        return values

    return boxed


def _march(
    field: Field, origin: FloatArray, shape: Shape, h: float, brick: int
) -> tuple[IntArray, FloatArray, IntArray]:
    """Unique edge keys ``(n,)``, node values at their ends ``(n, 2)`` and faces ``(m, 3)``."""
    triangles, counts = marching_table()
    grid = np.array(shape, dtype=np.int64)
    all_keys, all_ends, all_faces, used = [], [], [], 0
    for piece in sample_bricks(field, origin, shape, h, brick=brick):
        values = np.where(np.abs(piece.values) < NUDGE * h, NUDGE * h, piece.values)
        total = count_brick(values, counts)
        if not total[0]:
            continue
        start = np.array(piece.start, dtype=np.int64)
        keys, ends, faces = march_brick(values, start, grid, triangles, counts, total, used)
        all_keys.append(keys)
        all_ends.append(ends)
        all_faces.append(faces)
        used += len(keys)
    if not used:
        raise LatticeError(
            f"no solid on a grid of {shape[0]} x {shape[1]} x {shape[2]} nodes at {h:g} mm: "
            f"the lattice misses the part, or its walls are thinner than the grid"
        )
    keys = np.concatenate(all_keys)
    # Not np.unique, whose sort is stable and slower: keys that are equal have
    # equal ends, so their order does not matter.
    order = np.argsort(keys)
    keys = keys[order]
    fresh = np.concatenate([[True], keys[1:] != keys[:-1]])
    vertex = np.zeros_like(keys)
    vertex[order] = np.cumsum(fresh) - 1
    ends = np.concatenate(all_ends)[order[fresh]]
    return keys[fresh], ends, vertex[np.concatenate(all_faces)]


def _place_vertices(
    field: Field, keys: IntArray, ends: FloatArray, origin: FloatArray, shape: Shape, h: float
) -> FloatArray:
    """Zero of the field on every grid edge, ``(n, 3)``, mm: linear, then one secant step."""
    grid = np.array(shape, dtype=np.int64)
    vertices = np.zeros((len(keys), 3))
    for low in range(0, len(keys), BATCH):
        report_step("vertices", low / len(keys))
        part = slice(low, min(low + BATCH, len(keys)))
        a, b = ends[part].T
        starts = edge_starts(keys[part], origin, grid, h)
        at = np.clip(a / (a - b), END_GAP, 1 - END_GAP)
        value = checked_values(field, edge_points(starts, keys[part], at, h))
        at = _secant(at, value, a, b)
        vertices[part] = edge_points(starts, keys[part], at, h).T
    return vertices


def _secant(at: FloatArray, value: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    """Zero of the chord between a trial and the end of opposite sign, as a share of the edge."""
    before: BoolArray = (value < 0) == (a < 0)  # the trial has the sign of the edge's start
    x0, f0 = np.where(before, at, 0.0), np.where(before, value, a)
    x1, f1 = np.where(before, 1.0, at), np.where(before, b, value)
    return np.clip(x0 + (x1 - x0) * f0 / (f0 - f1), END_GAP, 1 - END_GAP)
