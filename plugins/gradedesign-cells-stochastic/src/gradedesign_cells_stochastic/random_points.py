"""Random points of a periodic window, one for each cell, with a least distance if asked."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from gradedesign import CaseError
from gradedesign.fields import FloatArray
from gradedesign_cells_stochastic.random_numbers import uniform

#: Greatest least distance, cell units. Random sequential addition jams at a share of 0.38 of the
#: volume in balls of that diameter, 0.9 cells; near to it, points are hard to place.
_LARGEST_DISTANCE = 0.8

_STREAM = 1

#: Places tried for each point at most.
_TRIES = 500


@lru_cache(maxsize=64)
def random_points(seed: float, period: int, least_distance: float) -> FloatArray:
    """Points placed one by one at random, each dropped if it comes too near to one before.

    Parameters
    ----------
    seed : float
        A whole number.
    period : int, cells
        Edge of the window.
    least_distance : float, cell units
        From 0, where the points are independent, to `_LARGEST_DISTANCE`.

    Returns
    -------
    (period^3, 3) array, cell units
        In the window; cannot be written to.

    Raises
    ------
    CaseError
        If the seed or the distance is out of range.

    References
    ----------
    Random sequential addition: Widom, Journal of Chemical Physics 44 (1966) 3888. As seeds of
    foams: Zhu, Thorpe & Windle, Philosophical Magazine A 81 (2001) 2765, where the least distance
    over that of the bcc lattice, 1.091 cells, is called regularity.
    """
    if not 0 <= least_distance <= _LARGEST_DISTANCE:
        raise CaseError(
            f"the least distance of random points is {least_distance:g} cells, expected 0 to "
            f"{_LARGEST_DISTANCE:g}"
        )
    wanted = period**3
    places = period * uniform(seed, _STREAM, 3 * _TRIES * wanted).reshape(-1, 3)
    if least_distance == 0:
        points = places[:wanted].copy()
    else:
        points = _kept_apart(places, wanted, period, least_distance)
    points.flags.writeable = False
    return points


def _kept_apart(places: FloatArray, wanted: int, period: int, least: float) -> FloatArray:
    """Take places in order unless they are nearer than ``least`` to one taken."""
    points = np.zeros((wanted, 3))
    taken = 0
    for place in places:
        apart = points[:taken] - place
        apart -= period * np.round(apart / period)
        if (apart * apart).sum(axis=1).min(initial=np.inf) >= least * least:
            points[taken] = place
            taken += 1
            if taken == wanted:
                return points
    raise CaseError(
        f"only {taken} of {wanted} points {least:g} cells apart found room; use a smaller distance"
    )
