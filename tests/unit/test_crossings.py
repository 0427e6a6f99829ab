"""Triangles that pass through each other, and winding numbers along rays."""

from __future__ import annotations

import numpy as np
import pytest

from gradedesign.geometry.contour.surface import boxed_grid, extract_surface
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles import crossings, triangle_cells
from gradedesign.geometry.triangles.crossings import crossing_triangles
from gradedesign.geometry.triangles.surface_mesh import corner_points
from gradedesign.geometry.triangles.triangle_cells import CellGrid
from gradedesign.geometry.triangles.winding import winding_numbers, winding_volumes

BOX = box_surface((10.0, 10.0, 10.0))
CORNERS = corner_points(BOX)


def both(shift, scale=1.0):
    """Vertices and faces of two boxes, the second scaled and moved."""
    vertices = np.concatenate([BOX.vertices, scale * BOX.vertices + shift])
    return vertices, np.concatenate([BOX.faces, BOX.faces + 8])


def plain_crossing(p, q) -> bool:
    """Whether a side of one triangle meets the inside of the other: one linear system a side."""
    for one, other in ((p, q), (q, p)):
        for k in range(3):
            start, end = one[k], one[(k + 1) % 3]
            matrix = np.stack([start - end, other[1] - other[0], other[2] - other[0]], axis=1)
            if abs(np.linalg.det(matrix)) < 1e-12:
                continue
            s, u, v = np.linalg.solve(matrix, start - other[0])
            if 0 < s < 1 and u > 0 and v > 0 and u + v < 1:
                return True
    return False


@pytest.mark.parametrize("many", [10**9, 1], ids=["tree", "cells"])
def test_pairs_are_those_of_the_plain_test_over_all_pairs(many, monkeypatch):
    monkeypatch.setattr(crossings, "MANY", many)
    monkeypatch.setattr(triangle_cells, "ENTRIES", 1000)
    rng = np.random.default_rng(11)
    corners = rng.uniform(0, 10, (120, 1, 3)) + rng.uniform(-2, 2, (120, 3, 3))
    faces = np.arange(360).reshape(-1, 3)
    found = {int(i) for i, _ in crossing_triangles(corners.reshape(-1, 3), faces, 1e-9)}
    plain = {
        i
        for i in range(120)
        if any(plain_crossing(corners[i], corners[j]) for j in range(i + 1, 120))
    }
    assert found == plain
    assert len(plain) > 20


@pytest.mark.parametrize(
    ("shift", "scale", "crosses"),
    [
        ((5.0, 4.0, 3.0), 1.0, True),
        ((20.0, 0.0, 0.0), 1.0, False),
        ((2.0, 2.0, 2.0), 0.5, False),
        ((10.0, 0.0, 0.0), 1.0, False),
        ((10.0, 2.0, 3.0), 1.0, False),
        ((10.0 - 1e-7, 2.0, 3.0), 1.0, False),
        ((9.99, 2.0, 3.0), 1.0, True),
    ],
    ids=["across", "apart", "inside", "same face", "touching", "within the margin", "just across"],
)
@pytest.mark.parametrize("many", [10**9, 1], ids=["tree", "cells"])
def test_boxes(shift, scale, crosses, many, monkeypatch):
    monkeypatch.setattr(crossings, "MANY", many)
    monkeypatch.setattr(triangle_cells, "ENTRIES", 1000)
    assert bool(len(crossing_triangles(*both(shift, scale), 1e-5))) == crosses


@pytest.mark.parametrize("shift", [(3.0, 0.01, 0.02), (0.3, 0.0, 0.0), (0.5, 0.5, 0.25)])
def test_the_grid_of_a_contour_hides_no_crossing(shift, monkeypatch):
    """Two contours of a ball, the second moved: within, along and across cells of the grid."""
    ball = extract_surface(lambda p: np.linalg.norm(p, axis=0) - 2.0, [-3] * 3, [3] * 3, 0.25)
    vertices = np.concatenate([ball.vertices, ball.vertices + shift])
    faces = np.concatenate([ball.faces, ball.faces + len(ball.vertices)])
    tree = {int(i) for i, _ in crossing_triangles(vertices, faces, 1e-3)}
    monkeypatch.setattr(crossings, "MANY", 1)
    monkeypatch.setattr(triangle_cells, "ENTRIES", 1000)
    grid = CellGrid(origin=boxed_grid([-3] * 3, [3] * 3, 0.25).origin, spacing=0.25)
    assert {int(i) for i, _ in crossing_triangles(vertices, faces, 1e-3, grid)} == tree
    assert tree
    cells = triangle_cells.triangle_cells(ball.vertices, ball.faces, grid=grid, reach=-1e-5)
    assert cells.spacing == 0.25
    assert len(cells.users) == len(ball.faces)  # each in one cell


def test_a_closed_surface_does_not_cross_itself():
    assert len(crossing_triangles(BOX.vertices, BOX.faces, 1e-9)) == 0
    assert crossing_triangles(BOX.vertices, BOX.faces[:0], 1e-9).shape == (0, 2)


def test_volumes_by_winding_number_of_two_boxes():
    """Boxes of 1000 mm^3 moved by 5 mm each way share 125; one of them reversed takes 875 off."""
    twice = winding_volumes(np.concatenate([CORNERS, CORNERS + 5.0]))
    assert twice.torn == 0.0
    np.testing.assert_allclose(twice[:3], [1875.0, 125.0, 0.0], rtol=2e-3)
    less = winding_volumes(np.concatenate([CORNERS, CORNERS[:, ::-1] + 5.0]))
    np.testing.assert_allclose(less[:3], [875.0, 0.0, 875.0], rtol=2e-3)
    np.testing.assert_allclose(winding_volumes(CORNERS)[:3], [1000.0, 0.0, 0.0], rtol=1e-3)


def test_torn_rays_are_counted_not_summed():
    torn = winding_volumes(CORNERS[1:])
    assert 0.05 < torn.torn < 0.15  # half of those that meet it along one of three axes
    assert torn.solid < 1000.0


def test_winding_numbers_are_those_of_the_plain_formula():
    rng = np.random.default_rng(12)
    corners, points = rng.normal(size=(30, 3, 3)), rng.normal(size=(20, 3))
    plain = np.zeros(20)
    for k, point in enumerate(points):
        for a, b, c in corners - point:
            la, lb, lc = (np.linalg.norm(v) for v in (a, b, c))
            below = la * lb * lc + (a @ b) * lc + (b @ c) * la + (c @ a) * lb
            plain[k] += np.arctan2(a @ np.cross(b, c), below) / (2 * np.pi)
    np.testing.assert_allclose(winding_numbers(corners, points), plain, atol=1e-12)


def test_surfaces_that_may_and_may_not_be_written_to_take_one_kernel():
    """Compiling it takes seconds; a stored surface is locked, a new one is not."""
    for faces in (BOX.faces, BOX.faces.copy()):
        for vertices in (BOX.vertices, BOX.vertices.copy()):
            assert len(crossing_triangles(vertices, faces, 1e-6)) == 0
    assert len(crossings.kernels.find_crossed.signatures) == 1
