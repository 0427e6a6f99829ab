"""Octahedral pores, ``gauge = |x| + |y| + |z|``.

Up to r = 1/2 they are apart and the density is ``1 - 4/3 r^3``; up to 1 they overlap in pyramids
and it is ``1 - 4/3 r^3 + 4 (r - 1/2)^3``.
"""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_frep.pore_family import Pores, pore_family


def octahedron(p: FloatArray) -> FloatArray:
    """Gauge of an octahedron with corners at distance 1."""
    return np.asarray(np.abs(p).sum(axis=0))


#: Cells of this pore.
FAMILIES = tuple(
    pore_family(
        f"octahedron-pores{'-noise' if noise else ''}",
        Pores(gauge=octahedron, mirrored=True),
        symmetry="cubic",
        noise=noise,
        source="octahedra",
    )
    for noise in (False, True)
)
