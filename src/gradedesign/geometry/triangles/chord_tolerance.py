"""A closed surface of fewer triangles within a stated distance."""

from __future__ import annotations

import logging

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.common.system.progress import report_step
from gradedesign.errors import LatticeError
from gradedesign.geometry.triangles import _decimation_kernels as kernels
from gradedesign.geometry.triangles._collapse_kernels import stars
from gradedesign.geometry.triangles.crossings import TOUCHING, crossing_triangles
from gradedesign.geometry.triangles.short_edges import used_only
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

log = logging.getLogger(__name__)

#: Passes at most, and the share of the triangles that one must remove for another to follow.
#: Chosen, not measured.
PASSES, _LEAST_GAIN = 100, 2e-3
#: Share of the tolerance within which samples stay: between them the surface is farther off, by
#: up to half of that where triangles become twice as long, less where they become longer.
_SAMPLED = 0.6
#: Rounds in which vertices near crossings are kept, before the tolerance is refused. Chosen, not
#: measured.
ROUNDS = 4


def within_chord(surface: SurfaceMesh, tolerance: float) -> SurfaceMesh:
    """Simplify a surface so that it stays within a tolerance of the original.

    Vertices are removed one by one, each moved onto the neighbour from which the surface then is
    least far away (half-edge collapse), and only where the surface stays a manifold, no triangle
    turns by more than 60 degrees, and the vertices and centres of the given triangles stay within
    0.6 times the tolerance of the triangles that replace them. Flat faces keep their corners and
    little else. Where triangles of the result would pass through each other, the vertices round
    them are kept.

    Returns SurfaceMesh: closed and manifold, of the same topology. Raises LatticeError if the
    tolerance is not positive, or triangles pass through each other all the same.

    ``surface``: closed and manifold. ``tolerance``, mm.
    """
    if not tolerance > 0:
        raise LatticeError(f"chord tolerance is {tolerance:g} mm, expected a positive length")
    vertices = np.ascontiguousarray(surface.vertices)
    kept = np.zeros(len(vertices), dtype=bool)
    for _ in range(ROUNDS):
        faces = _decimated(vertices, surface.faces, tolerance, ~kept)
        crossing = crossing_triangles(vertices, faces, TOUCHING)
        crossing = crossing[~kept[faces[crossing]].all(axis=(1, 2))]
        if not len(crossing):
            log.info("%d triangles within %g mm of %d", len(faces), tolerance, len(surface.faces))
            return used_only(vertices, faces)
        kept |= _near(vertices, vertices[faces[crossing.ravel()]], tolerance)
    at = ", ".join(f"{c:.4g}" for c in vertices[faces[crossing[0, 0]]].mean(axis=0))
    raise LatticeError(
        f"a chord tolerance of {tolerance:g} mm lets {len(crossing)} triangles of the surface pass "
        f"through others, the first at ({at}) mm; state a smaller one"
    )


def _decimated(
    vertices: FloatArray, fine: IntArray, tolerance: float, open_ends: BoolArray
) -> IntArray:
    """Triangles left by repeated passes of decimation; only open vertices are removed."""
    kept = ~open_ends
    faces = fine.astype(np.int32)
    every = np.ones(len(vertices), dtype=np.bool_)
    head = len(vertices) + np.arange(len(fine), dtype=np.int32)
    after = np.full(len(vertices) + len(fine), -1, dtype=np.int32)
    farthest2 = (_SAMPLED * tolerance) ** 2
    for _ in range(PASSES):
        report_step(f"triangles within {tolerance:g} mm: {len(faces)} of {len(fine)}")
        first, users = stars(faces, every)
        locked = np.zeros(len(vertices), dtype=np.bool_)
        done = kernels.remove_vertices(
            vertices, fine, faces, first, users, locked, open_ends, head, after, farthest2
        )
        there = faces[:, 0] >= 0
        faces, head = faces[there], head[there]
        open_ends &= ~kept
        if 2 * done <= _LEAST_GAIN * len(faces):
            break
    return faces.astype(np.int64)


def _near(vertices: FloatArray, corners: FloatArray, reach: float) -> BoolArray:
    """Vertices in the boxes of triangles ``(m, 3, 3)``, grown by a reach."""
    near = np.zeros(len(vertices), dtype=bool)
    lower, upper = corners.min(axis=1) - reach, corners.max(axis=1) + reach
    for low, high in zip(lower, upper, strict=True):
        near |= ((vertices >= low) & (vertices <= high)).all(axis=1)
    return near
