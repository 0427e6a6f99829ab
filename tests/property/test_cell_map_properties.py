"""Properties of cell maps, for any parameters."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from gradedesign.geometry.maps.cell_map import frame_along, uniform_map
from gradedesign.geometry.maps.cylindrical_map import cylindrical_map
from gradedesign.geometry.maps.map_report import map_report
from gradedesign.geometry.maps.phase_fields import graded_size_map
from gradedesign.geometry.maps.spherical_map import spherical_map
from gradedesign.geometry.maps.warp_map import MorphingSphere, warp_map

length = st.floats(1.0, 20.0)
direction = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda d: np.linalg.norm(d) > 0.1)
POINTS = np.random.default_rng(20274).uniform(-40.0, 40.0, (3, 200))


def regular(cell_map):
    return POINTS[:, ~cell_map.singular(POINTS)]


def assert_all(spread, value):
    assert abs(spread.least / value - 1) < 1e-9
    assert abs(spread.most / value - 1) < 1e-9


@settings(max_examples=25, deadline=None)
@given(axis=direction)
def test_frames_are_rotations(axis):
    frame = frame_along(axis)
    np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-12)
    assert np.linalg.det(frame) > 0
    np.testing.assert_allclose(frame[:, 2], np.array(axis) / np.linalg.norm(axis), atol=1e-12)


@settings(max_examples=25, deadline=None)
@given(around=st.integers(1, 60), sizes=st.tuples(length, length), radius=length, axis=direction)
def test_cells_about_an_axis_have_their_edges_and_right_angles(around, sizes, radius, axis):
    cell_map = cylindrical_map(
        around=around, radial_size=sizes[0], axial_size=sizes[1], inner_radius=radius, axis=axis
    )
    points = regular(cell_map)
    third = np.array(axis) / np.linalg.norm(axis)
    away = np.linalg.norm(points - np.outer(third, third @ points), axis=0)
    found = map_report(cell_map, points)
    assert_all(found.size_by_axis[0], sizes[0])
    assert_all(found.size_by_axis[2], sizes[1])
    assert abs(found.size_by_axis[1].most / (2 * np.pi * away.max() / around) - 1) < 1e-9
    assert found.shear.most < 1e-5
    assert found.folds == 0.0


@settings(max_examples=25, deadline=None)
@given(counts=st.tuples(st.integers(1, 60), st.integers(1, 30)), size=length, radius=length,
       cap=st.floats(1.0, 60.0), axis=direction)  # fmt: skip
def test_cells_about_a_centre_have_right_angles_and_never_fold(counts, size, radius, cap, axis):
    cell_map = spherical_map(
        around=counts[0], pole_to_pole=counts[1], radial_size=size, inner_radius=radius,
        polar_cap=cap, axis=axis,
    )  # fmt: skip
    found = map_report(cell_map, regular(cell_map))
    assert_all(found.size_by_axis[0], size)
    assert found.shear.most < 1e-5
    assert found.folds == 0.0


@settings(max_examples=25, deadline=None)
@given(magnification=st.floats(0.5, 10.0), stable=st.floats(1.0, 10.0), share=st.floats(2.2, 4.0))
def test_warped_space_never_folds_and_ends_at_the_sphere(magnification, stable, share):
    # At a magnification of 0.5 the outer radius must be 4 times the stable one; above 1, larger.
    outer = stable * share * (2.0 if magnification < 1 else 1.0)
    ball = MorphingSphere(
        centre=np.zeros(3), stable_radius=stable, outer_radius=outer, magnification=magnification
    )
    base = uniform_map(3.0)
    warped = warp_map(base, [ball])
    assert map_report(warped, POINTS).folds == 0.0
    beyond = POINTS[:, np.linalg.norm(POINTS, axis=0) >= outer]
    np.testing.assert_array_equal(warped(beyond), base(beyond))


@settings(max_examples=4, deadline=None)
@given(factor=st.floats(0.5, 3.0), shift=st.tuples(*[st.floats(-50, 50)] * 3))
def test_graded_map_scales_and_moves_with_its_part(factor, shift):
    move = np.array(shift)
    upper = np.array([40.0, 30.0, 20.0])

    def size_of(points):
        return 10.0 + 0.1 * points[0] - 0.05 * points[2]

    def moved_size(points):
        return factor * size_of((points - move.reshape(3, *[1] * (points.ndim - 1))) / factor)

    first = graded_size_map(size_of, np.zeros(3), upper, spacing=4.0)
    second = graded_size_map(moved_size, move, move + factor * upper, spacing=4.0 * factor)
    moved = move[:, None] + factor * POINTS
    np.testing.assert_allclose(second(moved), first(POINTS), atol=1e-7)
