"""Cubic pores joined by square channels.

Cubes alone, ``max |p_i| <= r``, are closed until no wall is left; channels of half width neck times
r along the axes open them: ``F = min(max_i |p_i|, min_i max_{j != i} |p_j| / neck)``. The density
is ``1 - 8 r^3 - 12 (neck r)^2 (1 - 2 r)``. Levels count from full pores: ``t = 1/2 - r`` is half of
the wall between them.
"""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_frep.parameters import within
from gradedesign_cells_frep.pore_family import Pores, pore_family
from gradedesign_cells_frep.rods import median


def cube(p: FloatArray, *, neck: float = 0.4) -> FloatArray:
    """Gauge of a cube of half width 1 with channels of half width ``neck``, 0.05 to 1.

    Raises
    ------
    CaseError
        If the neck is out of range.
    """
    share = within("neck", neck, 0.05, 1.0, "width of the channels by that of the pores")
    size = np.abs(p)
    # Of the three channels the one whose cross-section is nearest: the second largest distance.
    return np.asarray(np.minimum(size.max(axis=0), median(size) / share))


#: Cells of this pore.
FAMILIES = tuple(
    pore_family(
        f"cube-pores{'-noise' if noise else ''}",
        Pores(gauge=cube, mirrored=True, full=0.5),
        parameters={"neck": 0.4},
        symmetry="cubic",
        noise=noise,
        source="cubes with channels",
    )
    for noise in (False, True)
)
