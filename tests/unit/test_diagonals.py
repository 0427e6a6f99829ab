"""Diagonals of contours lie near the surface, and leave it closed, oriented and uncrossed."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, map_coordinates

from gradedesign.geometry.contour import surface as surfaces
from gradedesign.geometry.contour._diagonal_kernels import _slopes, opposite_triangles
from gradedesign.geometry.contour._side_kernels import DEEP, NEAR, take_out_edges
from gradedesign.geometry.contour._surface_kernels import unpaired_edges
from gradedesign.geometry.contour.surface import boxed_grid, contour, extract_surface
from gradedesign.geometry.triangles.crossings import crossing_triangles


def unflipped(monkeypatch):
    monkeypatch.setattr(surfaces, "_with_better_diagonals", lambda *_: 0)


def off(surface, distance, splits=4):
    """Mean distance of the surface over its area."""
    corners = surface.vertices[surface.faces]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    steps = [(i, j, splits - i - j) for i in range(splits + 1) for j in range(splits + 1 - i)]
    points = np.einsum("kc,tcd->dtk", np.array(steps) / splits, corners)
    return (area * np.abs(distance(points)).mean(axis=1)).sum() / area.sum()


def ball(points):
    return np.linalg.norm(points - 5.0, axis=0) - 3.0


def struts(points):
    """Four of radius 0.9 from the middle of a box towards corners of it."""
    p = points - 5.0
    across = []
    for end in ((-1, -1, -1), (1, 1, -1), (-1, 1, 1), (1, -1, 1)):
        axis = np.array(end) / np.sqrt(3)
        along = np.maximum(np.tensordot(axis, p, 1), 0.0)
        across.append(np.linalg.norm(p - np.multiply.outer(axis, along), axis=0))
    return np.maximum(np.minimum.reduce(across) - 0.9, np.linalg.norm(p, axis=0) - 4.6)


def box(points):
    """Turned by 30 degrees, 5 mm wide: creases and flat faces."""
    p = points - 5.0
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    q = np.abs(np.stack([c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]])) - 2.55
    return np.linalg.norm(np.maximum(q, 0.0), axis=0) + np.minimum(q.max(axis=0), 0.0)


@pytest.mark.parametrize(
    ("field", "most"), [(ball, 0.99), (struts, 0.8), (box, 1.0)], ids=["ball", "struts", "box"]
)
def test_surfaces_come_nearer_to_the_field(field, most, monkeypatch):
    """Shares measured; every facet of a ball is off the same way, that of a strut either way."""
    found = off(extract_surface(field, [0] * 3, [10] * 3, 0.5), field)
    unflipped(monkeypatch)
    assert found <= most * off(extract_surface(field, [0] * 3, [10] * 3, 0.5), field)


def smooth_noise(width, seed):
    noise = gaussian_filter(np.random.default_rng(seed).normal(size=(34, 34, 34)), width)
    return noise / noise.std()


@pytest.mark.parametrize("width", [1.0, 1.6, 2.5])
def test_thin_walls_stay_closed_uncrossed_and_apart_from_deep_cubes(width, monkeypatch):
    """Walls down to below a spacing, about a third of the cubes deep; in slabs of any size."""
    noise, marked = smooth_noise(width, 31), np.random.default_rng(32).random((17, 17, 17)) < 0.3
    sides = np.where(marked, DEEP, NEAR).astype(np.uint8)
    for axis in range(3):
        sides = np.repeat(sides, 2, axis=axis)
    sides = np.ascontiguousarray(sides[:32, :32, :32])
    while take_out_edges(sides):
        pass

    def field(points):
        return np.abs(map_coordinates(noise, points + 1.0, order=3)) - 0.3

    def made(nodes):
        grid = boxed_grid([0] * 3, [31] * 3, 1.0)
        return contour(field, grid, sides=sides, nodes=nodes)

    found, again = made(1 << 20), made(5000)
    whole = np.concatenate([found.deep, found.near])
    n = len(found.vertices)
    assert unpaired_edges(whole, n) == (0, 0)
    assert unpaired_edges(np.concatenate([found.near, found.inner]), n) == (0, 0)
    assert len(crossing_triangles(found.vertices, whole, 1e-9)) == 0
    np.testing.assert_array_equal(again.deep, found.deep)
    np.testing.assert_array_equal(again.near, found.near)
    unflipped(monkeypatch)
    before = made(1 << 20)
    np.testing.assert_array_equal(before.vertices, found.vertices)
    changed = (np.sort(whole) != np.sort(np.concatenate([before.deep, before.near]))).any(axis=1)
    assert np.count_nonzero(changed) > 30


def test_opposite_triangles_are_those_of_a_loop_over_sides():
    """An open piece of a closed surface: some sides have no other triangle."""
    faces = extract_surface(ball, [0] * 3, [10] * 3, 1.0).faces[30:].astype(np.int32)
    by_side = {}
    for t, corners in enumerate(faces):
        for c in range(3):
            by_side[corners[c], corners[(c + 1) % 3]] = t
    expected = [
        [by_side.get((corners[(c + 1) % 3], corners[c]), -1) for c in range(3)] for corners in faces
    ]
    assert -1 in np.array(expected)
    np.testing.assert_array_equal(opposite_triangles(faces, faces.max() + 1), expected)


def test_fitted_quadrics_are_those_of_weighted_least_squares():
    """numpy's lstsq with the least rise of the normal equations as further rows."""
    rng = np.random.default_rng(33)
    for count in (5, 7, 12):
        a, b, height = rng.uniform(-1.0, 1.0, size=(3, count))
        root = 1.0 / np.sqrt(a * a + b * b + 1e-3)
        rows = np.stack([a, b, a * a, a * b, b * b], axis=1) * root[:, None]
        rows = np.concatenate([rows, 1e-3 * np.eye(5)])
        expected = np.linalg.lstsq(rows, np.concatenate([height * root, np.zeros(5)]))[0]
        np.testing.assert_allclose(_slopes(a, b, height, count), expected, rtol=1e-7, atol=1e-9)
    assert np.isnan(_slopes(np.zeros(8), np.zeros(8), np.ones(8), 8)).all()
