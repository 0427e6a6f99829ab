"""Distances on a grid: against all pairs of nodes and triangles, and the signs of a soup."""

import numpy as np
import pytest
import trimesh
from plain_windings import plain_windings

import gradedesign
from gradedesign.errors import MeshError
from gradedesign.geometry.contour.sample import grid_points
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles.distance_grid import distance_grid
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points
from gradedesign.geometry.triangles.triangle_tree import build_triangle_tree
from gradedesign.geometry.triangles.winding import agreeing, winding_numbers, winding_tree

SHAPE, LOWER, SPACING = (21, 17, 27), np.array([-1.6, -1.3, -2.1]), 0.157


def ball(subdivisions=2, spread=0.4, seed=17):
    """A ball of radius 1 with random bumps."""
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions)
    bumps = np.random.default_rng(seed).uniform(1 - spread, 1 + spread, (len(mesh.vertices), 1))
    return SurfaceMesh(vertices=mesh.vertices * bumps, faces=mesh.faces)


def soup_of(surface, seed=23):
    """The same with 1 % of the triangles missing, 5 % turned around and 1 % doubled."""
    rng = np.random.default_rng(seed)
    faces = surface.faces[rng.random(len(surface.faces)) > 0.01].copy()
    turned = rng.random(len(faces)) < 0.05
    faces[turned] = faces[turned][:, ::-1]
    return SurfaceMesh(
        vertices=surface.vertices,
        faces=np.concatenate([faces, faces[rng.random(len(faces)) < 0.01]]),
    )


def slow_distance(surface, points):
    """Signed distance of points (3, n): the least over all triangles, the sum of solid angles."""
    corners = corner_points(surface)
    least = np.full(points.shape[1], np.inf)
    for triangle in corners:
        copies = np.broadcast_to(triangle, (points.shape[1], 3, 3))
        nearest = trimesh.triangles.closest_point(copies, points.T)
        least = np.minimum(least, np.linalg.norm(nearest - points.T, axis=1))
    return np.where(plain_windings(corners, points) > 0.5, -least, least)


def nodes():
    return grid_points(LOWER, (0, 0, 0), SHAPE, SPACING)


@pytest.mark.parametrize("band", [3.0, np.inf])
def test_a_grid_is_exact_in_the_band_and_has_the_sign_beyond(band):
    surface = ball()
    exact = slow_distance(surface, nodes().reshape(3, -1)).reshape(SHAPE)
    found = distance_grid(surface, LOWER, SPACING, SHAPE, band=band)
    expected = np.sign(exact) * np.minimum(np.abs(exact), band * SPACING)
    assert 0.2 < np.mean(np.abs(exact) < 3 * SPACING) < 0.8
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_shells_that_overlap_are_one_solid():
    one, other = box_surface((2.0, 2.0, 2.0)), box_surface((2.0, 2.0, 2.0))
    both = SurfaceMesh(
        vertices=np.concatenate([one.vertices, other.vertices + 1.0]),
        faces=np.concatenate([one.faces, other.faces + len(one.vertices)]),
    )
    found = distance_grid(both, (-0.55, -0.55, -0.55), 0.1, (42, 42, 42))
    x = grid_points((-0.55, -0.55, -0.55), (0, 0, 0), (42, 42, 42), 0.1)
    inside = ((x > 0) & (x < 2)).all(axis=0) | ((x > 1) & (x < 3)).all(axis=0)
    assert np.array_equal(found < 0, inside)


def test_a_soup_has_the_signs_of_the_solid():
    surface = ball(subdivisions=4, spread=0.01)
    lower, spacing, shape = np.full(3, -1.2), 0.04, (61, 61, 61)
    closed = distance_grid(surface, lower, spacing, shape)
    soup = distance_grid(soup_of(surface), lower, spacing, shape)
    assert np.count_nonzero((soup < 0) != (closed < 0)) <= 1e-4 * closed.size


def test_turned_triangles_are_found():
    surface = ball(subdivisions=4, spread=0.01)
    turned = np.random.default_rng(29).random(len(surface.faces)) < 0.05
    faces = np.where(turned[:, None], surface.faces[:, ::-1], surface.faces)
    tree = build_triangle_tree(surface.vertices[faces])
    turn = agreeing(winding_tree(tree)).turn
    assert np.array_equal(turn < 0, turned[tree.order])


def test_winding_numbers_are_near_the_sum_of_solid_angles():
    surface = ball(subdivisions=3)
    corners = corner_points(surface)
    points = np.random.default_rng(31).uniform(-1.5, 1.5, (3, 500))
    off = winding_numbers(corners, points) - plain_windings(corners, points)
    assert 1e-9 < np.abs(off).max() < 0.05  # not the sum itself


def test_what_cannot_be_used_is_refused():
    assert gradedesign.distance_grid is distance_grid
    box = box_surface((1.0, 1.0, 1.0))
    with pytest.raises(MeshError, match="a band of 0 spacings"):
        distance_grid(box, (0, 0, 0), 0.1, (5, 5, 5), band=0.0)
    none = SurfaceMesh(vertices=box.vertices, faces=box.faces[:0])
    with pytest.raises(MeshError, match="no triangles"):
        distance_grid(none, (0, 0, 0), 0.1, (5, 5, 5))
