"""Surfaces must be closed manifolds of the right volume whatever the field does."""

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
from oracles.marching_by_cube import triangles_by_cube, triangles_by_place
from scipy.ndimage import map_coordinates

from gradedesign.errors import LatticeError
from gradedesign.geometry.contour import _marching_table as table
from gradedesign.geometry.contour._marching_kernels import _EDGE_AXIS, _EDGE_BASE
from gradedesign.geometry.contour._side_kernels import BESIDE, BEYOND, DEEP, NEAR, take_out_edges
from gradedesign.geometry.contour._surface_kernels import (
    shell_volumes,
    unpaired_edges,
    vertex_shells,
)
from gradedesign.geometry.contour.surface import (
    END_GAP,
    BoxedGrid,
    boxed_grid,
    contour,
    extract_surface,
    require_closed,
)
from gradedesign.geometry.triangles.surface_mesh import (
    SurfaceMesh,
    area_vectors,
    enclosed_volume,
    open_edge_count,
)


def gyroid(points, cell=1.0):
    x, y, z = 2 * np.pi * np.asarray(points) / cell
    return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)


def sheet(points):
    return (np.abs(gyroid(points)) - 0.55) / (3 * np.pi)


def vertex_fans_are_single(surface):
    """Every vertex is met by one closed fan of triangles (slow, an oracle)."""
    links = {}
    for a, b, c in surface.faces:
        for v, p, q in ((a, b, c), (b, c, a), (c, a, b)):
            links.setdefault(v, {})[p] = q
    for follow in links.values():
        start = next(iter(follow))
        at, steps = follow[start], 1
        while at != start:
            at, steps = follow[at], steps + 1
        if steps != len(follow):
            return False
    return True


def test_table_joins_crossings_of_common_faces_only():
    """Contour loops run through cube faces; each sign change of the cube is met once."""
    for case in range(256):
        loops = table.contour_loops(case)
        crossings = [
            e
            for e, (axis, base) in enumerate(table.EDGES)
            if (case >> table.corner_number(base) & 1)
            != (case >> (table.corner_number(base) + (1, 2, 4)[axis]) & 1)
        ]
        assert sorted(e for loop in loops for e in loop) == crossings
        for loop in loops:
            for a, b in pairwise([*loop, loop[0]]):
                assert any(a in f and b in f for f in table._FACE_EDGES)


def test_table_has_no_diagonal_in_a_cube_face():
    """Which would let four triangles of two cubes share an edge."""
    triangles, counts = table.marching_table()
    assert counts.max() == 5
    for case in range(256):
        contour = {frozenset(p) for r in table._RINGS for p in table.face_segments(case, r)}
        for t in triangles[case, : counts[case]]:
            for a, b in pairwise([*t, t[0]]):
                in_face = any(a in f and b in f for f in table._FACE_EDGES)
                assert not in_face or frozenset((int(a), int(b))) in contour


def test_kernel_numbers_edges_as_the_table():
    assert [(int(a), tuple(map(int, b))) for a, b in zip(_EDGE_AXIS, _EDGE_BASE, strict=True)] == [
        *table.EDGES
    ]


@pytest.mark.parametrize("seed", [7, 23, 101])
def test_noise_gives_a_closed_manifold(seed):
    """White noise at the nodes meets all 256 cases, in slabs that do not divide the grid."""
    noise = np.random.default_rng(seed).normal(size=(16, 16, 16))
    surface = extract_surface(
        lambda p: map_coordinates(noise, p, order=0), [0, 0, 0], [15, 15, 15], 1.0, nodes=700
    )
    assert open_edge_count(surface) == 0
    assert unpaired_edges(surface.faces, len(surface.vertices)) == (0, 0)
    assert vertex_fans_are_single(surface)
    assert np.linalg.norm(area_vectors(surface), axis=1).min() > 0


def test_values_of_exactly_zero_stay_closed():
    """A field of -1, 0 and 1 only: planes, edges and corners lie on nodes."""
    noise = np.random.default_rng(5).integers(-1, 2, size=(12, 12, 12)).astype(float)
    surface = extract_surface(
        lambda p: map_coordinates(noise, p - 0.5, order=0, mode="nearest"),
        [0, 0, 0], [12, 12, 12], 1.0, nodes=500,
    )  # fmt: skip
    assert open_edge_count(surface) == 0
    assert vertex_fans_are_single(surface)
    assert np.linalg.norm(area_vectors(surface), axis=1).min() > 0


