"""Closest triangle: equal to a plain search, to trimesh, and right on every kind of feature."""

import numba
import numpy as np
import pytest
import trimesh

from gradedesign.errors import MeshError
from gradedesign.geometry.triangles._closest_kernels import (
    nearest_on_triangle,
    squared_distances,
)
from gradedesign.geometry.triangles.triangle_tree import (
    build_triangle_tree,
    closest_features,
    closest_triangles,
    distance_within,
    ray_lengths,
)


def segment_distance(p, a, b):
    """Distance of points (n, 3) to one segment."""
    d = b - a
    length2 = d @ d
    s = np.clip((p - a) @ d / length2, 0, 1) if length2 > 0 else np.zeros(len(p))
    return np.linalg.norm(p - a - s[:, None] * d, axis=1)


def plain_distance(p, corners):
    """Distance of points (n, 3) to triangles, one triangle at a time."""
    best = np.full(len(p), np.inf)
    for a, b, c in corners:
        for ends in ((a, b), (b, c), (c, a)):
            best = np.minimum(best, segment_distance(p, *ends))
        normal = np.cross(b - a, c - a)
        if np.linalg.norm(normal) < 1e-12:
            continue
        normal /= np.linalg.norm(normal)
        height = (p - a) @ normal
        foot = p - height[:, None] * normal
        inside = np.all(
            [np.cross(e - s, foot - s) @ normal >= 0 for s, e in ((a, b), (b, c), (c, a))], axis=0
        )
        best = np.where(inside, np.minimum(best, np.abs(height)), best)
    return best


@pytest.mark.parametrize("count", [1, 4, 5, 37, 200])
def test_distance_equals_a_plain_search(count):
    rng = np.random.default_rng(count + 7)
    corners = rng.normal(size=(count, 1, 3)) + 0.3 * rng.normal(size=(count, 3, 3))
    corners[::11, 2] = 0.25 * corners[::11, 0] + 0.75 * corners[::11, 1]  # flat
    corners[5::17, 1] = corners[5::17, 2] = corners[5::17, 0]  # a point
    points = 2 * rng.normal(size=(3, 700))
    distance, triangle, closest = closest_triangles(build_triangle_tree(corners), points)
    np.testing.assert_allclose(distance, plain_distance(points.T, corners), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(points - closest, axis=0), distance, atol=1e-12)
    own = [plain_distance(c[None], corners[[t]])[0] for c, t in zip(closest.T, triangle)]  # noqa: B905
    assert max(own) < 1e-12


@pytest.mark.parametrize("flat", [0, 7])
@pytest.mark.parametrize("reach", [0.05, 0.6, np.inf])
def test_points_that_share_a_search_get_the_distances_of_a_search_each(flat, reach):
    # 3000 triangles in a cube of 2 mm, more than points may share where they are far apart
    rng = np.random.default_rng(61)
    corners = rng.uniform(0, 2, (3000, 1, 3)) + 0.06 * rng.normal(size=(3000, 3, 3))
    corners[: 20 * flat, 2] = corners[: 20 * flat, 1]
    tree = build_triangle_tree(corners)
    axis = (np.arange(24) + 0.3) / 10.0
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"))
    blocks = grid.reshape(3, 6, 2, 2, 6, 2, 2, 6, 2, 2).transpose(0, 1, 4, 7, 2, 5, 8, 3, 6, 9)
    for points in (blocks.reshape(3, -1), grid.reshape(3, -1), rng.uniform(-3, 5, (3, 2000))):
        each, _, _ = closest_triangles(tree, points)
        np.testing.assert_array_equal(distance_within(tree, points, reach), np.minimum(each, reach))
        some = points[:, :3]
        np.testing.assert_array_equal(
            distance_within(tree, some, reach), np.minimum(each[:3], reach)
        )


def test_distances_of_several_triangles_at_once_are_those_of_one():
    rng = np.random.default_rng(62)
    triangles = np.concatenate([rng.normal(size=(4000, 3)), rng.normal(size=(4000, 6))], axis=1)
    triangles[::3, 6:] = triangles[::3, 3:6] * rng.uniform(-1, 2, (1334, 1))
    triangles[::3, 6:] += 10.0 ** rng.uniform(-6, 0, (1334, 1)) * rng.normal(size=(1334, 3))
    columns, square = np.ascontiguousarray(triangles.T), np.zeros(4000)
    for x, y, z in 2 * rng.normal(size=(20, 3)):
        least = squared_distances(columns, 4000, x, y, z, square)
        flat = np.zeros(4000, dtype=bool)
        each = [nearest_on_triangle(triangles, flat, s, x, y, z)[0] for s in range(4000)]
        np.testing.assert_array_equal(square, each)
        assert least == square.min()


