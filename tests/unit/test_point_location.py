"""Point location: the right tetrahedron inside, the nearest point outside."""

import numba
import numpy as np
import pytest
from scipy.spatial import Delaunay

from gradedesign.errors import MeshError
from gradedesign.geometry.tets.point_location import build_locator, locate
from gradedesign.geometry.tets.tet_mesh import TetMesh, signed_volumes


def random_mesh(seed, count=150):
    points = np.random.default_rng(seed).normal(size=(count, 3))
    tets = Delaunay(points).simplices.T
    mesh = TetMesh(points=points.T, tets=tets)
    flip = signed_volumes(mesh) < 0
    tets = np.where(flip, tets[[0, 1, 3, 2]], tets)
    mesh = TetMesh(points=points.T, tets=tets)
    return TetMesh(points=points.T, tets=tets[:, signed_volumes(mesh) > 1e-9])


def position(mesh, tets, barycentric):
    return np.einsum("cn,acn->an", barycentric, mesh.points[:, mesh.tets[:, tets]])


def test_points_inside_get_back_their_tetrahedron():
    mesh = random_mesh(31)
    rng = np.random.default_rng(37)
    tets = rng.integers(0, mesh.tets.shape[1], 4000)
    weights = rng.dirichlet(np.ones(4), 4000).T
    points = position(mesh, tets, weights)
    found, barycentric, distance = locate(mesh, points)
    assert np.array_equal(found, tets)
    np.testing.assert_allclose(barycentric.sum(axis=0), 1, atol=1e-12)
    np.testing.assert_allclose(position(mesh, found, barycentric), points, atol=1e-10)
    assert distance.max() == 0


def test_points_outside_get_the_nearest_point():
    # the convex hull of the points is the mesh: nearest by projection onto a fine sample is slow,
    # so use a box mesh where the nearest point is a clip
    size = np.array([2.0, 1.0, 1.5])
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * size
    tets = Delaunay(corners).simplices.T
    flip = signed_volumes(TetMesh(points=corners.T, tets=tets)) < 0
    mesh = TetMesh(points=corners.T, tets=np.where(flip, tets[[0, 1, 3, 2]], tets))
    points = np.random.default_rng(41).uniform(-2, 4, (3, 3000))
    found, barycentric, distance = locate(mesh, points)
    nearest = np.clip(points, 0, size[:, None])
    np.testing.assert_allclose(position(mesh, found, barycentric), nearest, atol=1e-12)
    np.testing.assert_allclose(distance, np.linalg.norm(points - nearest, axis=0), atol=1e-12)
    assert barycentric.min() > -1e-12


def test_vertices_edges_and_faces_are_inside():
    mesh = random_mesh(43)
    middle = mesh.points[:, mesh.tets[:2]].mean(axis=1)
    face = mesh.points[:, mesh.tets[:3]].mean(axis=1)
    points = np.concatenate([mesh.points[:, np.unique(mesh.tets)], middle, face], axis=1)
    found, barycentric, distance = locate(mesh, points)
    assert distance.max() < 1e-12
    assert barycentric.min() > -1e-9
    np.testing.assert_allclose(position(mesh, found, barycentric), points, atol=1e-10)


def test_one_locator_serves_many_calls_and_threads():
    mesh = random_mesh(47)
    locator = build_locator(mesh)
    points = np.random.default_rng(53).normal(size=(3, 2000)) * 1.5
    threads = numba.get_num_threads()
    answers = []
    for count in (1, threads):
        numba.set_num_threads(count)
        answers.append(locate(mesh, points, locator=locator))
    for one, other in zip(*answers, strict=True):
        assert np.array_equal(one, other)
    points.flags.writeable = False
    locate(mesh, points, locator=locator)


def test_refuses_bad_input():
    mesh = random_mesh(59)
    with pytest.raises(ValueError, match="expected"):
        locate(mesh, np.zeros((4, 3)))
    with pytest.raises(ValueError, match="not finite"):
        locate(mesh, np.full((3, 1), np.nan))
    with pytest.raises(MeshError, match="no tetrahedra"):
        locate(TetMesh(points=np.zeros((3, 1)), tets=np.zeros((4, 0))), np.zeros((3, 1)))
