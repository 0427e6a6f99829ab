"""Work of inertia forces on every element, for sensitivities."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.geometry.tets.tet_mesh import signed_volumes
from gradedesign.mechanics.fe.space import TetSpace


def body_force_work(
    space: TetSpace, acceleration: FloatArray, displacement: FloatArray
) -> FloatArray:
    """Integral of ``acceleration . displacement`` over every element, ``(M,)``, mm^5/s^2.

    Multiplied by mass per volume it is the work of inertia forces in N mm.
    """
    projected = np.asarray(acceleration) @ displacement
    values = projected[space.elements]
    if space.order == 1:
        mean = values.mean(axis=0)
    else:
        mean = 0.2 * values[4:].sum(axis=0) - 0.05 * values[:4].sum(axis=0)
    return signed_volumes(space.mesh) * mean
