"""Random spheres of one radius that may overlap: pores in a solid, or balls of solid.

One centre to the cell. For independent centres (``least_distance`` 0) the balls of radius r fill
``1 - exp(-4/3 pi r^3)``. Torquato, Random Heterogeneous Materials (2002), section 5.1.1.
"""

from __future__ import annotations

from functools import lru_cache

from gradedesign import CellFamily
from gradedesign.fields import Field, FloatArray, periodic_distance_to_segments
from gradedesign_cells_stochastic.random_points import random_points

#: Cells along the window: 216 spheres.
PERIOD = 6


@lru_cache(maxsize=8)
def _centres(seed: float, least_distance: float) -> Field:
    """Distance to the nearest centre."""
    points = random_points(seed, PERIOD, least_distance)
    return periodic_distance_to_segments(points[:, None].repeat(2, axis=1), period=PERIOD)


def random_spheres(u: FloatArray, *, seed: float = 7.0, least_distance: float = 0.0) -> FloatArray:
    """Distance to the nearest centre; the level is the radius of balls of solid.

    Parameters
    ----------
    u : (3, ...) array, cell units
    seed : float
        A whole number; each has its own centres.
    least_distance : float, cell units
        Between centres, 0 to 0.8.

    Returns
    -------
    (...) array, cell units
    """
    return _centres(seed, least_distance)(u)


def random_pores(u: FloatArray, *, seed: float = 7.0, least_distance: float = 0.0) -> FloatArray:
    """Minus the distance to the nearest centre; the level is minus the radius of the pores.

    Parameters
    ----------
    u : (3, ...) array, cell units
    seed, least_distance : float
        As of `random_spheres`.

    Returns
    -------
    (...) array, cell units
    """
    return -_centres(seed, least_distance)(u)


#: The cells; no distances, since the necks between spheres are thinner than the spheres.
FAMILIES = (
    CellFamily(
        name="random-pores",
        shape=random_pores,
        source="solid outside random spheres, one per cell",
        parameters={"seed": 7.0, "least_distance": 0.0},
        symmetry="none",
        period=PERIOD,
    ),
    CellFamily(
        name="random-spheres",
        shape=random_spheres,
        source="random spheres of solid, one per cell",
        parameters={"seed": 7.0, "least_distance": 0.0},
        symmetry="none",
        period=PERIOD,
    ),
)
