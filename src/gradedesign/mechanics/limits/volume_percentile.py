"""Percentile by volume of the local stress in all solid of a lattice, and how it changes.

Inside a cell local stress is distributed as its law knows. The percentile q is where the solid
stressed more is what it leaves: ``sum w A(q / s) = (1 - p) sum w``, with the local stress s and the
solid w of every tetrahedron, and A the share of the cell's solid above a multiple of s. It is a
smooth root; its derivatives follow from that of the equation. Where no law knows a distribution,
and at one hundred per cent, the percentile is that of the plain numbers, and its derivatives are
those of numbers with some spread, scaled to it (as Le, Norato, Bruns, Ha and Tortorelli, Struct.
Multidisc. Optim. 41, 2010, scale a norm to the largest value): the value jumps from element to
element, a step of sizing must not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.fe.stress import weighted_percentile
from gradedesign.mechanics.material.law_field import LawField

#: Percentile from whose derivatives those at one hundred are scaled, which no smooth distribution
#: reaches. Chosen, not measured.
_ALL = 99.999


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VolumePercentile:
    """A percentile with its derivatives."""

    value: float  #: MPa.
    by_local: FloatArray  #: ``(M,)``. Derivatives by the local stress of every tetrahedron.
    by_density: FloatArray  #: ``(M,)``, MPa. By its effective density, at fixed local stress.
    by_volume: FloatArray  #: ``(M,)``, MPa/mm^3. By the volume of its lattice.


def volume_percentile(
    local: FloatArray,
    density: FloatArray,
    volumes: FloatArray,
    law: LawField,
    percentile: float,
) -> VolumePercentile:
    """Percentile of the local stress over all solid of the lattice.

    - ``local (M,)``, MPa: local stress of every tetrahedron that its law states
    - ``density (M,)``: effective
    - ``volumes (M,)``, mm^3: of lattice that is judged
    - ``percentile``: of the volume, per cent
    """
    used = np.flatnonzero((volumes > 0) & (local > 0))
    by_local, by_density, by_volume = np.zeros((3, local.size))
    if used.size == 0:
        return VolumePercentile(
            value=0.0, by_local=by_local, by_density=by_density, by_volume=by_volume
        )
    whole = float(volumes @ density)
    some, solid, weights = local[used], density[used], volumes[used] * density[used] / whole
    among = law.among(used)
    inside = np.clip(solid, *among.window)
    beyond = 1.0 - min(percentile, _ALL) / 100.0

    def excess(log_stress: float) -> float:
        above, _, _ = among.volume_slopes(np.exp(log_stress) / some, inside, beyond)
        return float(np.log(np.maximum(weights @ above, 1e-300) / beyond))

    low, high = np.log(some.min()) - 20.0, np.log(some.max()) + 5.0
    if excess(low) <= 0:
        # So little of the lattice is stressed at all that the percentile finds no stress.
        return VolumePercentile(
            value=0.0, by_local=by_local, by_density=by_density, by_volume=by_volume
        )
    value = smooth = float(np.exp(brentq(excess, low, high, xtol=1e-12)))
    if percentile >= 100.0 or not law.knows_distribution:
        value = weighted_percentile(some, weights, percentile)
    above, by_log, by_solid = among.volume_slopes(smooth / some, inside, beyond)
    falls = weights @ by_log
    by_local[used] = value / some * weights * by_log / falls
    by_density[used] = volumes[used] / whole * (above - beyond)
    by_volume[used] = solid / whole * (above - beyond)
    by_density[used] += weights * np.where(inside == solid, by_solid, 0.0)
    unstressed = np.flatnonzero((volumes > 0) & (local <= 0))
    by_density[unstressed] = -volumes[unstressed] / whole * beyond
    by_volume[unstressed] = -density[unstressed] / whole * beyond
    by_density *= -value / falls
    by_volume *= -value / falls
    return VolumePercentile(
        value=value, by_local=by_local, by_density=by_density, by_volume=by_volume
    )
