"""Local stress in a cell under any macroscopic stress, and the strength that follows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray
from gradedesign.common.system.threads import in_ranges
from gradedesign.mechanics.fe.stress import weighted_percentile
from gradedesign.mechanics.homogenise._hexahedron_kernels import centre_strain
from gradedesign.mechanics.homogenise.constants import solid_stiffness
from gradedesign.mechanics.homogenise.macro_directions import named_directions, von_mises_of
from gradedesign.mechanics.homogenise.operator import threads_for
from gradedesign.mechanics.homogenise.periodic import PeriodicSolution

#: Percentile by volume that stands for the highest local stress. The maximum itself grows with the
#: resolution at re-entrant corners. Chosen, not measured.
PERCENTILE = 99.5
#: Points times macroscopic stresses that are worked on at once. Bounds the memory; the result does
#: not depend on it. Chosen, not measured.
_BATCH = 2_000_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LocalStress:
    """Stress at the centre of every solid voxel for the six unit macroscopic stresses."""

    #: ``(6, 6, n)`` float32. Local Voigt component, macroscopic Voigt component, voxel; local over
    #: macroscopic.
    stress: NDArray[np.float32]
    volume: FloatArray  #: ``(n,)``. Solid part of each voxel.


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Strength:
    """Stress concentration of a cell: local over macroscopic stress."""

    strength: float  #: Macroscopic over local von Mises stress in the worst of the directions.
    #: Largest percentile of the local von Mises stress in each class of directions, per unit
    #: macroscopic von Mises stress.
    factor: Mapping[str, float]
    #: The same per unit hydrostatic stress, which has no von Mises stress of its own.
    hydrostatic: float
    percentile: float


def local_stress(solution: PeriodicSolution) -> LocalStress:
    """Local stress of the base material at voxel centres per unit macroscopic stress.

    In a partly filled voxel that is the stress of the solid in it, at the voxel's mean strain.

    Examples
    --------
    >>> from gradedesign.mechanics.homogenise.periodic import solve_periodic
    >>> local = local_stress(solve_periodic(np.ones((4, 4, 4))))
    >>> pull = np.array([[1.0, 0, 0, 0, 0, 0]]).T
    >>> stress_factors(local, pull).round(3).tolist()
    [1.0]
    """
    voxel = np.flatnonzero(solution.fill)
    count = voxel.size
    solid = solid_stiffness(solution.poissons_ratio)
    compliance = np.linalg.inv(solution.stiffness)
    stress = np.zeros((6, 6, count), dtype=np.float32)
    strain = np.zeros((6, count))
    for case in range(6):
        with threads_for(solution.fill.size):
            in_ranges(
                centre_strain, range(count), solution.displacement[case], voxel, np.eye(6)[case],
                strain,
            )  # fmt: skip
        stress[:, case] = solid @ strain
    # Local stress is linear in the macroscopic strain, and that in the macroscopic stress.
    per_stress = np.matmul(compliance.astype(np.float32), stress)
    return LocalStress(stress=per_stress, volume=solution.fill.ravel()[voxel].copy())


def sampled(local: LocalStress, count: int, rng: np.random.Generator) -> LocalStress:
    """At most ``count`` points of equal volume, drawn in proportion to volume.

    One in each equal part of the cumulative volume, so that a voxel appears as often as its volume
    asks, twice if need be: drawn without repetition, partly filled voxels, the most stressed, are
    too many.
    """
    n = local.volume.size
    if n <= count:
        return local
    below = np.cumsum(local.volume)
    places = (np.arange(count) + rng.uniform(size=count)) / count * below[-1]
    chosen = np.minimum(np.searchsorted(below, places, side="right"), n - 1)
    return LocalStress(stress=local.stress[:, :, chosen], volume=np.ones(count))


def stress_factors(
    local: LocalStress, macro: FloatArray, percentile: float = PERCENTILE
) -> FloatArray:
    """Percentile by volume of the local von Mises stress under macroscopic stresses.

    ``macro (6, k)``. Returns ``(k,)``: in units of ``macro``.

    Examples
    --------
    >>> from gradedesign.mechanics.homogenise.periodic import solve_periodic
    >>> local = local_stress(solve_periodic(np.ones((4, 4, 4))))
    >>> shear = np.array([[0.0, 0, 0, 0, 0, 1]]).T
    >>> stress_factors(local, shear).round(3).tolist()  # the root of three
    [1.732]
    """
    factors = np.zeros(macro.shape[1])
    step = max(1, _BATCH // max(local.volume.size, 1))
    for start in range(0, macro.shape[1], step):
        some = macro[:, start : start + step].T.astype(np.float32)
        # One product per local component: contracting the middle axis would copy the whole field.
        for k, value in enumerate(von_mises_of(np.matmul(some, local.stress))):
            factors[start + k] = _upper_percentile(value, local.volume, percentile)
    return factors


def stress_distribution(
    local: LocalStress, macro: FloatArray, percent: FloatArray, percentile: float = PERCENTILE
) -> FloatArray:
    """Percentiles by volume of the local von Mises stress over one of them, mean over stresses.

    ``macro (6, k)``. ``percent (t,)``. ``percentile``: whose local stress is 1. Returns ``(t,)``.
    """
    shares = np.zeros((macro.shape[1], len(percent)))
    for row, some in zip(shares, macro.T.astype(np.float32), strict=True):
        value = von_mises_of(np.matmul(some, local.stress))
        order = np.argsort(value, kind="stable")
        below = np.cumsum(local.volume[order])
        places = np.searchsorted(below, np.append(percent, percentile) / 100 * below[-1])
        quantiles = value[order][np.minimum(places, value.size - 1)]
        row[:] = quantiles[:-1] / quantiles[-1]
    return np.asarray(shares.mean(axis=0))


def _upper_percentile(value: FloatArray, volume: FloatArray, percentile: float) -> float:
    """`weighted_percentile` of a high percentage, sorting no more than the highest tenth."""
    share = min(10 * (1 - percentile / 100), 1.0)
    rank = int((1 - share) * (value.size - 1))
    threshold = np.partition(value, rank)[rank]
    high = value >= threshold
    above = float(volume[high].sum())
    exceeding = (1 - percentile / 100) * float(volume.sum())
    if exceeding >= above or above <= 0:
        return weighted_percentile(value, volume, percentile)
    return weighted_percentile(value[high], volume[high], 100 * (1 - exceeding / above))


def cell_strength(local: LocalStress, percentile: float = PERCENTILE) -> Strength:
    """Strength of a cell as one number: the worst over `named_directions`.

    First yield is taken where the percentile of the local von Mises stress reaches the yield
    stress, so that the strength is macroscopic von Mises stress over yield stress. Hydrostatic
    stress strains a cell too, but no von Mises stress measures it: it is reported apart.
    """
    factor = {
        name: float(stress_factors(local, macro, percentile).max())
        for name, macro in named_directions().items()
    }
    hydrostatic = np.array([[1.0], [1.0], [1.0], [0.0], [0.0], [0.0]])
    return Strength(
        strength=1 / max(factor.values()),
        factor=factor,
        hydrostatic=float(stress_factors(local, hydrostatic, percentile)[0]),
        percentile=percentile,
    )
