"""Isosurface stuffing: exact where it can be, regular everywhere, equal to a slow version."""

import itertools

import numba
import numpy as np
import pytest

from gradedesign.errors import MeshError, ResourceError
from gradedesign.mesh._stuffing_pinches import EDGES, TRIANGLES, separate_pinches
from gradedesign.mesh._stuffing_tets_kernels import orient, split_prism
from gradedesign.mesh.stuffing import stuff
from gradedesign.mesh.tet_mesh import TetMesh, boundary_facets, signed_volumes


def sphere(p, radius=1.0):
    return np.sqrt((p**2).sum(axis=0)) - radius


def gyroid_sheet(p, level=0.55):
    x, y, z = 2 * np.pi * p
    f = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    return np.abs(f) - level


def dihedral_angles(mesh):
    """All six angles of every tetrahedron, degrees, (6, m)."""
    corners = mesh.points[:, mesh.tets]
    normals = []
    for f in ([1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]):
        a, b, c = (corners[:, k] for k in f)
        n = np.cross(b - a, c - a, axis=0)
        normals.append(n / np.linalg.norm(n, axis=0))
    cosines = [-(p * q).sum(axis=0) for p, q in itertools.combinations(normals, 2)]
    return np.degrees(np.arccos(np.clip(cosines, -1, 1)))


def edge_counts(facets):
    edges = np.sort(np.concatenate([facets[:, [0, 1]], facets[:, [1, 2]], facets[:, [2, 0]]]))
    return np.unique(edges, axis=0, return_counts=True)[1]


def assert_regular(mesh):
    assert signed_volumes(mesh).min() > 0
    facets, _ = boundary_facets(mesh)
    assert np.all(edge_counts(facets) == 2)
    angles = dihedral_angles(mesh)
    assert angles.min() > 10
    assert angles.max() < 165
    assert np.array_equal(np.unique(mesh.tets), np.arange(mesh.points.shape[1]))


@pytest.mark.parametrize("slack", [0, 2])
def test_box_on_grid_planes_is_exact(slack):
    # 3.5 * 2.0 * 1.5 mm^3 by hand; planes on the grid though 0.1 is not a binary fraction
    size = np.array([3.5, 2.0, 1.5]) * 0.1
    lower = np.array([0.7, -0.3, 0.1])

    def box(p):
        q = p - (lower + size / 2).reshape(3, *[1] * (p.ndim - 1))
        return np.max(np.abs(q) - (size / 2).reshape(3, *[1] * (p.ndim - 1)), axis=0)

    h = 0.05
    mesh = stuff(box, lower - slack * h, tuple(np.rint(size / h).astype(int) + 2 * slack), h)
    assert_regular(mesh)
    assert signed_volumes(mesh).sum() == pytest.approx(size.prod(), rel=1e-12)
    facets, _ = boundary_facets(mesh)
    centres = mesh.points[:, facets].mean(axis=2)
    assert np.abs(box(centres)).max() < 1e-12


def test_sphere_volume_converges_with_the_second_order():
    # exact 4/3 pi; chords of a circle lose h^2
    exact = 4 / 3 * np.pi
    errors = []
    for n in (12, 24):
        mesh = stuff(sphere, (-1.013, -1.021, -1.007), (n,) * 3, 2.05 / n)
        assert_regular(mesh)
        errors.append(1 - signed_volumes(mesh).sum() / exact)
    assert 0 < errors[1] < errors[0] < 0.03
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.3)


def test_refined_cuts_lie_on_a_curved_field():
    def cubed(p):
        return sphere(p) * (1 + sphere(p)) ** 2

    worst = []
    for refine in (0, 1, 2, 3):
        mesh = stuff(cubed, (-1.1,) * 3, (11,) * 3, 0.2, refine=refine)
        facets, _ = boundary_facets(mesh)
        worst.append(np.abs(sphere(mesh.points[:, np.unique(facets)])).max())
    assert worst[1] < worst[0] / 2
    assert worst[2] < worst[1] / 2
    assert worst[3] < worst[2] / 2


