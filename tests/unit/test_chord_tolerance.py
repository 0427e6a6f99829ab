"""Fewer triangles within a stated distance: closed, flat where flat, nothing crosses."""

import numpy as np
import pytest
import trimesh

from gradedesign.errors import LatticeError
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.triangles import chord_tolerance
from gradedesign.geometry.triangles.chord_tolerance import within_chord
from gradedesign.geometry.triangles.crossings import TOUCHING, crossing_triangles
from gradedesign.geometry.triangles.surface_mesh import (
    SurfaceMesh,
    corner_points,
    enclosed_volume,
    open_edge_count,
)
from gradedesign.geometry.triangles.triangle_tree import build_triangle_tree, closest_features


@pytest.fixture(scope="module")
def ball():
    return extract_surface(lambda p: np.linalg.norm(p, axis=0) - 2.0, [-3] * 3, [3] * 3, 0.1)


def farthest(points, surface):
    """Largest distance of points (n, 3) from a surface, mm."""
    tree = build_triangle_tree(corner_points(surface))
    return closest_features(tree, np.ascontiguousarray(points.T)).distance.max()


def spread(surface, count=20_000):
    """Points all over a surface."""
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    return np.asarray(trimesh.sample.sample_surface(mesh, count, seed=5)[0])


@pytest.mark.parametrize("tolerance", [0.005, 0.02])
def test_a_ball_keeps_its_shape_within_the_tolerance(ball, tolerance):
    found = within_chord(ball, tolerance)
    assert open_edge_count(found) == 0
    assert len(found.faces) == 2 * len(found.vertices) - 4  # Euler: a ball still
    assert farthest(ball.vertices, found) <= 0.6 * tolerance * (1 + 1e-12)
    assert farthest(spread(ball), found) <= tolerance
    assert farthest(spread(found), ball) <= tolerance
    assert len(crossing_triangles(found.vertices, found.faces, 1e-6)) == 0
    # Equilateral triangles of side a in a sphere of radius r have a sagitta of a^2 / 6 r: at that
    # of the tolerance they are 4 pi r^2 over 0.433 a^2, here less than four times as many.
    equilateral = 4 * np.pi * 4.0 / (0.433 * 6 * 2.0 * tolerance)
    assert len(found.faces) < 4 * equilateral < 0.6 * len(ball.faces)


def test_flat_faces_are_flat():
    """A finely divided cube of 1 mm: its eight corners and twelve triangles are left."""
    fine = trimesh.creation.box((1.0, 1.0, 1.0)).subdivide().subdivide().subdivide()
    found = within_chord(SurfaceMesh(vertices=fine.vertices, faces=fine.faces), 1e-6)
    assert len(fine.faces) == 768
    assert len(found.faces) == 12
    assert enclosed_volume(found) == pytest.approx(1.0)


def test_walls_that_would_cross_stay_apart(ball):
    """Two shells 0.05 mm apart within 0.2 mm: each alone could pass through the other."""
    outer, inner = ball.vertices, 0.975 * ball.vertices
    two = SurfaceMesh(
        vertices=np.concatenate([outer, inner]),
        faces=np.concatenate([ball.faces, ball.faces[:, ::-1] + len(outer)]),
    )
    found = within_chord(two, 0.2)
    assert len(found.faces) < len(two.faces)
    assert open_edge_count(found) == 0
    assert len(crossing_triangles(found.vertices, found.faces, TOUCHING)) == 0
    assert enclosed_volume(found) > 0


def test_a_tolerance_that_cannot_hold_is_refused(ball, monkeypatch):
    with pytest.raises(LatticeError, match="expected a positive length"):
        within_chord(ball, 0.0)
    monkeypatch.setattr(
        chord_tolerance, "crossing_triangles", lambda *_: np.array([[0, 1]], dtype=np.int64)
    )
    monkeypatch.setattr(chord_tolerance, "ROUNDS", 1)
    with pytest.raises(LatticeError, match="state a smaller one"):
        within_chord(ball, 0.02)
