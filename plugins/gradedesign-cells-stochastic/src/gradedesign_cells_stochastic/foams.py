"""Foams about random points: struts or walls of their Voronoi cells, or struts between the points.

One point to the cell. For independent points (``least_distance`` 0), on average and for thin struts
and walls of level t: a Voronoi cell has 15.54 faces of together 2.910 square cell lengths to the
cell, so walls have density ``2.910 * 2 t``; four struts meet at every node of the open foam, which
has 5.832 cell lengths of strut to the cell and density ``5.832 pi t^2``; 15.54 struts of the
Delaunay foam meet at a point, half of them to the cell. Meijering, Philips Research Reports 8
(1953) 270-290; Okabe, Boots, Sugihara & Chiu, Spatial Tessellations (2000), table 5.5.1.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from gradedesign import CellFamily
from gradedesign.fields import Field, FloatArray, periodic_distance_to_segments
from gradedesign_cells_stochastic.tessellation import tessellation
from gradedesign_cells_stochastic.voronoi_walls import distance_to_walls

#: Cells along the window: 125 points.
PERIOD = 5


@lru_cache(maxsize=24)
def _foam(edges: str, seed: float, least_distance: float) -> Field:
    """Distance to edges of a tessellation by the name of their field; to the faces without one."""
    cells = tessellation(seed, PERIOD, least_distance)
    if not edges:
        return distance_to_walls(cells)
    return periodic_distance_to_segments(getattr(cells, edges), period=PERIOD)


def delaunay(u: FloatArray, *, seed: float = 7.0, least_distance: float = 0.7) -> FloatArray:
    """Distance to the edges of Delaunay tetrahedra; the level is the radius of the struts.

    Parameters
    ----------
    u : (3, ...) array, cell units
    seed : float
        A whole number; each has its own foam.
    least_distance : float, cell units
        Between the points, 0 to 0.8: the length of the shortest strut, and the higher, the more
        alike the Voronoi cells.

    Returns
    -------
    (...) array, cell units
    """
    return _foam("delaunay_edges", seed, least_distance)(u)


def voronoi_open(u: FloatArray, *, seed: float = 7.0, least_distance: float = 0.7) -> FloatArray:
    """Distance to the edges of Voronoi cells; otherwise as `delaunay`."""
    return _foam("voronoi_edges", seed, least_distance)(u)


def voronoi_closed(u: FloatArray, *, seed: float = 7.0, least_distance: float = 0.7) -> FloatArray:
    """Distance to the faces of Voronoi cells; the level is half the thickness of the walls.

    Every pore is closed: powder, resin and support stay inside. Parameters as of `delaunay`.
    """
    return _foam("", seed, least_distance)(u)


#: Parameters of all three, and what they have in common.
_COMMON: dict[str, Any] = {
    "parameters": {"seed": 7.0, "least_distance": 0.7},
    "distance": True,
    "symmetry": "none",
    "period": PERIOD,
}

#: The cells.
FAMILIES = (
    CellFamily(
        name="delaunay",
        shape=delaunay,
        source="edges of the Delaunay tetrahedra of random points, one point per cell",
        **_COMMON,
    ),
    CellFamily(
        name="voronoi-closed",
        shape=voronoi_closed,
        source="faces of the Voronoi cells of random points, one point per cell; closed pores",
        sides=2,
        open_void=False,
        **_COMMON,
    ),
    CellFamily(
        name="voronoi-open",
        shape=voronoi_open,
        source="edges of the Voronoi cells of random points, one point per cell",
        **_COMMON,
    ),
)
