"""A field of bounded slope, sampled near its surface only: the bricks of dense sampling."""

import numpy as np
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from gradedesign.arrays import LipschitzField
from gradedesign.design.loop.printed_stage import BAND
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles.printed_field import (
    field_within,
    printed_field,
    surface_search,
)
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.finite_cell.elements import cut_elements
from gradedesign.mechanics.finite_cell.grid import Grid
from gradedesign.mechanics.finite_cell.samples import classify

SUBCELLS = 4


def pieces(rng, ball=None):
    """A few turned boxes, thin ones among them, and bumpy balls in a cube of 4 mm: one surface."""
    vertices, faces, count = [], [], 0
    if ball is not None:
        mesh = trimesh.creation.icosphere(subdivisions=2, radius=0.8)
        vertices, faces, count = [mesh.vertices + ball], [mesh.faces], len(mesh.vertices)
    for _ in range(rng.integers(1, 4)):
        if rng.random() < 0.6:
            mesh = box_surface(tuple(rng.choice([0.05, 0.4, 1.5, 3.0], 3)))
            own = mesh.vertices - mesh.vertices.mean(axis=0)
        else:
            mesh = trimesh.creation.icosphere(subdivisions=2, radius=1.0)
            own = mesh.vertices * rng.uniform(0.4, 1.2, (len(mesh.vertices), 1))
        turn = trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3]
        vertices.append(own @ turn.T + rng.uniform(0.5, 3.5, 3))
        faces.append(mesh.faces + count)
        count += len(own)
    return SurfaceMesh(vertices=np.concatenate(vertices), faces=np.concatenate(faces))


def some_grid(rng):
    """A grid about that cube, its bricks no cubes; part of the surface may lie outside."""
    edges = rng.uniform(0.35, 0.9) * rng.uniform(0.7, 1.0, 3)
    shape = tuple(int(n) for n in np.ceil(rng.uniform(2.5, 5.0, 3) / edges))
    return Grid(lower=rng.uniform(-0.5, 0.5, 3), edges=edges, shape=shape)


def counting(field, points):
    """The same field, which notes how many points it was asked for."""

    def values(p):
        points.append(p[0].size)
        return field(p)

    return values


def assert_equal(found, dense, rounding=0.0):
    for mine, plain in zip(found, dense, strict=True):
        assert mine.dtype == plain.dtype
        np.testing.assert_allclose(mine, plain, rtol=0.0, atol=rounding)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**9), st.floats(0.4, 3.0))
def test_a_signed_distance_is_sampled_as_densely_as_its_surface_needs(seed, band):
    rng = np.random.default_rng(seed)
    grid = some_grid(rng)
    field = printed_field(pieces(rng), band * float(grid.edges.max()))
    dense = classify(field.values, grid, SUBCELLS)
    asked = []
    near = LipschitzField(values=counting(field, asked), constant=1.0)
    assert_equal(classify(near, grid, SUBCELLS), dense)
    bricks = int(np.prod(grid.shape))
    corners = int(np.prod(np.array(grid.shape) * SUBCELLS + 1))
    assert sum(asked) <= bricks + corners
    # Of wanted bricks, too; values around the others are not asked for in either way.
    wanted = rng.random(grid.shape) < 0.5
    _, *dense = classify(field.values, grid, SUBCELLS, wanted)
    _, *found = classify(near, grid, SUBCELLS, wanted)
    assert_equal(found, dense)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10**9))
def test_no_element_depends_on_distances_beyond_the_band_of_acceptance(seed):
    rng = np.random.default_rng(seed)
    grid = some_grid(rng)
    # a ball that is solid in some brick
    search = surface_search(pieces(rng, ball=0.5 * (grid.lower + grid.edges * grid.shape)))
    near, far = (
        cut_elements(field_within(search, band * float(grid.edges.max())), grid, bodies=1000)
        for band in (BAND, 3.0)
    )
    for name in ("position", "copy", "faces", "weights", "share", "centre"):
        np.testing.assert_array_equal(getattr(near, name), getattr(far, name))


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**9), st.floats(0.2, 5.0))
def test_any_slope_may_be_stated(seed, slope):
    # a wave of that slope at most along each direction, with kinks
    rng = np.random.default_rng(seed)
    grid = some_grid(rng)
    waves = rng.normal(size=(3, 3))
    waves *= rng.uniform(1.0, 3.0, (3, 1)) / np.linalg.norm(waves, axis=1, keepdims=True)
    share = rng.dirichlet(np.ones(3)) * slope / np.linalg.norm(waves, axis=1)
    level = slope * rng.uniform(0.0, 0.3)

    def values(p):
        phase = np.tensordot(waves, p, 1)
        return np.abs(np.tensordot(share, np.sin(phase), 1)) - level

    bounded = LipschitzField(values=values, constant=slope)
    # products and sines round by a point's place in its array: a few 2^-53 of phases below 30
    rounding = 100 * slope * 2.0**-53
    assert_equal(classify(bounded, grid, SUBCELLS), classify(values, grid, SUBCELLS), rounding)


def test_most_of_a_large_solid_is_not_sampled():
    # a cube of 8 x 8 x 8 mm in the middle of 12: bricks of 0.5 mm, of which 6 x 16^2 hold its faces
    box = box_surface((8.0, 8.0, 8.0))
    surface = SurfaceMesh(vertices=box.vertices + 2.1, faces=box.faces)
    grid = Grid(lower=(0, 0, 0), edges=(0.5, 0.5, 0.5), shape=(24, 24, 24))
    asked = []
    field = LipschitzField(values=counting(printed_field(surface, 1.0), asked), constant=1.0)
    _, whole, cut, _ = classify(field, grid, SUBCELLS)
    assert len(whole) == 15**3
    assert len(cut) == 17**3 - 15**3
    # Centres, and three layers of bricks about the faces with a corner beyond.
    assert sum(asked) < 24**3 + (4 * 18 + 3) ** 3 - (4 * 14 - 3) ** 3
