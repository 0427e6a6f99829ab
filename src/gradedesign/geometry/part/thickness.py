"""Chords of a part through points inside it, and its thickness there."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points
from gradedesign.geometry.triangles.triangle_tree import build_triangle_tree, ray_lengths


def chords(
    surface: SurfaceMesh, points: FloatArray, axes: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Distance from points to the nearest crossing of a surface, backward and forward.

    ``points (3, n)``, mm. ``axes (3, 3)``: columns are orthonormal directions. Returns
    ``backward (3, n)``, ``forward (3, n)``, mm: by direction; infinite where nothing is crossed.
    """
    tree = build_triangle_tree(corner_points(surface))
    backward, forward = (
        np.stack([ray_lengths(tree, points, _alike(way * axis, points), way=0) for axis in axes.T])
        for way in (-1.0, 1.0)
    )
    return backward, forward


def _alike(direction: FloatArray, points: FloatArray) -> FloatArray:
    """The direction of every point."""
    return np.repeat(direction[:, None], points.shape[1], axis=1)


def local_thickness(surface: SurfaceMesh, points: FloatArray, axes: FloatArray) -> FloatArray:
    """Shortest chord of a part through points inside it, mm.

    Returns (k,) array, mm: of the points through which every chord has two ends; k <= n.

    ``surface``: closed. ``points (3, n)``, mm. ``axes (3, 3)``: columns are the orthonormal
    directions of the chords.
    """
    backward, forward = chords(surface, points, axes)
    length = (backward + forward).min(axis=0)
    return np.asarray(length[np.isfinite(length)])
