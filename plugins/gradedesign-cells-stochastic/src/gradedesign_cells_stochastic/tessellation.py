"""The Delaunay tetrahedra of periodic points, and their dual Voronoi cells."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from gradedesign.fields import FloatArray
from gradedesign_cells_stochastic.random_points import random_points


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tessellation:
    """Voronoi cells and Delaunay tetrahedra of points of a periodic window.

    Attributes
    ----------
    period : int, cells
    seeds : (n, 3) array, cell units
        The points, in the window.
    delaunay_edges : (m, 2, 3) array, cell units
        Each once.
    voronoi_edges : (k, 2, 3) array, cell units
        Each once.
    neighbours : tuple of n (., 3) arrays, cell units
        From each seed to those whose Voronoi cells share a face with its own.
    """

    period: int
    seeds: FloatArray
    delaunay_edges: FloatArray
    voronoi_edges: FloatArray
    neighbours: tuple[FloatArray, ...]

    def __post_init__(self) -> None:
        for array in (self.seeds, self.delaunay_edges, self.voronoi_edges, *self.neighbours):
            array.flags.writeable = False


@lru_cache(maxsize=16)
def tessellation(seed: float, period: int, least_distance: float) -> Tessellation:
    """Tessellate `random_points` of the same arguments.

    A Voronoi edge joins the centres of the spheres about two tetrahedra that share a triangle. The
    tetrahedra are those of the window with its 26 copies; of an edge, the copy with its middle in
    the window counts.

    Raises
    ------
    CaseError
        As `random_points`.
    """
    seeds = random_points(seed, period, least_distance)
    shifts = np.array([(0, 0, 0), *(s for s in product((-1, 0, 1), repeat=3) if any(s))])
    places = (seeds + period * shifts[:, None]).reshape(-1, 3)
    delaunay = Delaunay(places)
    corners = np.asarray(delaunay.simplices, dtype=np.int64)
    pairs = np.concatenate([corners[:, [a, b]] for a, b in combinations(range(4), 2)])
    pairs = np.unique(np.sort(pairs, axis=1), axis=0)
    centres = _sphere_centres(places[corners])
    own = np.repeat(np.arange(len(corners)), 4)
    neighbour = np.asarray(delaunay.neighbors, dtype=np.int64).ravel()
    once = own < neighbour
    return Tessellation(
        period=period,
        seeds=np.array(seeds),
        delaunay_edges=_of_window(places[pairs], period),
        voronoi_edges=_of_window(
            np.stack([centres[own[once]], centres[neighbour[once]]], axis=1), period
        ),
        neighbours=_neighbours(places, pairs, len(seeds)),
    )


def _sphere_centres(corners: FloatArray) -> FloatArray:
    """Centres of the spheres through tetrahedra ``(t, 4, 3)``, ``(t, 3)``."""
    along = corners[:, 1:] - corners[:, :1]
    half = 0.5 * (along * along).sum(axis=2)
    # Flat tetrahedra occur only at the outer hull, far from the window.
    volume = np.abs(np.linalg.det(along))
    along[volume < 1e-14] = np.eye(3)
    return np.asarray(corners[:, 0] + np.linalg.solve(along, half[:, :, None])[:, :, 0])


def _of_window(segments: FloatArray, period: int) -> FloatArray:
    """Segments whose middle lies in the window."""
    middle = segments.mean(axis=1)
    return np.asarray(segments[((middle >= 0) & (middle < period)).all(axis=1)])


def _neighbours(places: FloatArray, pairs: NDArray[np.int64], count: int) -> tuple[FloatArray, ...]:
    """Vectors from each of the first ``count`` places to those joined with it."""
    both = np.concatenate([pairs, pairs[:, ::-1]])
    both = both[both[:, 0] < count]
    both = both[np.lexsort((both[:, 1], both[:, 0]))]
    vectors = places[both[:, 1]] - places[both[:, 0]]
    parts = np.split(vectors, np.searchsorted(both[:, 0], np.arange(1, count)))
    return tuple(part.copy() for part in parts)
