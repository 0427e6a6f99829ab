"""Blended joints: a fillet of a stated radius in mm, material only added, nothing beyond it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gradedesign.geometry.lattice.components.joint import Joint, blended


def plane(normal):
    normal = np.array(normal, dtype=np.float64)
    return lambda p: np.tensordot(normal, p, axes=1)


def wedge(angle):
    """Two half spaces whose outward normals are ``angle`` apart, both through the z axis."""
    return plane([1, 0, 0]), plane([np.cos(angle), np.sin(angle), 0])


def added_section(angle, radius, n=1400, factor=1.0):
    """Section that a joint adds between two half spaces, mm^2, counted on a fine grid."""
    cell, solid = wedge(angle)
    reach = 6.0 * radius
    axis = (np.arange(n) + 0.5) / n * 2 * reach - reach
    points = np.array(np.meshgrid(axis, axis, [0.0], indexing="ij")).reshape(3, -1)
    scaled = lambda p: factor * cell(p)  # noqa: E731  a cell's values are about mm only
    union = Joint(radius=radius).joined(points, (scaled(points), scaled), [(solid(points), solid)])
    plain = np.minimum(cell(points), solid(points))
    assert (union[plain < 0] < 0).all()
    return np.count_nonzero((union < 0) & (plain >= 0)) * (2 * reach / n) ** 2


@pytest.mark.parametrize("degrees", [30, 60, 90])
def test_corner_is_filled_by_a_rolling_ball(degrees):
    """Between a ball's arc and its two tangents: r^2 (tan(t/2) - t/2), t between the normals."""
    t, radius = np.radians(degrees), 1.5
    expected = radius**2 * (np.tan(t / 2) - t / 2)
    assert added_section(t, radius) == pytest.approx(expected, rel=0.02)
    if degrees == 90:
        assert expected == pytest.approx((1 - np.pi / 4) * radius**2)


def test_sharper_corner_is_filled_as_its_docstring_says():
    t, radius = np.radians(130), 1.5
    expected = radius**2 * (1 - np.pi / 4) / np.sin(t)
    assert added_section(t, radius) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("factor", [0.4, 3.0])
def test_radius_is_one_in_mm_whatever_the_scale_of_the_cell(factor):
    expected = (1 - np.pi / 4) * 1.5**2
    assert added_section(np.pi / 2, 1.5, factor=factor) == pytest.approx(expected, rel=0.02)


DISTANCE = st.floats(-3.0, 3.0)


@given(a=DISTANCE, b=DISTANCE, cosine=st.floats(-1.0, 1.0), radius=st.floats(0.05, 2.0))
def test_joint_only_adds_and_only_within_the_radius(a, b, cosine, radius):
    value = float(blended(np.array(a), np.array(b), np.array(cosine), radius))
    assert value <= min(a, b) + 1e-12
    assert value == pytest.approx(
        float(blended(np.array(b), np.array(a), np.array(cosine), radius))
    )
    if max(a, b) >= radius or (cosine == 1.0 and a == b):
        assert value == pytest.approx(min(a, b), abs=0.03 * radius)
    if max(a, b) >= radius:
        assert value == min(a, b)


@given(a=DISTANCE, b=DISTANCE, cosine=st.floats(-1.0, 1.0), step=st.floats(0.0, 1e-6))
def test_joint_is_continuous(a, b, cosine, step):
    """Steps of a distance move the union by about as much: to 1 / sqrt(1 - c^2) at c = 0.999."""
    c = np.array(cosine)
    before = blended(np.array(a), np.array(b), c, 1.0)
    after = blended(np.array(a + step), np.array(b), c, 1.0)
    assert abs(float(after - before)) <= 25 * step + 1e-12


def test_parallel_faces_are_left_alone():
    """A wall that lies in a skin, 0.2 mm below its face, does not thicken the skin."""
    skin, wall = plane([0, 0, 1]), (lambda p: p[2] + 0.2)
    points = np.random.default_rng(5).uniform(-1, 1, size=(3, 2000))
    union = Joint(radius=1.0).joined(points, (wall(points), wall), [(skin(points), skin)])
    np.testing.assert_array_equal(union < 0, points[2] < 0)