def test_agrees_with_trimesh_on_a_sphere():
    ball = trimesh.creation.icosphere(subdivisions=2, radius=3.0)
    points = np.random.default_rng(11).uniform(-4, 4, (300, 3))
    expected, distance, _ = trimesh.proximity.closest_point(ball, points)
    found = closest_features(build_triangle_tree(ball.triangles), points.T)
    np.testing.assert_allclose(found.distance, distance, atol=1e-12)
    np.testing.assert_allclose(found.point.T, expected, atol=1e-12)


def test_features_of_one_triangle():
    corners = np.array([[[0, 0, 0], [4, 0, 0], [0, 4, 0.0]]])
    # above the face; beside edges 01, 12, 20; beyond corners 0, 1, 2
    points = np.array(
        [[1, 1, 2], [2, -1, 1], [3, 3, 0], [-1, 2, 0], [-1, -1, 3], [6, -1, 0], [-1, 7, 1.0]]
    )
    found = closest_features(build_triangle_tree(corners), points.T)
    assert found.feature.tolist() == [0, 1, 2, 3, 4, 5, 6]
    np.testing.assert_allclose(
        found.point.T,
        [[1, 1, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [0, 0, 0], [4, 0, 0], [0, 4, 0]],
    )


def test_features_of_a_flat_triangle():
    corners = np.array([[[0, 0, 0], [4, 0, 0], [1, 0, 0.0]]])
    points = np.array([[2, 1, 0], [-1, 0, 0], [5, 1, 0], [1, 0, 3.0]])
    found = closest_features(build_triangle_tree(corners), points.T)
    assert found.feature[0] in (1, 2)
    assert found.feature[1:3].tolist() == [4, 5]
    np.testing.assert_allclose(found.distance, [1, 1, np.sqrt(2), 3])


def test_same_answer_for_any_number_of_threads():
    ball = trimesh.creation.icosphere(subdivisions=3)
    points = np.random.default_rng(13).normal(size=(3, 3000))
    tree = build_triangle_tree(ball.triangles)
    threads = numba.get_num_threads()
    found = []
    for count in (1, threads):
        numba.set_num_threads(count)
        found.append(closest_features(tree, points))
    for one, other in zip(*found, strict=True):
        assert np.array_equal(one, other)


def test_refuses_bad_input():
    with pytest.raises(MeshError, match="no triangles"):
        build_triangle_tree(np.zeros((0, 3, 3)))
    with pytest.raises(ValueError, match="not finite"):
        build_triangle_tree(np.full((1, 3, 3), np.nan))
    tree = build_triangle_tree(np.eye(3)[None])
    with pytest.raises(ValueError, match=r"expected \(3, n\)"):
        closest_triangles(tree, np.zeros((5, 3)))
    with pytest.raises(ValueError, match="1 coordinates are not finite"):
        closest_triangles(tree, np.array([[0.0], [np.inf], [0.0]]))


def test_no_points_give_no_answers():
    distance, triangle, closest = closest_triangles(
        build_triangle_tree(np.eye(3)[None]), np.zeros((3, 0))
    )
    assert distance.shape == triangle.shape == (0,)
    assert closest.shape == (3, 0)


def plain_lengths(corners, origin, direction, way):
    """Lengths of a ray to all triangles, one linear system each."""
    for a, b, c in corners:
        matrix = np.stack([b - a, c - a, -direction], axis=1)
        if abs(np.linalg.det(matrix)) < 1e-12:
            continue
        v, w, length = np.linalg.solve(matrix, origin - a)
        out = direction @ np.cross(b - a, c - a)
        if min(v, w, length, 1 - v - w) >= 0 and (way == 0 or out * way > 0):
            yield length


@pytest.mark.parametrize("way", [1, -1, 0])
def test_rays_end_at_the_first_of_all_triangles(way):
    rng = np.random.default_rng(15)
    corners = rng.normal(size=(150, 1, 3)) * 3 + rng.normal(size=(150, 3, 3))
    corners[::10, 2] = corners[::10, 1]  # no area
    origins, directions = rng.normal(size=(3, 300)), rng.normal(size=(3, 300))
    directions[:, ::3] = np.eye(3)[:, rng.integers(0, 3, 100)] * rng.choice([-1, 1], 100)
    directions /= np.linalg.norm(directions, axis=0)
    found = ray_lengths(build_triangle_tree(corners), origins, directions, way)
    rays = zip(origins.T, directions.T, strict=True)
    plain = [min(plain_lengths(corners, o, d, way), default=np.inf) for o, d in rays]
    np.testing.assert_allclose(found, plain, rtol=1e-9)
    assert 50 < np.count_nonzero(np.isfinite(found)) < 290


def test_rays_through_corners_and_edges_meet_the_surface():
    ball = trimesh.creation.icosphere(subdivisions=2)
    a, b, _ = np.moveaxis(ball.triangles, 1, 0)
    ends = np.concatenate([a, 0.5 * (a + b)]).T
    found = ray_lengths(
        build_triangle_tree(ball.triangles),
        np.zeros_like(ends),
        ends / np.linalg.norm(ends, axis=0),
    )
    np.testing.assert_allclose(found, np.linalg.norm(ends, axis=0), rtol=1e-12)
