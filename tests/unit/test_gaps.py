"""Gaps and thin walls of a part, and what is said where elements join faces."""

import numpy as np
import pytest
from small_parts import finned_block, prism

from gradedesign.design.printing.gaps import narrowest_gap, thin_walls
from gradedesign.design.resolve.analysable import Analysable
from gradedesign.design.resolve.analysable_lattice import joined_faces
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.explicit.finite_cells import FINITE_CELLS


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
    return prism(xy, [(4, 5, 6), (4, 6, 0), (4, 0, 1), (4, 1, 2), (2, 3, 4)], 10.0)


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


def test_fin_has_its_thickness_place_and_share():
    found = thin_walls(finned_block(0.4), 6.0)
    np.testing.assert_allclose(found.width, 0.4, rtol=1e-9)
    np.testing.assert_allclose(found.middle[0], 12.2, rtol=1e-9)
    assert found.middle[1].min() > 12.0
    # Two sides of 6 x 12 mm, but for 0.18 mm along three rims, where the rim is nearer than 0.9 of
    # half the thickness, of 2 x (288 + 2.4) + 84 x 12 mm^2.
    share = 2 * (6 - 0.18) * (12 - 0.36) / (2 * 290.4 + 84 * 12)
    assert found.width.size / found.rays == pytest.approx(share, rel=0.005)
    assert not thin_walls(finned_block(0.4), 0.39).width.size


@pytest.mark.parametrize(("angle", "found"), [(60.0, False), (45.0, False), (15.0, True)])
def test_edge_is_no_thin_wall_unless_it_is_acute(angle, found):
    wedge = prism([(0, 0), (8, 0), (8, 8 * np.tan(np.radians(angle)))], [(0, 1, 2)], 10.0)
    assert bool(thin_walls(wedge, 0.5).width.size) == found


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
