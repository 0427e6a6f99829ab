"""Stuffing of any field gives a regular mesh, and moves with its grid."""

import itertools

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from gradedesign.mesh.stuffing import stuff
from gradedesign.mesh.tet_mesh import boundary_facets, signed_volumes


def waves(seed, finest):
    """Random sum of waves down to a length of ``finest``, trimmed to a ball of radius 4.

    It is -1 at (-0.3, -0.3, -0.3), a point of the lattice used below, so that there is a solid,
    though it may be finer than the lattice and vanish from its mesh.
    """
    rng = np.random.default_rng(seed)
    count = 12
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    wave = direction * (2 * np.pi / finest * rng.uniform(0.3, 1, (count, 1)))
    phase = rng.uniform(0, 2 * np.pi, count)
    offset = -1 - np.cos(wave @ np.full(3, -0.3) + phase).sum()

    def field(p):
        total = np.full(p.shape[1:], offset)
        for k, shift in zip(wave, phase, strict=True):
            total += np.cos(np.tensordot(k, p, axes=1) + shift)
        return np.maximum(total, np.linalg.norm(p, axis=0) - 4)

    return field


def least_and_most_angle(mesh):
    corners = mesh.points[:, mesh.tets]
    normals = []
    for f in ([1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]):
        a, b, c = (corners[:, k] for k in f)
        n = np.cross(b - a, c - a, axis=0)
        normals.append(n / np.linalg.norm(n, axis=0))
    cosine = np.array([-(p * q).sum(axis=0) for p, q in itertools.combinations(normals, 2)])
    angles = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    return angles.min(), angles.max()


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(3, 10**6), finest=st.floats(1.5, 12))
def test_any_field_gives_a_closed_regular_mesh(seed, finest):
    # waves down to 1.5 cubes are far finer than the lattice resolves: parts touch, walls break
    mesh = stuff(waves(seed, finest), (-4.3,) * 3, (9,) * 3, 1.0)
    assume(mesh.tets.size > 0)
    assert signed_volumes(mesh).min() > 0
    least, most = least_and_most_angle(mesh)
    assert least > 8
    assert most < 165
    facets, _ = boundary_facets(mesh)
    edges = np.sort(np.concatenate([facets[:, [0, 1]], facets[:, [1, 2]], facets[:, [2, 0]]]))
    assert np.all(np.unique(edges, axis=0, return_counts=True)[1] == 2)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(3, 10**6), scale=st.sampled_from([0.25, 8.0]))
def test_mesh_scales_and_moves_with_the_field(seed, scale):
    # powers of two and whole shifts, so that rounding is the same
    field = waves(seed, 6.0)
    move = np.array([16.0, -8.0, 4.0])

    def moved(p):
        return field((p - move.reshape(3, *[1] * (p.ndim - 1))) / scale)

    one = stuff(field, (-4.25,) * 3, (9,) * 3, 1.0)
    other = stuff(moved, move - 4.25 * scale, (9,) * 3, scale)
    assert one.tets.shape == other.tets.shape
    assert np.array_equal(one.tets, other.tets)
    np.testing.assert_allclose(one.points, (other.points - move[:, None]) / scale, atol=1e-9)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(3, 10**6))
def test_solid_and_void_fill_the_grid(seed):
    # both are meshed from the same cuts, so that their volumes sum to the ball's but for the
    # part of the surface that each chamfers
    field = waves(seed, 9.0)

    def ball(p):
        return np.linalg.norm(p, axis=0) - 4

    def void(p):
        return np.maximum(-field(p), ball(p))

    volumes = [
        signed_volumes(stuff(f, (-4.3,) * 3, (18,) * 3, 0.5)).sum() if inside(f) else 0.0
        for f in (field, void, ball)
    ]
    assert abs(volumes[0] + volumes[1] - volumes[2]) < 0.06 * volumes[2]


def inside(field):
    """Whether the field is negative at one of the lattice points used above."""
    grid = -4.3 + 0.5 * np.stack(np.meshgrid(*[np.arange(19)] * 3, indexing="ij"))
    return bool((field(grid) < 0).any() or (field(grid + 0.25) < 0).any())
