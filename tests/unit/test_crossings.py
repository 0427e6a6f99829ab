"""Triangles that pass through each other, and winding numbers along rays."""

from __future__ import annotations

import numpy as np
import pytest

from gradedesign.errors import MeshError
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles import crossings
from gradedesign.geometry.triangles.crossings import crossing_triangles
from gradedesign.geometry.triangles.grid_classifier import winding_volumes
from gradedesign.geometry.triangles.surface_mesh import corner_points

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


def test_pairs_are_those_of_the_plain_test_over_all_pairs():
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
def test_boxes(shift, scale, crosses):
    assert bool(len(crossing_triangles(*both(shift, scale), 1e-5))) == crosses


def test_a_closed_surface_does_not_cross_itself():
    assert len(crossing_triangles(BOX.vertices, BOX.faces, 1e-9)) == 0
    assert crossing_triangles(BOX.vertices, BOX.faces[:0], 1e-9).shape == (0, 2)


def test_volumes_by_winding_number_of_two_boxes():
    """Boxes of 1000 mm^3 moved by 5 mm each way share 125; one of them reversed takes 875 off."""
    twice = winding_volumes(np.concatenate([CORNERS, CORNERS + 5.0]))
    np.testing.assert_allclose(twice, [1875.0, 125.0, 0.0], rtol=2e-3)
    less = winding_volumes(np.concatenate([CORNERS, CORNERS[:, ::-1] + 5.0]))
    np.testing.assert_allclose(less, [875.0, 0.0, 875.0], rtol=2e-3)
    np.testing.assert_allclose(winding_volumes(CORNERS), [1000.0, 0.0, 0.0], rtol=1e-3)


def test_volumes_of_an_open_surface_are_refused():
    with pytest.raises(MeshError, match="rays enter and leave the surface unequally often"):
        winding_volumes(CORNERS[1:])


def test_surfaces_that_may_and_may_not_be_written_to_take_one_kernel():
    """Compiling it takes seconds; a stored surface is locked, a new one is not."""
    for faces in (BOX.faces, BOX.faces.copy()):
        for vertices in (BOX.vertices, BOX.vertices.copy()):
            assert len(crossing_triangles(vertices, faces, 1e-6)) == 0
    assert len(crossings.kernels.find_crossed.signatures) == 1
