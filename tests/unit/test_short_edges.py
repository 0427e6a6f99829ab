"""Short edges collapse without tearing, turning or moving the surface."""

import numpy as np
import pytest

from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.triangles.short_edges import used_only, without_short_edges
from gradedesign.geometry.triangles.surface_mesh import (
    SurfaceMesh,
    enclosed_volume,
    open_edge_count,
)


def lengths(surface):
    ends = surface.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    return np.linalg.norm(np.diff(surface.vertices[ends], axis=1)[:, 0], axis=1)


def test_short_edges_of_a_contour_collapse():
    """A ball of radius 2 mm at 0.25 mm: none of 0.05 mm is left, and none stood out before."""
    ball = extract_surface(lambda p: np.linalg.norm(p, axis=0) - 2.1325, [-3] * 3, [3] * 3, 0.25)
    assert lengths(ball).min() < 0.005
    found = used_only(ball.vertices, without_short_edges(ball.vertices, ball.faces.copy(), 0.05))
    assert lengths(found).min() >= 0.05
    assert open_edge_count(found) == 0
    assert enclosed_volume(found) == pytest.approx(enclosed_volume(ball), rel=2e-3)
    assert {tuple(v) for v in found.vertices} <= {tuple(v) for v in ball.vertices}
    assert len(found.faces) == 2 * len(found.vertices) - 4  # Euler: a ball still


def test_an_edge_whose_collapse_would_fold_the_surface_stays():
    """A tetrahedron has no edge to spare."""
    vertices = np.vstack([np.zeros(3), np.eye(3)])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    np.testing.assert_array_equal(without_short_edges(vertices, faces.copy(), 10.0), faces)


def test_the_corner_of_a_box_stays():
    """A vertex 0.01 mm beside a corner, on a face: it goes, not the corner."""
    vertices = np.array(
        [[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]
        + [[0.01, 0.0, 0.01]]
    )
    faces = np.array(
        [
            [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
            [1, 5, 7], [1, 7, 3], [0, 4, 8], [4, 5, 8], [5, 1, 8], [1, 0, 8],
        ]
    )  # fmt: skip
    surface = SurfaceMesh(vertices=vertices, faces=faces)
    assert enclosed_volume(surface) == pytest.approx(1.0)
    found = used_only(vertices, without_short_edges(vertices, faces, 0.1))
    assert len(found.vertices) == 8
    assert open_edge_count(found) == 0
    assert enclosed_volume(found) == pytest.approx(1.0)