def test_sphere_has_its_volume_and_lies_on_it():
    """4/3 pi r^3; an inscribed facet of size h stays h^2 / 8r within the sphere."""
    h, r = 0.1, 1.0
    surface = extract_surface(lambda p: np.linalg.norm(p, axis=0) - r, [-2] * 3, [2] * 3, h)
    away = np.linalg.norm(surface.vertices, axis=1) - r
    assert np.abs(away).max() < 3e-3 * h
    assert enclosed_volume(surface) == pytest.approx(4 / 3 * np.pi, rel=6e-3)
    outward = np.einsum("ij,ij->i", area_vectors(surface), surface.vertices[surface.faces[:, 0]])
    assert (outward > 0).all()


def test_secant_finds_the_zero_of_a_field_that_is_no_distance():
    """r^3 - 1: linear interpolation alone is off by about 10 times as much."""
    surface = extract_surface(
        lambda p: np.linalg.norm(p, axis=0) ** 3 - 1, [-1.5] * 3, [1.5] * 3, 0.2
    )
    away = np.abs(np.linalg.norm(surface.vertices, axis=1) - 1)
    assert away.max() < 2e-3  # linear interpolation: 1.4e-2


def test_volume_fraction_of_a_gyroid_sheet():
    """Two cells: within 0.5 % of the field's own, counted at 80^3 midpoints per cell."""
    axis = (np.arange(80) + 0.5) / 80
    field = np.count_nonzero(sheet(np.array(np.meshgrid(axis, axis, axis))) < 0) / 80**3
    surface = extract_surface(sheet, [0] * 3, [2] * 3, 1 / 40)
    assert enclosed_volume(surface) / 8 == pytest.approx(field, rel=5e-3)


def test_solid_box_is_closed_at_its_faces():
    """A field that is negative everywhere fills the box; edges are chamfered by h/2."""
    h = 0.1
    surface = extract_surface(lambda p: -np.ones(p.shape[1:]), [0] * 3, [1, 2, 3], h)
    np.testing.assert_allclose(surface.vertices.min(axis=0), 0, atol=1e-12)
    np.testing.assert_allclose(surface.vertices.max(axis=0), [1, 2, 3], atol=1e-12)
    lost = 4 * (1 + 2 + 3) * h**2 / 8  # 12 chamfers of two legs h/2
    assert enclosed_volume(surface) == pytest.approx(6 - lost, abs=0.2 * lost)


def test_slabs_do_not_change_the_surface():
    a, b = (extract_surface(sheet, [0] * 3, [1] * 3, 1 / 16, nodes=n) for n in (3, 1 << 20))
    np.testing.assert_allclose(a.vertices, b.vertices, rtol=0, atol=1e-12)
    assert Counter(map(tuple, np.sort(a.faces, axis=1).tolist())) == Counter(
        map(tuple, np.sort(b.faces, axis=1).tolist())
    )


def test_vertices_keep_away_from_nodes():
    h = 0.25
    surface = extract_surface(sheet, [0] * 3, [1] * 3, h)
    steps = (surface.vertices + 0.5 * h) / h
    gap = np.abs(steps - np.round(steps)).max(axis=1)
    assert gap.min() > 0.99 * END_GAP


def test_unpaired_edges_counts_faults():
    """A tetrahedron; one triangle missing, flipped, doubled."""
    vertices = np.vstack([np.zeros(3), np.eye(3)])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    assert unpaired_edges(faces, 4) == (0, 0)
    assert unpaired_edges(faces[:3], 4) == (3, 0)
    assert unpaired_edges(np.vstack([faces[:3], faces[3:, ::-1]]), 4) == (3, 0)
    assert unpaired_edges(np.vstack([faces, faces[3:]]), 4) == (0, 3)
    with pytest.raises(LatticeError, match="3 open or misoriented edges"):
        require_closed(SurfaceMesh(vertices=vertices, faces=faces[:3]))
    with pytest.raises(LatticeError, match="expected a positive volume"):
        require_closed(SurfaceMesh(vertices=vertices, faces=faces[:, ::-1]))


def test_field_without_solid_is_refused():
    with pytest.raises(LatticeError, match="no solid"):
        extract_surface(lambda p: np.ones(p.shape[1:]), [0] * 3, [1] * 3, 0.2)


def test_empty_box_is_refused():
    with pytest.raises(LatticeError, match="is empty"):
        extract_surface(sheet, [0] * 3, [1, 1, 0], 0.2)


def test_shell_volumes_equal_the_plain_sum():
    ball = extract_surface(lambda p: np.sqrt((p**2).sum(axis=0)) - 1.0, [-2] * 3, [2] * 3, 0.25)
    shells = np.zeros(len(ball.vertices), dtype=np.int64)
    volume = shell_volumes(ball.vertices, ball.faces, shells, 1)[0]
    assert volume == pytest.approx(enclosed_volume(ball), rel=1e-12)