def test_gyroid_sheet_keeps_its_volume():
    # fraction of a 120^3 sample of one period, 0.35633; 2 mesh sizes for the trend
    u = (np.stack(np.meshgrid(*[np.arange(120)] * 3, indexing="ij")) + 0.5) / 120
    exact = float((gyroid_sheet(u) < 0).mean())

    def trimmed(p):
        return np.maximum(gyroid_sheet(p) / 6, np.abs(p - 0.75).max(axis=0) - 0.75)

    mesh = stuff(trimmed, (0, 0, 0), (30,) * 3, 1 / 20)
    assert_regular(mesh)
    assert dihedral_angles(mesh).min() > 15
    assert signed_volumes(mesh).sum() / 1.5**3 == pytest.approx(exact, rel=0.02)


def test_same_mesh_for_any_number_of_threads():
    def field(p):
        return np.maximum(gyroid_sheet(p * 0.7), sphere(p - 0.5, 0.9))

    threads = numba.get_num_threads()
    meshes = []
    for count in (1, threads):
        numba.set_num_threads(count)
        meshes.append(stuff(field, (-0.5,) * 3, (20,) * 3, 0.1))
    assert np.array_equal(meshes[0].tets, meshes[1].tets)
    assert np.array_equal(meshes[0].points, meshes[1].points)


def test_field_sees_small_bricks_and_every_point_once():
    sizes, seen = [], []

    def field(p):
        sizes.append(p[0].size)
        seen.append(p.reshape(3, -1))
        return sphere(p)

    stuff(field, (-1.1,) * 3, (11,) * 3, 0.2, brick=5, refine=0)
    assert max(sizes) == 5**3
    points = np.concatenate(seen, axis=1)
    # 14^3 corners and 13^3 centres: 11 cubes and one more layer on every side
    assert points.shape[1] == 14**3 + 13**3
    assert len(np.unique(np.round(points.T, 9), axis=0)) == points.shape[1]
    stuff(field, (-1.1,) * 3, (11,) * 3, 0.2, brick=5, refine=1)
    assert max(sizes) == 5**3


@pytest.mark.parametrize(
    ("field", "shape", "message"),
    [
        (lambda p: sphere(p) + 5, (11, 11, 11), "no solid in the grid: its least value is 4"),
        (sphere, (11, 11, 6), "reaches out of the stuffing grid"),
        (lambda p: np.where(p[0] > 0.5, np.nan, sphere(p)), (11, 11, 11), "not finite at"),
        (lambda p: sphere(p)[..., None], (11, 11, 11), "expected"),
        (sphere, (11, 0, 11), "positive h"),
    ],
)
def test_refuses_what_cannot_be_meshed(field, shape, message):
    with pytest.raises(MeshError, match=message):
        stuff(field, (-1.1,) * 3, shape, 0.2)


def test_refuses_surface_close_to_the_outermost_layer():
    # a flat face 0.45 h beyond the grid: a centre 0.05 h outside it would have to move
    with pytest.raises(MeshError, match="passes close to"):
        stuff(lambda p: np.abs(p).max(axis=0) - 1.09, (-1.0,) * 3, (11, 11, 11), 0.2)


def test_refuses_a_grid_beyond_the_index_range():
    with pytest.raises(ResourceError, match="larger h"):
        stuff(sphere, (0, 0, 0), (2000, 2000, 2000), 0.1)


@pytest.mark.parametrize("diagonal", list(itertools.product([False, True], repeat=3)))
def test_prism_is_filled_for_every_choice_of_diagonals(diagonal):
    # a prism with parallel triangles of area 2 and 0.5, 3 high: (A + B + sqrt(A B)) h / 3 = 3.5
    base = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0.0]])
    points = np.concatenate([base, base / 2 + [0.2, 0.1, 3], np.zeros((1, 3))])
    tets = np.zeros((8, 4), dtype=np.int64)
    n, extra = split_prism(np.arange(3), np.arange(3, 6), np.array(diagonal), tets, 0, points, 6)
    least = orient(tets, 0, n, points)
    cyclic = len(set(diagonal)) == 1
    assert (n, extra) == ((8, 7) if cyclic else (3, 6))
    mesh = TetMesh(points=points.T, tets=tets[:n].T)
    assert signed_volumes(mesh).sum() == pytest.approx(3.5)
    assert signed_volumes(mesh).min() == pytest.approx(least / 6)
    facets, _ = boundary_facets(mesh)
    assert len(facets) == 8
    sides = {frozenset(f.tolist()) for f in facets}
    for q in range(3):
        r = (q + 1) % 3
        ends = (q, 3 + r) if diagonal[q] else (r, 3 + q)
        assert sum(set(ends) <= side for side in sides) == 2


