"""Cubes of a grid by the side of a part on which they lie; contours leave out what lies beyond."""

import numpy as np
import pytest
from plain_cells import plain_cells

from gradedesign.geometry.contour._side_kernels import (
    BESIDE,
    BEYOND,
    DEEP,
    NEAR,
    take_out_edges,
)
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.lattice import lattice_contour, trim
from gradedesign.geometry.lattice.cube_sides import CLEARANCE, cube_sides, where_wanted
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import LatticeDesign, lattice_field, uncut_field
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.signed_distance import surface_distance
from gradedesign.geometry.triangles._grid_kernels import meets_box
from gradedesign.geometry.triangles._surface_mesh_kernels import corners_of_box
from gradedesign.geometry.triangles.grid_classifier import mark_near
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points, enclosed_volume


def clipped_is_left(triangle, low, high):
    """Whether anything is left of a triangle that is clipped by the faces of a box (slow)."""
    polygon = list(triangle)
    for axis in range(3):
        for sign, at in ((1.0, low[axis]), (-1.0, -high[axis])):
            height = [sign * p[axis] - at for p in polygon]
            kept = []
            for n, p in enumerate(polygon):
                m = (n + 1) % len(polygon)
                if height[n] >= 0:
                    kept.append(p)
                if height[n] * height[m] < 0:
                    kept.append(p + height[n] / (height[n] - height[m]) * (polygon[m] - p))
            polygon = kept
            if not polygon:
                return False
    return True


def test_triangles_meet_boxes_where_clipping_leaves_something():
    rng = np.random.default_rng(51)
    hits = 0
    for _ in range(2000):
        triangle = rng.normal(size=(3, 3)) * rng.choice([0.3, 1.0, 3.0])
        middle, half = 0.3 * rng.normal(size=3), rng.uniform(0.2, 1.0, size=3)
        expected = clipped_is_left(triangle, middle - half, middle + half)
        assert meets_box(triangle, middle, half) == expected
        hits += expected
    assert 400 < hits < 1600


def test_near_cubes_are_those_of_a_loop_over_all_cubes():
    """Triangles of any size, some of them partly or wholly beyond the grid."""
    rng = np.random.default_rng(52)
    corners = rng.uniform(-2.0, 11.0, size=(12, 1, 3)) + rng.normal(size=(12, 3, 3))
    sides = np.full((9, 8, 7), BEYOND, dtype=np.uint8)
    mark_near(corners, 0.1, NEAR, sides)
    expected = np.zeros(sides.shape, dtype=bool)
    for place in np.ndindex(sides.shape):
        low = np.array(place) - 0.1
        expected[place] = any(clipped_is_left(t, low, low + 1.2) for t in corners)
    assert expected.any()
    np.testing.assert_array_equal(sides == NEAR, expected)


def hollow_ball():
    """Of 9 mm with a void of 4 mm inside."""
    return extract_surface(
        lambda p: np.maximum(np.linalg.norm(p, axis=0) - 9.0, 4.0 - np.linalg.norm(p, axis=0)),
        [-10] * 3,
        [10] * 3,
        0.7,
    )


def test_sides_are_those_of_the_distance():
    part = hollow_ball()
    distance = surface_distance(part)
    origin, shape, h = np.full(3, -10.2), (52, 51, 53), 0.4
    sides = cube_sides(part, origin, shape, h)
    assert sides.shape == (51, 50, 52)
    centres = origin[:, None, None, None] + h * (np.indices(sides.shape) + 0.5)
    value = distance(centres)
    assert (value[sides == DEEP] < -(0.5 + CLEARANCE) * h).all()
    assert (value[(sides == BESIDE) | (sides == BEYOND)] > (0.5 + CLEARANCE) * h).all()
    reach = np.sqrt(3) * (0.5 + CLEARANCE) * h
    far = np.abs(value) > reach
    assert np.count_nonzero(far & (sides == NEAR)) < 0.01 * np.count_nonzero(sides == NEAR)
    # Both voids are beyond, and cubes beside are the first of them.
    radius = np.linalg.norm(centres, axis=0)
    assert (sides[radius < 2.5] == BEYOND).all()
    beside = np.zeros(sides.shape, dtype=bool)
    for i, j, k in np.argwhere(sides == NEAR):
        beside[i - 1 : i + 2, j - 1 : j + 2, k - 1 : k + 2] = True
    np.testing.assert_array_equal(sides == BESIDE, beside & (value > 0) & (sides != NEAR))
    assert not take_out_edges(sides.copy())


