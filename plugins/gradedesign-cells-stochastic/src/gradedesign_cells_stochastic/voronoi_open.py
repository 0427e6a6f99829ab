"""Open Voronoi foam: struts along the edges of the Voronoi cells of random points.

Four struts meet at every node. For independent points (``least_distance`` 0) a cell has on average
15.54 faces, and the window 5.832 cell lengths of strut per cell; for thin struts the density is
``5.832 pi t^2``. Meijering, Philips Research Reports 8 (1953) 270-290; Okabe, Boots, Sugihara &
Chiu, Spatial Tessellations (2000), table 5.5.1.
"""

from __future__ import annotations

from functools import lru_cache

from gradedesign import CellFamily
from gradedesign.fields import Field, FloatArray, periodic_distance_to_segments
from gradedesign_cells_stochastic.tessellation import tessellation

#: Cells along the window: 125 Voronoi cells.
PERIOD = 5


@lru_cache(maxsize=8)
def _struts(seed: float, least_distance: float) -> Field:
    """Distance to the edges."""
    return periodic_distance_to_segments(
        tessellation(seed, PERIOD, least_distance).voronoi_edges, period=PERIOD
    )


def voronoi_open(u: FloatArray, *, seed: float = 7.0, least_distance: float = 0.7) -> FloatArray:
    """Distance to the edges of Voronoi cells; the level is the radius of the struts.

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
    return _struts(seed, least_distance)(u)


#: The cell.
FAMILIES = (
    CellFamily(
        name="voronoi-open",
        shape=voronoi_open,
        source="edges of the Voronoi cells of random points, one point per cell",
        parameters={"seed": 7.0, "least_distance": 0.7},
        distance=True,
        symmetry="none",
        period=PERIOD,
    ),
)
