"""The printed solid as a field: against plain searches, analytic solids and awkward surfaces."""

import numba
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_windings import plain_windings

from gradedesign.errors import MeshError
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles.grid_classifier import (
    build_classifier,
    marked_inside,
    winding_at,
)
from gradedesign.geometry.triangles.printed_field import printed_field
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points, enclosed_volume
from gradedesign.geometry.triangles.triangle_tree import build_triangle_tree, closest_triangles


def as_surface(mesh):
    return SurfaceMesh(vertices=mesh.vertices, faces=mesh.faces)


def joined(*surfaces):
    """All triangles of some surfaces in one."""
    starts = np.cumsum([0, *(len(s.vertices) for s in surfaces)])
    return SurfaceMesh(
        vertices=np.concatenate([s.vertices for s in surfaces]),
        faces=np.concatenate([s.faces + n for s, n in zip(surfaces, starts, strict=False)]),
    )


def moved(surface, by):
    return SurfaceMesh(vertices=surface.vertices + by, faces=surface.faces)


def reversed_surface(surface):
    return SurfaceMesh(vertices=surface.vertices, faces=surface.faces[:, ::-1])


def plate_with_hole():
    """A plate of 8 x 8 x 2 mm with a hole of 3 mm; faceted like a part file."""
    return as_surface(trimesh.creation.annulus(r_min=1.5, r_max=5.0, height=2.0, sections=60))


def gyroid_sheet(p):
    q = 2 * np.pi * p / 8.0
    f = np.sin(q[0]) * np.cos(q[1]) + np.sin(q[1]) * np.cos(q[2]) + np.sin(q[2]) * np.cos(q[0])
    return (np.abs(f) - 0.6) * 8.0 / (2 * np.pi) / 1.5


def plain_winding(surface, points):
    """Solid angles of all triangles, one point at a time."""
    return np.rint(plain_windings(corner_points(surface), points)).astype(int)


def plain_field(surface, points, band):
    """The definition, from the whole distance and solid angles."""
    distance, _, _ = closest_triangles(build_triangle_tree(corner_points(surface)), points)
    inside = plain_winding(surface, points) > 0
    return np.where(inside, -1, 1) * np.minimum(distance, band)


SURFACES = {
    "box": box_surface((3.0, 2.0, 1.0)),
    "plate with a hole": plate_with_hole(),
    "cavity": joined(
        box_surface((4.0, 4.0, 4.0)), moved(reversed_surface(box_surface((2.0, 2.0, 2.0))), 1.0)
    ),
    "overlap": joined(box_surface((2.0, 2.0, 2.0)), moved(box_surface((2.0, 2.0, 2.0)), 1.0)),
    "turned": as_surface(
        trimesh.creation.box((3, 2, 1), trimesh.transformations.euler_matrix(0.3, 0.5, 0.7))
    ),
    "gyroid sheet": extract_surface(gyroid_sheet, [0, 0, 0], [8, 8, 8], 0.5),
}


def random_points(surface, count, rng):
    """Points in a box a fifth larger than the surface's, (3, count)."""
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    room = 0.2 * (high - low)
    return rng.uniform(low - room, high + room, (count, 3)).T


@pytest.mark.parametrize("name", SURFACES)
def test_field_is_the_plain_definition(name):
    surface, rng = SURFACES[name], np.random.default_rng(11)
    points = random_points(surface, 2000, rng)
    band = 0.2
    np.testing.assert_allclose(
        printed_field(surface, band)(points), plain_field(surface, points, band), atol=1e-12
    )


@pytest.mark.parametrize("name", SURFACES)
def test_rays_through_corners_and_edges_count_once(name):
    # above and below corners and middles of edges, where a plain ray test counts twice or never
    surface, rng = SURFACES[name], np.random.default_rng(12)
    corners = corner_points(surface)[rng.permutation(len(surface.faces))[:150]]
    places = np.concatenate([corners.reshape(-1, 3), 0.5 * (corners[:, 0] + corners[:, 1])])
    points = np.concatenate([places + step for step in 0.0371 * np.eye(3)]).T
    points = np.concatenate([points, points - 0.0523 * np.array([[0], [0], [1]])], axis=1)
    distance, _, _ = closest_triangles(build_triangle_tree(corner_points(surface)), points)
    points = points[:, distance > 1e-9]
    found = winding_at(build_classifier(surface), points)
    np.testing.assert_array_equal(found, plain_winding(surface, points))


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), st.integers(0, 2))
def test_any_integer_box_has_whole_windings_on_an_integer_grid(seed, axis):
    # coordinates of points, corners and columns all coincide
    rng = np.random.default_rng(seed)
    pieces = [
        moved(box_surface(tuple(rng.integers(1, 4, 3).astype(float))), rng.integers(0, 4, 3))
        for _ in range(3)
    ]
    surface = joined(*pieces)
    surface = SurfaceMesh(vertices=np.roll(surface.vertices, axis, axis=1), faces=surface.faces)
    grid = np.stack(np.meshgrid(*[np.arange(-1.0, 8.0)] * 3, indexing="ij")).reshape(3, -1)
    distance, _, _ = closest_triangles(build_triangle_tree(corner_points(surface)), grid)
    free = grid[:, distance > 1e-9]
    winding = plain_winding(surface, free)
    np.testing.assert_array_equal(winding_at(build_classifier(surface), free), winding)
    marks = marked_inside(corner_points(surface) + 1.0, (9, 9, 9)).ravel()
    np.testing.assert_array_equal(marks[distance > 1e-9], winding > 0)


