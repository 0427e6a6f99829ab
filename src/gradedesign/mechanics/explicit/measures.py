"""Stress measures of an explicit analysis: volume percentiles, by phase and by neighbourhood."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.geometry.maps.cell_map import CellMap
from gradedesign.mechanics.explicit.neighbourhoods import neighbourhoods
from gradedesign.mechanics.fe.stress import weighted_percentile
from gradedesign.mechanics.limits.banded import Banded

#: Phases of the printed solid, in the order of their numbers.
PHASES = ("lattice", "skin", "passive solid", "solid members")


@dataclass(frozen=True, slots=True, kw_only=True)
class StressMeasure:
    """Von Mises stress in one phase of the printed solid."""

    phase: str  #: One of `PHASES`.
    value: float  #: MPa. Volume percentile that is judged.
    maximum: float  #: MPa. Largest Gauss-point value: grows with refinement, reported only.
    maximum_place: tuple[float, float, float]  #: mm.
    share_above: float  #: Share of the phase's evaluated volume above the limit.
    volume: float  #: mm^3. Evaluated volume.
    worst_cell: float  #: MPa. Largest percentile of any single neighbourhood of one cell.
    worst_cell_centre: tuple[float, float, float]  #: mm.

    @property
    def band(self) -> Banded | None:
        """None: it takes another resolution."""
        return None


def stress_measures(
    points: FloatArray,
    volumes: FloatArray,
    von_mises: FloatArray,
    phase: IntArray,
    evaluated: BoolArray,
    *,
    limit: float,
    percentile: float,
    cells: CellMap | float,
) -> tuple[StressMeasure, ...]:
    """Measure stress in every phase with volume inside the evaluation mask.

    - ``points (3, M)``, mm: sample points
    - ``volumes (M,)``, mm^3
    - ``von_mises (M, q)``, MPa: each value stands for a q-th of the point's volume
    - ``phase (M,)``: index into `PHASES`
    - ``evaluated (M,)``: outside the exclusion radius of clamped regions
    - ``limit``, MPa
    - ``percentile``: of the volume, per cent
    - ``cells``, mm: kind of neighbourhood: a cell of a map, or a cube of this edge
    """
    measures = []
    for number, name in enumerate(PHASES):
        chosen = evaluated & (phase == number)
        if not chosen.any():
            continue
        values = von_mises[chosen].ravel()
        weights = shared_volumes(volumes[chosen], von_mises)
        x, y, z = points[:, chosen][:, np.argmax(von_mises[chosen].max(axis=1))].tolist()
        worst, centre = worst_neighbourhood(
            points[:, chosen], volumes[chosen], von_mises[chosen], percentile, cells
        )
        measures.append(
            StressMeasure(
                phase=name,
                value=weighted_percentile(values, weights, percentile),
                maximum=float(values.max()),
                maximum_place=(x, y, z),
                share_above=float(weights[values > limit].sum() / weights.sum()),
                volume=float(weights.sum()),
                worst_cell=worst,
                worst_cell_centre=centre,
            )
        )
    return tuple(measures)


def shared_volumes(volumes: FloatArray, values: FloatArray) -> FloatArray:
    """Volume of every one of q values at each of k points, ``(k q,)``; ``values`` is (..., q)."""
    count = values.shape[1]
    return np.repeat(volumes / count, count)


def worst_neighbourhood(
    points: FloatArray,
    volumes: FloatArray,
    von_mises: FloatArray,
    percentile: float,
    cells: CellMap | float,
) -> tuple[float, tuple[float, float, float]]:
    """Largest percentile over neighbourhoods of one cell, divided twice, half a cell apart.

    Returns ``value``, MPa; ``centre``, mm.
    """
    best = (0.0, (0.0, 0.0, 0.0))
    for near in neighbourhoods(points, volumes, cells):
        value = weighted_percentile(
            von_mises[near.members].ravel(),
            shared_volumes(volumes[near.members], von_mises),
            percentile,
        )
        if value > best[0]:
            best = (value, near.centre)
    return best
