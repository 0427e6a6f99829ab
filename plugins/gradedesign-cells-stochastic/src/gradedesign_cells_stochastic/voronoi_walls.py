"""Distance to the faces of the Voronoi cells of periodic points."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gradedesign.fields import Field, FloatArray, compiled_values
from gradedesign_cells_stochastic._wall_kernels import wall_distance
from gradedesign_cells_stochastic.tessellation import Tessellation

#: Bins along a cell, in each of which few seeds can be the nearest.
_BINS_PER_CELL = 4


def distance_to_walls(foam: Tessellation) -> Field:
    """Distance to the nearest face between two Voronoi cells, cell units; exact, threaded.

    A Voronoi cell is convex, so that from a point in it the nearest face lies in the nearest of
    the planes midway between its seed and the seeds of its neighbours.

    Returns
    -------
    callable
        Points ``(3, ...)`` to values ``(...)`` of the same float type.
    """
    period, count = foam.period, len(foam.seeds)
    bins = _BINS_PER_CELL * period
    shifts = np.array(list(product((-1, 0, 1), repeat=3)))
    place = (foam.seeds / period + shifts[:, None]).reshape(-1, 3)
    owner = np.tile(np.arange(count), len(shifts))
    first, member = _nearest_by_bin(place, bins)
    length = [np.linalg.norm(vectors, axis=1) for vectors in foam.neighbours]
    side = np.concatenate([[0], np.cumsum([len(v) for v in foam.neighbours])]).astype(np.int64)
    toward = np.concatenate([v / d[:, None] for v, d in zip(foam.neighbours, length, strict=True)])
    reach = 0.5 * np.concatenate(length) / period

    def evaluate(u: FloatArray) -> FloatArray:
        points = np.asarray(u) / period
        value = compiled_values(
            wall_distance, points, bins, first, member, place, owner, side, toward, reach
        )
        value *= period
        return value

    return evaluate


def _nearest_by_bin(place: FloatArray, bins: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """List, by bin of the unit cube, the places that are the nearest at some point of the bin."""
    axis = (np.arange(bins) + 0.5) / bins
    centres = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    tree = cKDTree(place)
    # From the centre to a corner of the bin both distances change by half of its diagonal at most.
    reach = tree.query(centres)[0] + 3.0**0.5 / bins
    sites = tree.query_ball_point(centres, reach, return_sorted=True)
    first = np.concatenate([[0], np.cumsum([len(rows) for rows in sites])]).astype(np.int64)
    return first, np.concatenate([np.asarray(rows, dtype=np.int64) for rows in sites])