def test_inside_corners_of_an_ambiguous_face_are_joined():
    """Two inside nodes diagonal on one face: one shell; on a space diagonal: two."""

    def shells(*inside):
        nodes = np.ones((5, 5, 5))
        for node in inside:
            nodes[node] = -1.0
        surface = extract_surface(
            lambda p: map_coordinates(nodes, p + 0.5, order=0), [0] * 3, [3] * 3, 1.0
        )
        assert open_edge_count(surface) == 0
        return vertex_shells(surface.faces, len(surface.vertices)).max() + 1

    assert shells((2, 2, 2), (3, 3, 2)) == 1
    assert shells((2, 2, 2), (3, 3, 3)) == 2


def test_rounding_on_a_plane_of_nodes_leaves_no_fragments():
    """Half space x < 1 with nodes on x = 1, whose values are rounding of either sign."""
    rng = np.random.default_rng(29)

    def field(noise):
        return lambda p: p[0] - 1.0 + noise * rng.choice([-1.0, 1.0], size=p.shape[1:])

    box = ([-0.25, 0, 0], [2, 2, 2], 0.5)
    exact, noisy = extract_surface(field(0.0), *box), extract_surface(field(1e-14), *box)
    assert len(noisy.faces) == len(exact.faces)
    np.testing.assert_allclose(noisy.vertices, exact.vertices, atol=1e-12)


@pytest.mark.parametrize("seed", [7, 23])
def test_triangles_are_those_of_every_cube_alone(seed):
    """White noise at the nodes: the slow loop over cubes finds the same triangles."""
    noise = np.random.default_rng(seed).normal(size=(8, 9, 7))
    grid = BoxedGrid(lower=np.full(3, -99.5), upper=np.full(3, 200.0), shape=noise.shape, h=1.0)

    def field(points):
        return map_coordinates(noise, points + 100, order=0)

    found = contour(field, grid, nodes=130)
    noise[0], noise[:, 0], noise[:, :, 0] = 0.5, 0.5, 0.5  # outside the box
    expected = triangles_by_cube(noise)
    assert triangles_by_place(found.vertices, found.near, grid.origin, 1.0) == expected


@pytest.mark.parametrize("seed", [7, 23, 101])
def test_caps_close_what_lies_in_near_cubes(seed):
    """White noise and arbitrary sides: all triangles close, the near ones close with the caps."""
    rng = np.random.default_rng(seed)
    noise = rng.normal(size=(16, 16, 16)) - 0.3
    sides = rng.choice(np.array([NEAR, DEEP, BESIDE], dtype=np.uint8), size=(16, 16, 16))

    def made(sides):
        return contour(
            lambda p: map_coordinates(noise, p, order=0),
            boxed_grid([0] * 3, [15] * 3, 1.0),
            sides=sides,
            nodes=700,
        )

    while take_out_edges(sides):
        pass
    found = made(sides)
    n = len(found.vertices)
    caps = np.concatenate([found.inner, found.outer])
    assert min(map(len, (found.deep, found.near, found.inner, found.outer))) > 100
    assert unpaired_edges(np.concatenate([found.near, caps]), n) == (0, 0)
    alone = SurfaceMesh(vertices=found.vertices, faces=np.concatenate([found.near, caps]))
    assert enclosed_volume(alone) > 0
    assert np.linalg.norm(area_vectors(alone), axis=1).min() > 0
    # What lies beside counts as deep: the same triangles and caps, and nothing is left out.
    both = made(np.where(sides == BESIDE, DEEP, sides).astype(np.uint8))
    assert len(both.near) == len(found.near)
    assert len(both.inner) == len(caps)
    assert len(both.outer) == 0
    n = len(both.vertices)
    assert unpaired_edges(np.concatenate([both.deep, both.near]), n) == (0, 0)
    whole = SurfaceMesh(vertices=both.vertices, faces=np.concatenate([both.deep, both.near]))
    inner = SurfaceMesh(
        vertices=both.vertices, faces=np.concatenate([both.deep, both.inner[:, ::-1]])
    )
    assert enclosed_volume(inner) > 0
    assert enclosed_volume(alone) + enclosed_volume(inner) == pytest.approx(enclosed_volume(whole))
    # Cubes beyond hold no triangle, and leave the others as they are.
    less = made(np.where(sides == BESIDE, BEYOND, sides).astype(np.uint8))
    assert (len(less.near), len(less.deep)) == (len(found.near), len(found.deep))
    assert len(less.outer) == len(found.outer)
