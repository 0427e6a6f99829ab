"""Thickness of a part about points inside it."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.geometry.part.chords import chords
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points


def local_thickness(surface: SurfaceMesh, points: FloatArray, axes: FloatArray) -> FloatArray:
    """Shortest chord of a part through points inside it, mm.

    Parameters
    ----------
    surface : SurfaceMesh
        Closed.
    points : (3, n) array, mm
    axes : (3, 3) array
        Columns are the orthonormal directions of the chords.

    Returns
    -------
    (k,) array, mm
        Of the points through which every chord has two ends; k <= n.
    """
    backward, forward = chords(corner_points(surface), points, axes)
    length = (backward + forward).min(axis=0)
    return np.asarray(length[np.isfinite(length)])
