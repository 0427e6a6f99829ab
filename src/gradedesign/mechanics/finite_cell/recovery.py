"""Stress of well-filled elements from the points where it is most accurate."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.system.threads import in_ranges
from gradedesign.mechanics.finite_cell import _stress_kernels as kernels
from gradedesign.mechanics.finite_cell.basis import gauss_places
from gradedesign.mechanics.finite_cell.elements import Elements, solid_fraction
from gradedesign.mechanics.finite_cell.space import BrickSpace
from gradedesign.mechanics.finite_cell.stress import SolidPoints

#: Gauss points along an edge at which quadratic bricks have their most accurate stress. J. Barlow,
#: Optimal stress locations in finite element models, Int. J. Numer. Meth. Engng 10, 1976.
_BARLOW = 2
#: Share of solid from which an element counts as well filled. In others the points may lie in the
#: void, far from the solid. Chosen, not measured.
WELL_FILLED = 0.5
#: Where a symmetric tensor has xx, yy, zz, yz, zx, xy.
_FULL = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])


def recovered_stress(
    elements: Elements,
    space: BrickSpace,
    u: FloatArray,
    moduli: FloatArray,
    at: SolidPoints,
    thermal_strain: float = 0.0,
) -> FloatArray:
    """Cauchy stress at points of the solid, ``(3, 3, m)``, MPa.

    In elements that are at least half solid it is the trilinear function through the stress at
    their 2 x 2 x 2 Gauss points; elsewhere that of their displacements. Elements are not averaged
    with their neighbours: a brick is wider than a wall, so that a patch would mix both of its
    faces.

    ``u (N, 3)``, mm. ``moduli``, MPa, as `Material.moduli`. ``thermal_strain``: free expansion,
    subtracted from the strain.

    References
    ----------
    J. Barlow (1976), Optimal stress locations in finite element models, Int. J. Numer. Methods
    Eng. 10, 243-251.
    """
    m = at.volume.size
    changes = np.flatnonzero(np.diff(at.element)) + 1
    values = np.zeros((6, m))
    starts = np.concatenate([[0], changes, [m]]) if m else np.zeros(1, np.int64)
    in_ranges(
        kernels.stress_in_elements,
        range(starts.size - 1),
        space.nodes,
        u,
        elements.grid.edges,
        elements.size,
        moduli,
        thermal_strain,
        solid_fraction(elements) >= WELL_FILLED,
        gauss_places(_BARLOW)[0, :_BARLOW],
        starts,
        at.element,
        np.ascontiguousarray(at.reference),
        values,
    )
    return values[_FULL]
