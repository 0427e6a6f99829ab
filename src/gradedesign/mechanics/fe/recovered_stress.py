"""Continuous stress up to the surface, recovered from quadratic displacements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, locked
from gradedesign.mechanics.fe._space_kernels import LOCAL_EDGES
from gradedesign.mechanics.fe.element_points import ScalarField
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.fe.stiffness import Stiffness
from gradedesign.mechanics.fe.stress import element_stress, nodal_average


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RecoveredStress:
    """Stress at the nodes of a quadratic space, beside that of the elements."""

    space: TetSpace
    #: ``(3, 3, N)``, MPa. Linear in the eighths of every element, continuous throughout.
    nodal: FloatArray
    #: ``(3, 3, M, 4)``, MPa. Of the displacements, at the vertices of every element and linear in
    #: it.
    corners: FloatArray

    def __post_init__(self) -> None:
        count = self.space.element_count
        for name, shape in (("nodal", (3, 3, None)), ("corners", (3, 3, count, 4))):
            object.__setattr__(self, name, locked(getattr(self, name), shape, name=name))


def recovered_stress(
    space: TetSpace,
    stiffness: Stiffness,
    displacement: FloatArray,
    *,
    thermal_strain: ScalarField = 0.0,
) -> RecoveredStress:
    """Average at every node, edge middles included, the stress of the elements around it.

    A linear stress is recovered exactly, at the surface too. Patches of least squares (Zienkiewicz
    and Zhu, Int. J. Numer. Meth. Engng 33, 1992) and projections were no better:
    docs/decisions/fe.md, "Stress of the solid part". Raises `SolverError` if stiffness or
    displacement belong to another space.

    - ``space``: quadratic
    - ``stiffness``: the same on both sides of every facet: an average hides a jump
    - ``displacement (3, N)``, mm
    - ``thermal_strain``, array or callable: as in `element_stress`
    """
    corners = element_stress(
        space, stiffness, displacement, thermal_strain=thermal_strain, at="vertices"
    )
    return RecoveredStress(
        space=space, nodal=nodal_average(space, at_nodes(corners)), corners=corners
    )


def at_nodes(corners: FloatArray) -> FloatArray:
    """Values at the nodes of elements ``(..., 10)`` from those at their vertices ``(..., 4)``."""
    middles = [0.5 * (corners[..., i] + corners[..., j]) for i, j in LOCAL_EDGES]
    return np.concatenate([corners, np.stack(middles, axis=-1)], axis=-1)