def test_sphere_is_that_of_the_formula():
    # faceting: the sagitta of facets of 0.14 mm on 2 mm is 1.2e-3 mm
    surface = extract_surface(lambda p: np.linalg.norm(p, axis=0) - 2.0, [-3] * 3, [3] * 3, 0.1)
    points = np.random.default_rng(13).uniform(-3, 3, (3, 20, 30, 10))
    exact = np.clip(np.linalg.norm(points, axis=0) - 2.0, -0.4, 0.4)
    value = printed_field(surface, 0.4)(points)
    assert value.shape == (20, 30, 10)
    np.testing.assert_allclose(value, exact, atol=2e-3)


def test_gyroid_sheet_agrees_with_its_field_and_its_volume():
    lower, upper, h = np.zeros(3), np.full(3, 8.0), 0.25
    surface = extract_surface(gyroid_sheet, lower, upper, h)
    axis = (np.arange(100) + 0.5) * 0.08
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"))
    value, meant = printed_field(surface, 2 * h)(grid), gyroid_sheet(grid)
    # facets lie within h^2 / (8 R) of the field, R > 1 mm; a grid step from the box, whose edges
    # the contour chamfers
    inner = np.abs(grid - 4.0).max(axis=0) < 4.0 - h
    away = inner & (np.abs(meant) > 0.1 * h)
    assert np.count_nonzero(away) > 0.7 * away.size
    assert np.all((value < 0) == (meant < 0), where=away)
    assert np.abs(value).max() == 2 * h
    # one random point in every cell: of the cells that the surface cuts each errs by half at most
    jittered = grid + np.random.default_rng(16).uniform(-0.04, 0.04, grid.shape)
    value = printed_field(surface, 2 * h)(jittered)
    error = 4 * 0.5 * np.sqrt(np.count_nonzero(np.abs(value) < 0.07)) * 0.08**3
    assert np.count_nonzero(value < 0) * 0.08**3 == pytest.approx(
        enclosed_volume(surface), abs=error
    )


def test_values_do_not_depend_on_the_order_of_points_or_threads():
    surface, rng = SURFACES["gyroid sheet"], np.random.default_rng(14)
    field = printed_field(surface, 0.8)
    axis = np.linspace(-0.5, 8.5, 40)
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij")).reshape(3, -1)
    value, order = field(grid), rng.permutation(grid.shape[1])
    np.testing.assert_array_equal(field(grid[:, order]), value[order])
    before = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        np.testing.assert_array_equal(field(grid), value)
    finally:
        numba.set_num_threads(before)


def test_slope_is_at_most_one():
    field, rng = printed_field(SURFACES["plate with a hole"], 0.5), np.random.default_rng(15)
    a = random_points(SURFACES["plate with a hole"], 3000, rng)
    b = a + rng.normal(scale=0.1, size=a.shape)
    assert np.all(np.abs(field(a) - field(b)) <= np.linalg.norm(a - b, axis=0) + 1e-12)


def test_open_reversed_and_empty_surfaces_are_refused():
    box = box_surface((1.0, 1.0, 1.0))
    with pytest.raises(MeshError, match=r"11 triangles and 3 edges"):
        printed_field(SurfaceMesh(vertices=box.vertices, faces=box.faces[1:]), 0.1)
    with pytest.raises(MeshError, match=r"encloses -1 mm\^3"):
        printed_field(reversed_surface(box), 0.1)
    with pytest.raises(MeshError, match="0 triangles"):
        printed_field(SurfaceMesh(vertices=box.vertices, faces=box.faces[:0]), 0.1)
    with pytest.raises(ValueError, match="band of 0 mm"):
        printed_field(box, 0.0)
    with pytest.raises(ValueError, match="not finite"):
        printed_field(box, 0.1)(np.full((3, 2), np.nan))
