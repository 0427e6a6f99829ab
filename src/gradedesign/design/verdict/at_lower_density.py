"""Lattice that sizing would make lighter still, if its lower density let it."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray

#: Share of the lattice from which on its lower density, more than its limits, sets its mass.
#: Chosen, not measured.
_MOST = 0.5
#: A density counts as at its lower bound within this relative distance. Chosen, not measured.
_AT = 1e-3


def at_lower_density(
    rho: FloatArray, least: FloatArray, volumes: FloatArray, mass: float
) -> list[str]:
    """A remark where most of the lattice stands at its lower density, and what lets it fall.

    None on void, which is a lattice without mass.

    ``rho (M,)``: of every tetrahedron. ``least``: ``(M,)`` or a number, the lower bound. ``volumes
    (M,)``, mm^3, of the lattice. ``mass``, g, of the whole lattice.

    Examples
    --------
    >>> at_lower_density(np.array([0.2, 0.3]), np.array(0.2), np.array([1.0, 3.0]), 90.0)
    []
    """
    solid = rho * volumes
    at = rho <= least * (1 + _AT)
    share = float(volumes[at].sum() / volumes.sum()) if volumes.any() else 0.0
    if share <= _MOST or mass == 0.0:
        return []
    held = mass * float(solid[at].sum() / solid.sum())
    return [
        f"{share:.0%} of the lattice lies at its lower density of {float(np.min(least)):.3g}, with "
        f"{held:.3g} g: if that fell by a tenth, by larger cells, a smaller [lattice] density or "
        f"more [run] memory and time, the part would be up to {held / 10:.3g} g lighter",
    ]
