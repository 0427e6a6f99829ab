"""Delaunay foam: struts between random points whose Voronoi cells share a face.

For independent points (``least_distance`` 0) 15.54 struts meet at a point on average, as many as a
Voronoi cell has faces, half of them to the cell. Okabe, Boots, Sugihara & Chiu, Spatial
Tessellations (2000), table 5.5.1.
"""

from __future__ import annotations

from functools import lru_cache

from gradedesign import CellFamily
from gradedesign.fields import Field, FloatArray, periodic_distance_to_segments
from gradedesign_cells_stochastic.tessellation import tessellation

#: Cells along the window: 125 points.
PERIOD = 5


@lru_cache(maxsize=8)
def _struts(seed: float, least_distance: float) -> Field:
    """Distance to the edges."""
    return periodic_distance_to_segments(
        tessellation(seed, PERIOD, least_distance).delaunay_edges, period=PERIOD
    )


def delaunay(u: FloatArray, *, seed: float = 7.0, least_distance: float = 0.7) -> FloatArray:
    """Distance to the edges of Delaunay tetrahedra; the level is the radius of the struts.

    Parameters
    ----------
    u : (3, ...) array, cell units
    seed : float
        A whole number; each has its own foam.
    least_distance : float, cell units
        Between the points, 0 to 0.8; it is the length of the shortest strut.

    Returns
    -------
    (...) array, cell units
    """
    return _struts(seed, least_distance)(u)


#: The cell.
FAMILIES = (
    CellFamily(
        name="delaunay",
        shape=delaunay,
        source="edges of the Delaunay tetrahedra of random points, one point per cell",
        parameters={"seed": 7.0, "least_distance": 0.7},
        distance=True,
        symmetry="none",
        period=PERIOD,
    ),
)
