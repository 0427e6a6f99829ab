"""Boxes with whole-number corners, which touch and coincide often: counted cell by cell."""

from __future__ import annotations

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.ndimage import label
from scipy.spatial.transform import Rotation

from gradedesign.errors import PartError
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.repair import build_surface
from gradedesign.geometry.triangles.surface_mesh import area_vectors, corner_points, enclosed_volume

SIDE = 7


@st.composite
def boxes(draw, least, most):
    """Lower and upper corners of some boxes in a cube of seven cells."""
    count = draw(st.integers(least, most))
    corner = st.tuples(*[st.integers(0, SIDE - 1)] * 3)
    size = st.tuples(*[st.integers(1, 4)] * 3)
    lows = [np.array(draw(corner)) for _ in range(count)]
    return [(low, np.minimum(low + np.array(draw(size)), SIDE)) for low in lows]


def corners_of(low, high, *, reverse=False):
    corners = corner_points(box_surface(tuple((high - low).astype(float)))) + low
    return corners[:, ::-1] if reverse else corners


def cells(found) -> np.ndarray:
    """Which unit cells the boxes cover."""
    covered = np.zeros((SIDE + 3,) * 3, dtype=bool)
    for low, high in found:
        covered[tuple(slice(a, b) for a, b in zip(low, high, strict=True))] = True
    return covered


def answer(corners):
    try:
        surface, _ = build_surface(corners, bodies="all", source="boxes")
    except PartError as error:
        assert str(error).startswith("boxes")  # noqa: PT017 - both outcomes are right
        return None
    return enclosed_volume(surface)


@given(boxes(1, 4))
@settings(max_examples=100, deadline=None)
def test_outward_boxes_are_united(found):
    volume = answer(np.concatenate([corners_of(*box) for box in found]))
    if volume is not None:
        np.testing.assert_allclose(volume, cells(found).sum(), rtol=1e-9)


@given(boxes(1, 3))
@settings(max_examples=100, deadline=None)
def test_reversed_boxes_are_cut_out(found):
    """Of a larger box, all of whose faces some of them touch or reach through."""
    low, high = np.array([1, 1, 1]), np.array([6, 6, 6])
    shells = [corners_of(low, high), *(corners_of(*box, reverse=True) for box in found)]
    volume = answer(np.concatenate(shells))
    body = cells([(low, high)])
    left = (body & ~cells(found)).sum()
    outside = sum(not (body & cells([box])).any() for box in found)
    if volume is not None and not outside:
        np.testing.assert_allclose(volume, left, rtol=1e-9)


@given(boxes(1, 4), st.integers(0, 1 << 30), st.booleans())
@settings(max_examples=100, deadline=None)
def test_boxes_that_touch_are_joined_wherever_they_lie(found, seed, turned):
    """As single precision rounds them, off the axes: one body without a slit, or refused.

    Of four thousand files of up to five boxes within three cells, six of one body are refused, most
    of them where three boxes end in one face.
    """
    assume(len({(tuple(low), tuple(high)) for low, high in found}) == len(found))
    corners = np.concatenate([corners_of(*box) for box in found])
    if turned:
        corners = corners @ Rotation.random(random_state=seed).as_matrix().T
    corners = corners.astype(np.float32).astype(np.float64)
    covered = cells(found)
    pieces = label(covered)[1]  # cells with a face in common are connected
    try:
        surface, _ = build_surface(corners, bodies="join", source="boxes")
    except PartError as error:
        assert pieces > 1 or "separate solids" not in str(error)  # noqa: PT017 - may be refused
        return
    assert pieces == 1
    # Corners within 13 of the origin move by 2^-24 of that, and by three times as much once joined.
    np.testing.assert_allclose(enclosed_volume(surface), covered.sum(), rtol=1e-4)
    faces = sum(np.count_nonzero(np.diff(np.pad(covered, 1).astype(int), axis=k)) for k in range(3))
    area = np.linalg.norm(area_vectors(surface), axis=1).sum()
    np.testing.assert_allclose(area, faces, rtol=1e-4)
