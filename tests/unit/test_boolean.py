"""Intersection of closed surfaces."""

import pytest

from gradedesign import MeshError
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles.boolean import intersection
from gradedesign.geometry.triangles.surface_mesh import (
    SurfaceMesh,
    enclosed_volume,
    open_edge_count,
)

BOX = box_surface((6.0, 4.0, 4.0))


def _moved(surface, by):
    return SurfaceMesh(vertices=surface.vertices + by, faces=surface.faces)


def test_common_volume_of_two_boxes():
    """Moved by (2, 1, 1) mm, two 6 x 4 x 4 boxes share 4 x 3 x 3 mm^3."""
    common = intersection(BOX, _moved(BOX, (2.0, 1.0, 1.0)), subject="test")
    assert open_edge_count(common) == 0
    assert enclosed_volume(common) == pytest.approx(36.0, rel=1e-12)


def test_an_open_surface_is_refused():
    broken = SurfaceMesh(vertices=BOX.vertices, faces=BOX.faces[1:])
    with pytest.raises(MeshError, match="closed and manifold"):
        intersection(BOX, broken, subject="test")


def test_nothing_in_common_is_an_error():
    with pytest.raises(MeshError, match="no material in common"):
        intersection(BOX, _moved(BOX, (100.0, 0.0, 0.0)), subject="test")