def test_fields_are_asked_only_near_the_part():
    asked = []

    def field(points):
        asked.append(points)
        return points[0]

    sides = np.full((4, 4, 4), BEYOND, dtype=np.uint8)
    sides[1, 2, 3] = DEEP
    origin, h = np.array([1.0, 2.0, 3.0]), 0.5
    nodes = origin[:, None, None, None] + h * np.indices((5, 5, 5))
    values = where_wanted(field, sides, origin, h)(nodes)
    wanted = np.zeros((5, 5, 5), dtype=bool)
    wanted[1:3, 2:4, 3:5] = True
    np.testing.assert_array_equal(values, np.where(wanted, nodes[0], h))
    assert asked[0].shape == (3, 8)


def design(domain):
    """Flat sheets, slanted in x and z."""
    return LatticeDesign(
        domain=domain,
        cells=plain_cells(lambda u: np.abs(np.mod(u[0] + 0.5 * u[2], 1.0) - 0.5), 0.0, 0.5),
        cell_map=lambda x: x / 8.0,
        cell_size=8.0,
        density=0.4,
    )


def test_uncut_fields_are_those_of_the_lattice_inside_the_part():
    part = box_surface((12.0, 8.0, 8.0))
    domain = DesignDomain(distance=surface_distance(part), lower=(0, 0, 0), upper=(12, 8, 8))
    points = np.random.default_rng(53).uniform(0.5, 7.5, size=(3, 4000))
    uncut = uncut_field(design(domain), band=1.0)(points)
    np.testing.assert_array_equal(uncut < 0, lattice_field(design(domain))(points) < 0)
    assert uncut_field(design(domain), band=1.0)(np.array([[4.0], [50.0], [0.0]]))[0] < 0


def test_what_lies_beyond_the_part_changes_nothing(monkeypatch):
    """A turned box: the same volume and extent where no cube is left out or apart."""
    angle = 0.4
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    straight = box_surface((12.0, 8.0, 8.0))
    part = SurfaceMesh(vertices=straight.vertices @ turn.T, faces=straight.faces)
    domain = DesignDomain(
        distance=surface_distance(part),
        lower=part.vertices.min(axis=0),
        upper=part.vertices.max(axis=0),
    )
    found = trim.trimmed_surface(design(domain), part, 0.4)
    cuts = []

    def all_near(part, origin, shape, h):
        cuts.append(shape)
        return np.full([n - 1 for n in shape], NEAR, dtype=np.uint8)

    monkeypatch.setattr(lattice_contour, "cube_sides", all_near)
    monkeypatch.setattr(
        lattice_contour, "uncut_field", lambda design, **told: lattice_field(design, **told)
    )
    plain = trim.trimmed_surface(design(domain), part, 0.4)
    assert cuts
    # Triangles beyond the faces take their heights from the part there.
    assert enclosed_volume(found) == pytest.approx(enclosed_volume(plain), rel=1e-4)
    np.testing.assert_allclose(np.ptp(found.vertices, axis=0), np.ptp(plain.vertices, axis=0))
    outside = surface_distance(part)(corner_points(found).reshape(-1, 3).T)
    assert outside.max() < 1e-9


def test_boxes_around_points_are_those_of_numpy():
    points = np.random.default_rng(54).normal(size=(50, 3))
    np.testing.assert_array_equal(corners_of_box(points), [points.min(axis=0), points.max(axis=0)])
