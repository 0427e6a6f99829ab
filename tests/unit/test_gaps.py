"""Gaps between faces of a part, and what is said where elements join them."""

import numpy as np
import pytest

from gradedesign.mesh.surface_mesh import SurfaceMesh
from gradedesign.part.box import box_surface
from gradedesign.resolve.analysable import Analysable
from gradedesign.resolve.analysable_lattice import joined_faces
from gradedesign.verify.finite_cells import FINITE_CELLS
from gradedesign.verify.gaps import narrowest_gap


def two_boxes(apart):
    """Boxes of 10 x 10 x 10 mm beside each other."""
    one = box_surface((10.0, 10.0, 10.0))
    other = one.vertices + np.array([10.0 + apart, 0.0, 0.0])
    return SurfaceMesh(
        vertices=np.concatenate([one.vertices, other]),
        faces=np.concatenate([one.faces, one.faces + len(one.vertices)]),
    )


def notched(angle):
    """A prism of 10 mm with a notch of an angle, in degrees, 4 mm deep in its upper face."""
    half = 4.0 * np.tan(np.radians(angle / 2))
    xy = [(-5, 0), (5, 0), (5, 8), (half, 8), (0, 4), (-half, 8), (-5, 8)]
    low = np.array([(x, y, 0.0) for x, y in xy])
    high = low + np.array([0.0, 0.0, 10.0])
    n = len(xy)
    sides = [
        face
        for k in range(n)
        for face in ((k, (k + 1) % n, n + (k + 1) % n), (k, n + (k + 1) % n, n + k))
    ]
    caps = [(4, 5, 6), (4, 6, 0), (4, 0, 1), (4, 1, 2), (4, 2, 3)]
    faces = sides + [(a + n, b + n, c + n) for a, b, c in caps] + [(a, c, b) for a, b, c in caps]
    return SurfaceMesh(vertices=np.concatenate([low, high]), faces=np.array(faces))


def test_gap_between_two_boxes_has_its_width_and_place():
    gap = narrowest_gap(two_boxes(0.2), 0.5)
    assert gap.width == pytest.approx(0.2, rel=1e-9)
    assert gap.middle[0] == pytest.approx(10.1)
    assert narrowest_gap(two_boxes(0.6), 0.5) is None


def test_one_box_has_no_gap():
    assert narrowest_gap(box_surface((10.0, 10.0, 10.0)), 5.0) is None


@pytest.mark.parametrize(("angle", "found"), [(90.0, False), (45.0, False), (15.0, True)])
def test_corner_of_a_notch_is_no_gap_unless_it_is_acute(angle, found):
    assert (narrowest_gap(notched(angle), 0.5) is not None) == found


def able(spacing):
    return Analysable(
        analysis=FINITE_CELLS, bounds=(0.2, 0.6), elements_per_wall=2.0, spacing=spacing,
        memory_bytes=10**9,
    )  # fmt: skip


def test_faces_that_elements_join_are_a_warning():
    # Sub-cells are a quarter of a brick: 0.15 mm here.
    assert joined_faces(able(0.6), two_boxes(0.2)) == ()
    (words,) = joined_faces(able(0.6), two_boxes(0.1))
    assert words.startswith("faces of the part are 0.1 mm apart at (10.05, ")
    assert "elements of 0.6 mm join them" in words
