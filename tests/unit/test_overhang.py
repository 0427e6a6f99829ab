"""Overhangs against shapes whose areas and support volumes are known."""

import numpy as np
import pytest

from gradedesign.design.printing.overhang import overhang
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

UP = np.array([0.0, 0.0, 1.0])


def test_a_box_overhangs_with_its_base_and_needs_no_support():
    found = overhang(box_surface((4.0, 2.0, 1.0)), UP, 40.0)
    assert found.fraction == pytest.approx(8 / 28)
    assert found.supported_area == found.support_volume == 0
    # On an edge no face is nearer than 45 degrees to the plate.
    assert found.least == 0
    assert found.most == pytest.approx(8 / 28)
    assert np.abs(found.worst).max() == pytest.approx(1)


def test_a_ball_overhangs_with_a_cap_whatever_the_direction():
    ball = extract_surface(lambda p: np.sqrt((p**2).sum(axis=0)) - 2.0, [-3] * 3, [3] * 3, 0.125)
    found = overhang(ball, UP, 40.0)
    cap = (1 - np.cos(np.radians(40))) / 2
    assert found.fraction == pytest.approx(cap, abs=4e-3)
    assert found.least == pytest.approx(cap, abs=8e-3)
    assert found.most == pytest.approx(cap, abs=8e-3)
    # Below the cap of radius 2 sin 40, between the ball and the plane at -2: a cylinder less the
    # cap's volume, by hand.
    a, h = 2 * np.sin(np.radians(40)), 2 * (1 - np.cos(np.radians(40)))
    volume = np.pi * a**2 * h - np.pi * h**2 * (3 * 2 - h) / 3
    assert found.support_volume == pytest.approx(volume, rel=0.03)


def test_support_stands_on_the_next_surface_below():
    """A slab of 4 x 2 mm, 3 mm above a base of half its length, 1 mm high."""
    slab, base = box_surface((4.0, 2.0, 1.0)), box_surface((2.0, 2.0, 1.0))
    both = SurfaceMesh(
        vertices=np.concatenate([slab.vertices + np.array([0, 0, 4.0]), base.vertices]),
        faces=np.concatenate([slab.faces, base.faces + len(slab.vertices)]),
    )
    found = overhang(both, UP, 40.0)
    assert found.supported_area == pytest.approx(8)
    assert found.support_volume == pytest.approx(2 * 2 * 3 + 2 * 2 * 4, rel=0.01)
