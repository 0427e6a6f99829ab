"""Simple and body-centred cubic struts together, stiffness isotropic in the thin-strut limit.

With a share 2/5 of the material in the simple cubic and 3/5 in the body-centred struts the
stiffness of thin struts is isotropic and the greatest that an isotropic truss can have: C11 =
rho/5, C12 = C44 = rho/15 of the base material's E. Gurtner & Durand, Proceedings of the Royal
Society A 470 (2014) 20130611.
"""

from __future__ import annotations

from functools import cache, lru_cache

import numpy as np

from gradedesign import CaseError, CellFamily
from gradedesign.fields import Field, FloatArray, graph_segments, periodic_distance_to_segments
from gradedesign_cells_strut import bcc, sc
from gradedesign_cells_strut.strut_family import node_distance, with_balls


@cache
def _segments() -> tuple[FloatArray, FloatArray]:
    """Struts of both graphs."""
    return graph_segments(sc.NODES, sc.EDGES), graph_segments(bcc.NODES, bcc.EDGES)


@lru_cache(maxsize=32)
def _struts(sc_share: float) -> Field:
    """Least distance by relative thickness, the thinner struts counting 1."""
    if not 0 < sc_share < 1:
        raise CaseError(f"a share of {sc_share:g} in the cubic struts is impossible; use 0 to 1")
    straight, oblique = _segments()
    # Material is area times length: 3 cells of cubic struts, 4 sqrt(3) of oblique ones.
    areas = np.array([sc_share / 3, (1 - sc_share) / (4 * 3**0.5)])
    radii = np.sqrt(areas / areas.min())
    thickness = np.repeat(radii, [len(straight), len(oblique)])
    return periodic_distance_to_segments(np.concatenate([straight, oblique]), thickness=thickness)


@cache
def _balls() -> Field:
    """Distance to the nodes of both graphs."""
    return node_distance(np.concatenate(_segments()))


def sc_bcc(u: FloatArray, *, sc_share: float = 0.4, node_ratio: float = 1.0) -> FloatArray:
    """Distance to the axes by relative thickness; a level is the radius of the thinner struts.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1
    sc_share : float
        Share of the material in the simple cubic struts, counted without overlaps at nodes.
    node_ratio : float
        Radius of balls at the nodes by that of the thinner struts.

    Returns
    -------
    (...) array, cell units
    """
    return with_balls(_struts(sc_share), lambda v: _balls()(v), node_ratio)(u)


#: The cell; no distance, since its struts differ in thickness.
FAMILIES = (
    CellFamily(
        name="sc-bcc",
        shape=sc_bcc,
        source="sc and bcc struts, isotropic at sc_share 0.4 (Gurtner & Durand 2014)",
        parameters={"sc_share": 0.4, "node_ratio": 1.0},
    ),
)
