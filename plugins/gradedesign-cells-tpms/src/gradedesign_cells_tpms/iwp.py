"""Schoen's I-WP surface; its two sides differ.

``f > 0`` holds the graph I, eight struts from every point of a body-centred lattice, which never
part: ``f`` is greatest all along their axes. ``f < 0`` holds the graph WP around it, which parts
below a density of 0.10.
Stiffness along the axes differs by a factor of 4.6 at density 0.2, so the side is part of the name.

The first "Schwarz W" of Raymont's appendix A, ``10 (cXcY + cYcZ + cZcX) - 5 (c2X + c2Y + c2Z) -
14``, is ``5 f - 14`` with the solid where it is positive: the network of I.
"""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_tpms.surface_family import surface_families

SOURCE = "2 (cXcY + cYcZ + cZcX) - (c2X + c2Y + c2Z), nodal approximation of Schoen's I-WP surface"


def iwp(u: FloatArray) -> FloatArray:
    """Nodal function of Schoen's I-WP surface.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1

    Returns
    -------
    (...) array
        From -5 to 3.

    References
    ----------
    A. H. Schoen, NASA TN D-5541 (1970); H. G. von Schnering, R. Nesper, Z. Phys. B 83 (1991) 407.
    """
    x, y, z = np.cos(2 * np.pi * np.asarray(u))
    # cos 2X = 2 cos^2 X - 1
    return 2 * (x * y + y * z + z * x - x * x - y * y - z * z) + 3


#: Cells built on this surface: ``iwp-network`` is the side of WP.
FAMILIES = surface_families("iwp", iwp, SOURCE, above="-i")
