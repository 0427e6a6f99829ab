"""Stiffness and strength of the mixes in a transition, beside the means of its two cells.

A mix is homogenised as a periodic cell at three shares and two densities. Its factor on stiffness
is the largest with which the mean of the cells' stiffnesses is in no strain stiffer than the mix,
the least of both densities, and at most 1; that on strength accordingly. Between shares they are
linear. So the law of a transition is a lower bound at the shares and densities that are computed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import lcm

import numpy as np
import scipy.linalg

from gradedesign.arrays import FloatArray, locked
from gradedesign.common.system.cache import content_key, load_arrays, store_arrays
from gradedesign.errors import DensityError
from gradedesign.geometry.cell.blend import Blend
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cell import Cell, cell_key
from gradedesign.geometry.cell.cells import Cells
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.wall_size import density_for_wall, wall_mm
from gradedesign.mechanics.homogenise.cell_properties import cell_properties
from gradedesign.mechanics.homogenise.sampling import CUBE, LEAST_VOXELS
from gradedesign.mechanics.material.scaling_law import ScalingLaw

KIND = "mix-properties"
#: Shares of the second cell at which mixes are computed. Chosen, not measured.
SHARES = (0.25, 0.5, 0.75)
#: Voxels along a mix: as many as its thinnest wall needs, between these. Chosen, not measured.
_LEAST_RESOLUTION, _MOST_RESOLUTION = 24, 72
#: A mix is used from this much above the density at which it falls apart. Chosen, not measured.
_ABOVE_FLOOR = 1.15


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MixFactors:
    """Factors of one transition over the share of its second cell, and where its mixes exist."""

    share: FloatArray  #: ``(k,)``. Increasing, from 0 to 1.
    #: ``(k,)``. Densities between which the mix is one piece with an open void and was resolved.
    low: FloatArray
    high: FloatArray
    #: ``(k,)``. Factors on the mean of the two cells, 1 at the ends.
    stiffness: FloatArray
    strength: FloatArray
    cells: tuple[Cell, ...]  #: The mixes, without the ends.

    def __post_init__(self) -> None:
        count = np.asarray(self.share).size
        for name in ("share", "low", "high", "stiffness", "strength"):
            object.__setattr__(self, name, locked(getattr(self, name), (count,), name=name))


def _mix_windows(
    ends: tuple[Cell, Cell], blend: Blend, edges: Sequence[float]
) -> list[tuple[Cell, tuple[float, float]]]:
    """Mixes of two cells at `SHARES`, with the densities at which they can be computed.

    Raises `DensityError` if a mix exists at no density.
    """
    mixes = []
    for share in SHARES:
        cell = _mixed_cell(*ends, blend, share)
        voxel = cell.family.period * max(edges) / min(edges) / _MOST_RESOLUTION
        low, high = cell.window
        floor = max(_ABOVE_FLOOR * low, density_for_wall(cell, LEAST_VOXELS * voxel, 1.0))
        if floor >= high:
            raise DensityError(
                f"the mix with {share:.0%} of '{ends[1].name}' exists for densities "
                f"{low:.3g} to {high:.3g}, with walls thick enough to compute it from "
                f"{floor:.3g} on only; take other cells, or let their zones not touch"
            )
        mixes.append((cell, (floor, high)))
    return mixes


@lru_cache(maxsize=64)
def _mixed_cell(first: Cell, second: Cell, blend: Blend, share: float) -> Cell:
    """Periodic cell that two cells make where the share of the second is the same everywhere.

    Of no declared symmetry, its level the density itself. Raises `DensityError` if the mix is one
    connected piece with an open void at no density.
    """

    def shape(u: FloatArray) -> FloatArray:
        flat = u.reshape(3, -1)
        return blend.rank(flat, np.full(flat.shape[1], share)).reshape(u.shape[1:])

    return calibrate(
        CellFamily(
            name=f"{first.name}-to-{second.name}-{round(100 * share)}",
            shape=shape,
            source=f"transition, {share:.0%} of {second.name}",
            symmetry="none",
            sides=2 if blend.sheets else 1,
            period=lcm(first.family.period, second.family.period),
            open_void=first.family.open_void and second.family.open_void,
        )
    )


def mix_factors(
    cells: Cells,
    pair: tuple[int, int],
    laws: tuple[ScalingLaw, ScalingLaw],
    bounds: tuple[float, float],
    *,
    poissons_ratio: float,
    edges: Sequence[float] = CUBE,
    on_mix: Callable[[Cell, float], None] | None = None,
) -> MixFactors:
    """Homogenise the mixes of two cells and compare them with the means of both.

    Raises `DensityError` if a mix exists at none of these densities, and `LatticeError` or
    `SolverError` as `cell_properties`.

    - ``pair``: numbers of two that meet
    - ``laws``: of these two
    - ``bounds``: densities that may occur where they meet
    - ``poissons_ratio``: of the base material
    - ``edges (3,)``: of the cell, up to a factor
    - ``on_mix``: hears of a mix and density that are computed, not found in the user's cache
    """
    first, second = laws
    rows, mixes = [(0.0, *first.window, 1.0, 1.0)], []
    ends = cells.members[pair[0]], cells.members[pair[1]]
    windows = _mix_windows(ends, cells.blends[pair], edges)
    for share, (cell, window) in zip(SHARES, windows, strict=True):
        low = max(window[0], first.window[0], second.window[0])
        high = min(window[1], first.window[1], second.window[1])
        a, b = max(low, bounds[0]), min(high, bounds[1])
        if a > b:
            raise DensityError(
                f"the mix with {share:.0%} of '{second.name}' can be made and computed for "
                f"densities {low:.3g} to {high:.3g}, but {bounds[0]:.3g} to {bounds[1]:.3g} is "
                f"allowed where the zones meet; widen their densities or take other cells"
            )
        stiffness, strength = 1.0, 1.0
        for rho in {round(a, 4), round(b, 4)}:
            at = np.array([min(max(rho, a), b)])
            mixed, strong = _mix(cell, float(at[0]), poissons_ratio, edges, on_mix)
            mean = ((1 - share) * first.stiffness(at) + share * second.stiffness(at))[:, :, 0]
            stiffness = min(stiffness, float(scipy.linalg.eigvalsh(mixed, mean)[0]))
            expected = (1 - share) * first.strength(at) + share * second.strength(at)
            strength = min(strength, float(strong / expected[0]))
        mixes.append(cell)
        rows.append((share, low, high, stiffness, strength))
    rows.append((1.0, *second.window, 1.0, 1.0))
    share_, low_, high_, stiffness_, strength_ = np.array(rows).T
    return MixFactors(
        share=share_,
        low=low_,
        high=high_,
        stiffness=stiffness_,
        strength=strength_,
        cells=tuple(mixes),
    )


def _mix(
    cell: Cell,
    rho: float,
    poissons_ratio: float,
    edges: Sequence[float],
    on_mix: Callable[[Cell, float], None] | None,
) -> tuple[FloatArray, float]:
    """Stiffness ``(6, 6)`` and strength of a mix, from the user's cache or computed now."""
    key = content_key(cell_key(cell), float(rho), float(poissons_ratio), *map(float, edges))
    stored = load_arrays(KIND, key)
    if stored is None:
        if on_mix is not None:
            on_mix(cell, rho)
        voxels = LEAST_VOXELS * cell.family.period / float(wall_mm(cell, rho, 1.0))
        even = 2 * int(np.ceil(0.5 * voxels * max(edges) / min(edges) + 1e-6))
        properties = cell_properties(
            cell,
            rho,
            poissons_ratio=poissons_ratio,
            resolution=int(np.clip(even, _LEAST_RESOLUTION, _MOST_RESOLUTION)),
            with_surface=False,
            edges=edges,
        )
        stored = {
            "stiffness": properties.stiffness,
            "strength": np.array(properties.strength.strength),
        }
        store_arrays(KIND, key, **stored)
    return np.asarray(stored["stiffness"]), float(stored["strength"])
