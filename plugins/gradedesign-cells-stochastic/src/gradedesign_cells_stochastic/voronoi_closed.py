"""Closed Voronoi foam: walls on the faces between the Voronoi cells of random points.

For independent points (``least_distance`` 0) the faces measure 2.910 square cell lengths per cell;
for thin walls the density is ``2.910 * 2 t``. Meijering, Philips Research Reports 8 (1953) 270-290;
Okabe, Boots, Sugihara & Chiu, Spatial Tessellations (2000), table 5.5.1.
"""

from __future__ import annotations

from functools import lru_cache

from gradedesign import CellFamily
from gradedesign.fields import Field, FloatArray
from gradedesign_cells_stochastic.tessellation import tessellation
from gradedesign_cells_stochastic.voronoi_walls import distance_to_walls

#: Cells along the window: 125 Voronoi cells.
PERIOD = 5


@lru_cache(maxsize=8)
def _walls(seed: float, least_distance: float) -> Field:
    """Distance to the faces."""
    return distance_to_walls(tessellation(seed, PERIOD, least_distance))


def voronoi_closed(u: FloatArray, *, seed: float = 7.0, least_distance: float = 0.7) -> FloatArray:
    """Distance to the faces of Voronoi cells; the level is half the thickness of the walls.

    Every pore is closed: powder, resin and support stay inside.

    Parameters
    ----------
    u : (3, ...) array, cell units
    seed : float
        A whole number; each has its own foam.
    least_distance : float, cell units
        Between the points that the cells are about, 0 to 0.8; the higher, the more alike the cells.

    Returns
    -------
    (...) array, cell units
    """
    return _walls(seed, least_distance)(u)


#: The cell.
FAMILIES = (
    CellFamily(
        name="voronoi-closed",
        shape=voronoi_closed,
        source="faces of the Voronoi cells of random points, one point per cell; closed pores",
        parameters={"seed": 7.0, "least_distance": 0.7},
        distance=True,
        symmetry="none",
        sides=2,
        period=PERIOD,
        open_void=False,
    ),
)
