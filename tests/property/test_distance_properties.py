"""Distances on grids of any closed shape: slope, sign, and the same wherever it lies."""

import igl
import numpy as np
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from gradedesign.geometry.contour.sample import grid_points
from gradedesign.geometry.triangles.distance_grid import distance_grid
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

N, LOWER, SPACING = 24, np.full(3, -1.84), 0.16


@st.composite
def shapes(draw):
    """Balls with random bumps, stretched."""
    ball = trimesh.creation.icosphere(subdivisions=draw(st.integers(0, 2)))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    bumps = rng.uniform(draw(st.floats(0.3, 1.0)), 1.0, (len(ball.vertices), 1))
    return ball.vertices * bumps * rng.uniform(0.4, 1.4, 3), np.asarray(ball.faces, dtype=np.int64)


def distances(vertices, faces, lower=LOWER):
    surface = SurfaceMesh(vertices=vertices, faces=faces)
    return distance_grid(surface, lower, SPACING, (N, N, N))


@settings(max_examples=15, deadline=None)
@given(shapes())
def test_the_slope_is_at_most_one_and_signs_are_those_of_the_winding_number(shape):
    found = distances(*shape).astype(np.float64)
    for axis in range(3):
        step = np.abs(np.diff(found, axis=axis))
        ends = np.maximum(np.abs(found), np.roll(np.abs(found), -1, axis=axis))
        known = np.delete(ends, -1, axis=axis) < 3 * SPACING
        assert step[known].max() <= SPACING * (1 + 1e-5)
    points = grid_points(LOWER, (0, 0, 0), (N, N, N), SPACING).reshape(3, -1)
    winding = igl.winding_number(*shape, points.T.copy()).reshape(found.shape)
    assert np.array_equal(found < 0, winding > 0.5)


@settings(max_examples=10, deadline=None)
@given(
    shapes(),
    st.permutations([0, 1, 2]),
    st.tuples(*[st.sampled_from([-1.0, 1.0])] * 3),
    st.tuples(*[st.floats(-100.0, 100.0)] * 3),
)
def test_distances_move_with_the_shape(shape, axes, turn, shift):
    vertices, faces = shape
    here = distances(vertices, faces)
    moved = vertices[:, axes] * turn
    odd = np.prod(turn) * np.linalg.det(np.eye(3)[axes]) < 0  # a mirror image
    turned = faces[:, ::-1] if odd else faces
    # The grid is the same from both ends: -1.84 + 23 * 0.16 = 1.84.
    there = distances(moved + shift, turned, LOWER + shift)
    expected = here.transpose(axes)[tuple(slice(None, None, int(t)) for t in turn)]
    np.testing.assert_allclose(np.abs(there), np.abs(expected), atol=1e-5)
    clear = np.abs(expected) > 1e-4
    assert np.array_equal(there[clear] < 0, expected[clear] < 0)
