"""Signed distance: exact on boxes, right in sign at edges and corners, equal to libigl."""

from pathlib import Path

import igl
import numpy as np
import pytest
import trimesh

from gradedesign.errors import MeshError, PartError
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.signed_distance import region_distance, surface_distance
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points

PARTS = Path(__file__).resolve().parents[3] / "shared" / "parts"


def box_distance(p, size):
    """Exact distance to the box [0, size], by hand."""
    half = np.array(size).reshape(3, *[1] * (p.ndim - 1)) / 2
    q = np.abs(p - half) - half
    return np.linalg.norm(np.maximum(q, 0), axis=0) + np.minimum(q.max(axis=0), 0)


def as_surface(mesh):
    return SurfaceMesh(vertices=mesh.vertices, faces=mesh.faces)


def points_near_features(mesh, count, spread, rng):
    """Random points around vertices and edges, (3, 2 count)."""
    at = mesh.vertices[rng.integers(0, len(mesh.vertices), count)]
    edge = mesh.vertices[mesh.edges_unique[rng.integers(0, len(mesh.edges_unique), count)]]
    share = rng.random((count, 1))
    on = edge[:, 0] * share + edge[:, 1] * (1 - share)
    return (np.concatenate([at, on]) + spread * rng.normal(size=(2 * count, 3))).T


def assert_signs_equal_the_winding_number(mesh, points, distance):
    winding = igl.winding_number(
        np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int64), points.T.copy()
    )
    assert np.all((winding > 0.5) == (distance < 0))


def test_box_is_exact():
    size = (3.0, 2.0, 1.0)
    points = np.random.default_rng(17).uniform(-1, 4, (3, 10, 20, 5))
    distance = surface_distance(box_surface(size))(points)
    assert distance.shape == (10, 20, 5)
    np.testing.assert_allclose(distance, box_distance(points, size), atol=1e-12)


def test_one_point():
    assert surface_distance(box_surface((2, 2, 2)))(np.array([1.0, 1.0, 0.25])) == -0.25


def test_signs_around_sharp_features():
    # a spiky ball: neighbouring faces meet at acute angles, where face normals alone fail
    rng = np.random.default_rng(19)
    ball = trimesh.creation.icosphere(subdivisions=2)
    ball.vertices *= rng.uniform(0.4, 1.6, (len(ball.vertices), 1))
    points = np.concatenate(
        [
            points_near_features(ball, 5000, 1e-3, rng),
            points_near_features(ball, 2000, 0.2, rng),
            rng.uniform(-2, 2, (3, 2000)),
        ],
        axis=1,
    )
    distance = surface_distance(as_surface(ball))(points)
    assert_signs_equal_the_winding_number(ball, points, distance)
    expected = igl.point_mesh_squared_distance(
        points.T.copy(), np.asarray(ball.vertices), np.asarray(ball.faces, dtype=np.int64)
    )[0]
    np.testing.assert_allclose(np.abs(distance), np.sqrt(expected), atol=1e-12)


def test_outward_is_the_gradient_of_the_distance():
    """By central differences of the distance by hand, away from where the box's gradient jumps."""
    size = (3.0, 2.0, 1.0)
    points = np.random.default_rng(29).uniform(-1, 4, (3, 4000))
    depth = np.sort(np.minimum(points, np.array(size)[:, None] - points), axis=0)
    points = points[:, (depth[0] < -0.01) | (depth[1] - depth[0] > 0.01)]
    shifts = 1e-5 * np.eye(3)[:, :, None]
    gradient = [
        (box_distance(points + s, size) - box_distance(points - s, size)) / 2e-5 for s in shifts
    ]
    outward = surface_distance(box_surface(size)).outward
    # Central differences of a distance of 0.01 mm or more: (1e-5 / 0.01)^2 / 6, and of faces none.
    np.testing.assert_allclose(outward(points), gradient, atol=1e-6)


def test_outward_at_the_surface_is_its_normal():
    """On a face, just inside and outside of it, and half-way between the two faces of an edge."""
    points = np.array(
        [[1, 1, 1], [1, 1, 1 + 1e-12], [1, 1, 1 - 1e-12], [3, 1, 1], [3 + 1e-12, 1, 1 + 1e-12]]
    ).T
    outward = surface_distance(box_surface((3.0, 2.0, 1.0))).outward
    half = np.sqrt(0.5)
    expected = np.array([[0, 0, 1], [0, 0, 1], [0, 0, 1], [half, 0, half], [half, 0, half]]).T
    np.testing.assert_allclose(outward(points), expected, atol=1e-12)


def test_sphere_within_its_chords():
    # an inscribed polyhedron lies within r (1 - cos(half angle of an edge)) of the sphere
    ball = trimesh.creation.icosphere(subdivisions=4, radius=5.0)
    sagitta = 5 * (1 - np.cos(np.arcsin(ball.edges_unique_length.max() / 10)))
    points = np.random.default_rng(23).uniform(-7, 7, (3, 5000))
    distance = surface_distance(as_surface(ball))(points)
    error = distance - (np.linalg.norm(points, axis=0) - 5)
    assert error.min() > -1e-12
    assert error.max() < 1.4 * sagitta


def test_cavity_is_outside():
    outer, inner = box_surface((4, 4, 4)), box_surface((2, 2, 2))
    surface = SurfaceMesh(
        vertices=np.concatenate([outer.vertices, inner.vertices + 1]),
        faces=np.concatenate([outer.faces, inner.faces[:, ::-1] + len(outer.vertices)]),
    )
    points = np.array([[2, 2, 2], [0.5, 2, 2], [1.25, 2, 2], [5, 2, 2.0]]).T
    np.testing.assert_allclose(surface_distance(surface)(points), [1, -0.5, 0.25, 1])


def test_part_with_needles():
    path = PARTS / "featuretype.STL"
    if not path.exists():
        pytest.skip("the sample part is not here")
    mesh = trimesh.load(path)
    mesh.merge_vertices()
    mesh.apply_scale(25.4)
    rng = np.random.default_rng(29)
    points = points_near_features(mesh, 2000, 1e-3, rng)
    distance = surface_distance(as_surface(mesh))(points)
    assert_signs_equal_the_winding_number(mesh, points, distance)


def test_region_distance_has_no_sign():
    # the face x = 0 of a box
    corners = corner_points(box_surface((3, 2, 1)))
    corners = corners[(corners[:, :, 0] == 0).all(axis=1)]
    distance = region_distance(corners)
    points = np.array([[-1, 1, 0.5], [2, 1, 0.5], [0, 3, 0.5], [1, 4, 0.5]]).T
    np.testing.assert_allclose(distance(points), [1, 2, 1, np.sqrt(5)])
    assert distance(points.reshape(3, 2, 2)).shape == (2, 2)
    with pytest.raises(MeshError, match="no triangles"):
        region_distance(corners[:0])


def test_refuses_open_and_inverted_surfaces():
    box = box_surface((1, 1, 1))
    with pytest.raises(PartError, match="3 open"):
        surface_distance(SurfaceMesh(vertices=box.vertices, faces=box.faces[1:]))
    with pytest.raises(PartError, match="turn its triangles"):
        surface_distance(SurfaceMesh(vertices=box.vertices, faces=box.faces[:, ::-1]))
