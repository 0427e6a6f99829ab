"""Percolation of periodic cells; a slow flood fill is the oracle of the kernel."""

import numpy as np
import pytest

from gradedesign.geometry.cell._percolation_kernels import (
    LARGEST,
    LARGEST_INDEX,
    SPANNING_TOTAL,
    flood,
    insert,
    lattice_index,
)
from gradedesign.geometry.cell.percolation import percolation
from gradedesign.geometry.cell.shape import grid_nodes

STEPS = [s * np.array([m & 1, (m >> 1) & 1, (m >> 2) & 1]) for s in (-1, 1) for m in range(1, 8)]


def slow_pieces(solid):
    """Pieces of a periodic set by breadth-first walks: (size, index of its windings)."""
    n = solid.shape[0]
    found = []
    cell = {}
    for start in map(tuple, np.argwhere(solid)):
        if start in cell:
            continue
        cell[start] = np.zeros(3, dtype=int)
        queue, windings = [start], []
        for node in queue:
            for step in STEPS:
                place = np.array(node) + step
                wrapped = tuple(int(i) for i in place % n)
                if not solid[wrapped]:
                    continue
                copy = cell[node] + place // n
                if wrapped in cell:
                    windings.append(copy - cell[wrapped])
                else:
                    cell[wrapped] = copy
                    queue.append(wrapped)
        vectors = np.unique(np.array(windings or [[0, 0, 0]]), axis=0)
        found.append((len(queue), slow_index(vectors)))
    return found


def slow_index(vectors):
    """Greatest common divisor of all 3x3 minors of integer vectors."""
    index = 0
    for i in range(len(vectors)):
        for j in range(i):
            for k in range(j):
                index = np.gcd(index, round(abs(np.linalg.det(vectors[[i, j, k]].astype(float)))))
    return int(index)


@pytest.mark.parametrize("seed", [11, 12, 13])
def test_flood_matches_breadth_first_walks(seed):
    n = 6
    rng = np.random.default_rng(seed)
    values = rng.random((n, n, n))
    order = np.argsort(values.ravel())
    history = np.zeros((n**3, 3), dtype=np.int64)
    flood(order, n, history)
    for step in range(4, n**3, 9):
        solid = values <= values.ravel()[order[step]]
        spanning = [p for p in slow_pieces(solid) if p[1] > 0]
        assert history[step, SPANNING_TOTAL] == sum(size for size, _ in spanning)
        assert history[step, LARGEST] == max((size for size, _ in spanning), default=0)
        if len(spanning) == 1:
            assert history[step, LARGEST_INDEX] == spanning[0][1]


def test_lattice_of_windings_has_the_index_of_its_minors():
    rng = np.random.default_rng(21)
    for _ in range(50):
        vectors = rng.integers(-3, 4, size=(4, 3))
        rows = np.zeros((3, 3), dtype=np.int32)
        for v in vectors:
            insert(rows, *v)
        assert lattice_index(rows) == slow_index(vectors)


def test_primitive_network_percolates_at_the_level_of_its_saddles():
    # cos X + cos Y + cos Z has its saddles at -1 and 1 (one or two cosines turned).
    found = percolation(np.cos(2 * np.pi * grid_nodes(24)).sum(axis=0))
    assert found.floor == pytest.approx(-1.0, abs=1e-12)
    assert found.ceiling == pytest.approx(1.0, abs=0.02)
    assert sorted(found.neck) == pytest.approx([0.0, 0.5, 0.5])


def test_separate_balls_and_plates_never_percolate():
    x, y, z = np.cos(2 * np.pi * grid_nodes(16))
    assert percolation(np.abs(x)) is None
    assert percolation(x + 0.01 * y * z) is None


def test_interpenetrating_lattices_have_an_index_above_one():
    n = 4
    values = np.ones((n, n, n))
    values[:, 0, 0] = values[0, :, 0] = values[0, 0, :] = 0.0
    history = np.zeros((n**3, 3), dtype=np.int64)
    flood(np.argsort(values.ravel(), kind="stable"), n, history)
    assert history[3 * n - 3, LARGEST_INDEX] == 1
    rows = np.zeros((3, 3), dtype=np.int32)
    for v in ((1, 1, 0), (1, -1, 0), (0, 0, 1)):
        insert(rows, *v)
    assert lattice_index(rows) == 2


def test_closed_pockets_and_loose_corners_end_the_window():
    # The solid lies outside a ball of radius -t. Below 1/2 the ball is a closed pocket, above
    # sqrt(1/2), half the diagonal of a face, it cuts the solid at the middle of the cell's edges.
    found = percolation(-np.linalg.norm(grid_nodes(24) - 0.5, axis=0))
    assert found.ceiling == pytest.approx(-0.5, abs=0.03)
    assert found.floor == pytest.approx(-np.sqrt(0.5), abs=0.03)