def test_table_of_the_lattice_around_a_point():
    # the vertex figure of the lattice is a rhombic dodecahedron with split faces
    assert TRIANGLES.shape == (24, 3)
    assert EDGES.shape == (36, 4)
    assert np.all(np.bincount(TRIANGLES.ravel()) == [4] * 6 + [6] * 8)


def cubes_mesh(cells):
    """Unit cubes at integer places, each of six tetrahedra that share its long diagonal."""
    key, points, tets = {}, [], []
    for cell in cells:
        for order in itertools.permutations(range(3)):
            corner = np.array(cell)
            path = [tuple(corner)]
            for axis in order:
                corner = corner + np.eye(3, dtype=int)[axis]
                path.append(tuple(corner))
            for p in path:
                if p not in key:
                    key[p] = len(points)
                    points.append(p)
            tets.append([key[p] for p in path])
    return np.array(points, dtype=float), np.array(tets)


@pytest.mark.parametrize(
    ("cells", "added", "more"),
    [
        ([(0, 0, 0), (1, 1, 1)], 1, 0),  # touch in a corner: one twin
        ([(0, 0, 0), (1, 1, 0)], 2, 0),  # touch along an edge: two twins
        # a ring of cubes that meets itself along the edge at (1, 1): an edge, split in two halves
        ([(0, 0, 0), (1, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1)], None, None),
    ],
)
def test_touching_parts_are_separated(cells, added, more):
    points, tets = cubes_mesh(cells)
    new_points, new_tets = separate_pinches(points, tets, np.arange(len(points)))
    mesh = TetMesh(points=new_points.T, tets=new_tets.T)
    assert np.abs(signed_volumes(mesh)).sum() == pytest.approx(len(cells))
    facets, _ = boundary_facets(mesh)
    assert np.all(edge_counts(facets) == 2)
    if added is not None:
        assert len(new_points) - len(points) == added
        assert len(new_tets) - len(tets) == more


NEIGHBOURS = [s * np.eye(3, dtype=int)[a] * 2 for a in range(3) for s in (-1, 1)] + [
    np.array(d) for d in itertools.product([-1, 1], repeat=3)
]


def slow_vertices(field, lower, n, h):
    """Vertices of the stuffing by the text of the paper, one lattice point at a time."""
    corners = itertools.product(range(-2, 2 * n + 3, 2), repeat=3)
    centres = itertools.product(range(-1, 2 * n + 2, 2), repeat=3)
    place = {p: np.array(lower) + h / 2 * np.array(p) for p in (*corners, *centres)}
    value = {p: float(field(x)) for p, x in place.items()}
    start = dict(value)

    def beside(p):
        return [q for q in (tuple(np.array(p) + d) for d in NEIGHBOURS) if q in place]

    def kind(p):
        return (p[0] % 2, sum(x // 2 for x in p) % 2)

    lattice = dict(place)
    for p in sorted(place, key=kind):
        best = None
        for q in beside(p):
            if value[p] * value[q] < 0:
                length = np.linalg.norm(lattice[q] - lattice[p])
                part = start[p] / (start[p] - start[q])
                alpha = 0.24999 if np.isclose(length, h) else 0.41189
                if part < alpha and (best is None or part * length < best[0]):
                    best = (part * length, lattice[p] + part * (lattice[q] - lattice[p]))
        if best is not None:
            place[p], value[p] = best[1], 0.0
    found = []
    for p in place:
        near = beside(p)
        if value[p] < 0 or (value[p] == 0 and any(value[q] < 0 for q in near)):
            found.append(place[p])
        if value[p] < 0:
            for q in near:
                if value[q] > 0:
                    part = start[p] / (start[p] - start[q])
                    found.append(lattice[p] + part * (lattice[q] - lattice[p]))
    return np.array(found)


def test_vertices_equal_the_slow_version():
    def field(p):
        return p[0] ** 2 + 1.3 * p[1] ** 2 + 0.8 * p[2] ** 2 + 0.3 * np.sin(4 * p[0]) * p[1] - 0.9

    lower, n, h = (-1.15, -1.05, -1.25), 6, 0.4
    expected = slow_vertices(field, lower, n, h)
    mesh = stuff(field, lower, (n,) * 3, h, refine=0)
    assert mesh.points.shape[1] == len(expected)

    def order(p):
        return p[np.lexsort(np.round(p, 9).T)]

    np.testing.assert_allclose(order(mesh.points.T), order(expected), atol=1e-9)
