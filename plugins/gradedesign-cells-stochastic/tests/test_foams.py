"""Voronoi and Delaunay foams; expected numbers are those of the Poisson-Voronoi tessellation.

Okabe, Boots, Sugihara & Chiu, Spatial Tessellations (2000), table 5.5.1, for one point per unit of
volume: 13.535 edges to a cell (96 pi^2 / 70), edges 5.832 long, faces of area 2.910.
"""

from itertools import product

import numpy as np
import pytest

from gradedesign_cells_stochastic.foams import delaunay, voronoi_closed, voronoi_open
from gradedesign_cells_stochastic.random_points import random_points
from gradedesign_cells_stochastic.tessellation import tessellation

SEEDS = [float(s) for s in range(20, 28)]
SHIFTS = 5.0 * np.array(list(product((-1, 0, 1), repeat=3)))


def copies(points):
    return (points + SHIFTS[:, None]).reshape(-1, 3)


def lengths(segments):
    return np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)


def slow_distance(segments, point):
    """Distance of one point to segments and their copies, one by one."""
    start = segments[:, 0] + SHIFTS[:, None]
    along = np.broadcast_to(segments[:, 1] - segments[:, 0], start.shape)
    share = ((point - start) * along).sum(-1) / (along * along).sum(-1)
    foot = start + np.clip(share, 0, 1)[..., None] * along
    return np.linalg.norm(foot - point, axis=-1).min()


@pytest.mark.parametrize("least", [0.0, 0.7])
def test_counts_obey_euler(least):
    # On a torus cells - faces + edges - vertices = 0, and four edges meet at every vertex, so that
    # there are half as many vertices as edges. Faces are as many as Delaunay edges.
    for seed in SEEDS[:3]:
        foam = tessellation(seed, 5, least)
        edges, faces = len(foam.voronoi_edges), len(foam.delaunay_edges)
        assert 125 - faces + edges - edges / 2 == 0
        assert sum(len(v) for v in foam.neighbours) == 2 * faces


def test_independent_points_give_the_known_means():
    # Scatter between windows, measured: 0.18 edges to a cell and 0.017 of length.
    foams = [tessellation(seed, 5, 0.0) for seed in SEEDS]
    edges = np.mean([len(f.voronoi_edges) / 125 for f in foams])
    total = np.mean([lengths(f.voronoi_edges).sum() / 125 for f in foams])
    assert edges == pytest.approx(96 * np.pi**2 / 70, abs=4 * 0.18 / 8**0.5)
    assert total == pytest.approx(5.832, abs=4 * 0.017 / 8**0.5)


def test_edges_are_as_far_from_three_seeds_and_no_nearer_to_any():
    foam = tessellation(20.0, 5, 0.7)
    seeds = copies(foam.seeds)
    for start, end in foam.voronoi_edges[:60]:
        middle = 0.5 * (start + end)
        away = np.sort(np.linalg.norm(seeds - middle, axis=1))
        assert away[2] == pytest.approx(away[0], abs=1e-9)


@pytest.mark.parametrize(
    ("shape", "edges"), [(voronoi_open, "voronoi_edges"), (delaunay, "delaunay_edges")]
)
def test_distances_are_those_of_a_slow_search(shape, edges):
    segments = getattr(tessellation(20.0, 5, 0.7), edges)
    points = np.random.default_rng(303).uniform(-6, 9, (3, 60))
    expected = [slow_distance(segments, p) for p in np.mod(points.T, 5)]
    np.testing.assert_allclose(shape(points, seed=20.0), expected, atol=1e-12)


@pytest.mark.parametrize("least", [0.0, 0.7])
def test_wall_distance_is_that_of_all_planes(least):
    # From a point in the cell of its nearest seed, the least distance to any plane midway.
    seeds = copies(random_points(20.0, 5, least))
    points = np.random.default_rng(304).uniform(-6, 9, (3, 300))
    expected = []
    for p in np.mod(points.T, 5):
        square = ((seeds - p) ** 2).sum(axis=1)
        own = seeds[square.argmin()]
        other = np.delete(seeds, square.argmin(), axis=0)
        rise = np.delete(square, square.argmin()) - square.min()
        expected.append((rise / (2 * np.linalg.norm(other - own, axis=1))).min())
    found = voronoi_closed(points, seed=20.0, least_distance=least)
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_thin_struts_and_walls_fill_their_length_and_area():
    # rho = pi t^2 L - O(t^3) and 2 t A - O(t^2); two levels cancel the next term. Edges shorter
    # than t, of which a foam has many, leave some per cent.
    step = 1.2207440846057596 ** -np.arange(1.0, 4.0)
    points = 5 * np.mod(0.3141 + step[:, None] * np.arange(400_000), 1.0)
    value = voronoi_open(points, seed=20.0)
    t = 0.02
    found = (8 * np.mean(value <= t) - np.mean(value <= 2 * t)) / (4 * np.pi * t**2)
    total = lengths(tessellation(20.0, 5, 0.7).voronoi_edges).sum() / 125
    assert found == pytest.approx(total, rel=0.05)
    rng = np.random.default_rng(307)
    area = []
    for seed in SEEDS[:6]:
        points = rng.uniform(0, 5, (3, 150_000))
        value = voronoi_closed(points, seed=seed, least_distance=0.0)
        area.append((4 * np.mean(value <= t) - np.mean(value <= 2 * t)) / (4 * t))
    # One window scatters by 0.04 with these samples.
    assert np.mean(area) == pytest.approx(2.910, abs=0.05)
