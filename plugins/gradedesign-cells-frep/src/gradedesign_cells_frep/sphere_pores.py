"""Round pores, ``gauge = |p|``, on the cubic, body-centred and face-centred lattice.

In units of the cell, pores of radius r below half of their distance take ``k 4/3 pi r^3`` of it,
with k = 1, 2, 4 in a cell. They touch at 1/2, sqrt(3) / 4 and sqrt(2) / 4, at densities of 1 less
the packing fractions pi / 6, pi sqrt(3) / 8 and pi sqrt(2) / 6. Cubic ones open to each other
there; the others are joined by round channels between nearest neighbours, of radius neck times r,
as the opals are whose inverse the face-centred one is.
"""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray, bond_graph, graph_segments
from gradedesign_cells_frep.pore_family import Pores, pore_family

BCC = ((0.0, 0.0, 0.0), (0.5, 0.5, 0.5))
FCC = ((0.0, 0.0, 0.0), (0.0, 0.5, 0.5), (0.5, 0.0, 0.5), (0.5, 0.5, 0.0))


def sphere(p: FloatArray) -> FloatArray:
    """Gauge of a ball of radius 1, ``(3, ...)`` to ``(...)``."""
    return np.asarray(np.sqrt((p * p).sum(axis=0)))


#: Cells of this pore.
FAMILIES = (
    *(
        pore_family(
            f"sphere-pores{end}",
            Pores(gauge=sphere, mirrored=True),
            symmetry="cubic",
            noise=bool(end),
            source="spheres",
        )
        for end in ("", "-noise")
    ),
    *(
        pore_family(
            f"sphere-pores-{lattice}",
            Pores(
                gauge=sphere,
                centres=centres,
                channels=graph_segments(*bond_graph(centres, distance)),
                mirrored=True,
            ),
            symmetry="cubic",
            source="spheres with channels",
        )
        for lattice, centres, distance in (("bcc", BCC, 0.75**0.5), ("fcc", FCC, 0.5**0.5))
    ),
)
