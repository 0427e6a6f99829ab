"""Surfaces must be closed manifolds of the right volume whatever the field does."""

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
from oracles.marching_by_cube import triangles_by_cube, triangles_by_place
from scipy.ndimage import map_coordinates

from gradedesign.errors import LatticeError
from gradedesign.lattice import _marching_table as table
from gradedesign.lattice._marching_kernels import _EDGE_AXIS, _EDGE_BASE
from gradedesign.lattice._side_kernels import BESIDE, BEYOND, DEEP, NEAR, take_out_edges
from gradedesign.lattice._surface_kernels import shell_volumes, unpaired_edges, vertex_shells
from gradedesign.lattice.surface import (
    END_GAP,
    BoxedGrid,
    boxed_grid,
    contour,
    extract_surface,
    require_closed,
)
from gradedesign.mesh.surface_mesh import (
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
