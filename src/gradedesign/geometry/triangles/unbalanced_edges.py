"""Edges at which a surface does not close."""

from __future__ import annotations

import numpy as np

from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh


def unbalanced_edge_count(surface: SurfaceMesh) -> int:
    """Count edges that are not passed equally often in both directions.

    0 means that the enclosed volume is well defined. Weaker than
    `gradedesign.geometry.triangles.surface_mesh.open_edge_count`: an edge of four triangles, where
    two shells touch, is balanced.
    """
    faces = surface.faces
    start = faces.ravel()
    end = np.roll(faces, -1, axis=1).ravel()
    name = np.minimum(start, end) * np.int64(len(surface.vertices)) + np.maximum(start, end)
    _, edge = np.unique(name, return_inverse=True)
    balance = np.bincount(edge, weights=np.sign(end - start))
    return int(np.count_nonzero(balance))
