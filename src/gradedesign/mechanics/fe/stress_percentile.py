"""Percentile by volume, largest value and uncertainty of a recovered von Mises stress."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.geometry.tets.tet_mesh import signed_volumes
from gradedesign.mechanics.fe.linear_percentile import linear_percentile
from gradedesign.mechanics.fe.recovered_stress import RecoveredStress, at_nodes
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.fe.stress import von_mises

#: Eight tetrahedra of equal volume that fill a quadratic one, by its nodes, ``(8, 4)``.
EIGHTHS = np.array(
    [
        (0, 4, 6, 7),
        (4, 1, 5, 8),
        (6, 5, 2, 9),
        (7, 8, 9, 3),
        (4, 5, 6, 8),
        (4, 6, 7, 8),
        (6, 5, 9, 8),
        (6, 7, 8, 9),
    ]
)


@dataclass(frozen=True, slots=True, kw_only=True)
class StressPercentile:
    """Von Mises stress of a recovered field, MPa."""

    value: float  #: Percentile by volume.
    largest: float  #: At a node.
    #: Mean difference between the stress of the elements and the recovered one, as a von Mises
    #: stress, where `value` is reached: it falls with the error of both (Zienkiewicz and Zhu, Int.
    #: J. Numer. Meth. Engng 24, 1987).
    deviation: float


def stress_percentile(
    stress: RecoveredStress, shares: FloatArray, percentile: float
) -> StressPercentile | None:
    """Percentile by volume of the von Mises stress, taken as linear in the eighths of elements.

    ``shares (8, M)``: share of every eighth of an element that is judged, see `judged_shares`.
    ``percentile``: more than 0, at most 100.

    Returns
    -------
    StressPercentile or None
        None where nothing is judged.
    """
    space = stress.space
    piece, element = np.nonzero(shares)
    if not element.size:
        return None
    values = von_mises(stress.nodal)[space.elements[EIGHTHS[piece].T, element]]
    volumes = shares[piece, element] * signed_volumes(space.mesh)[element] / 8.0
    value = linear_percentile(values, volumes, percentile)
    reached = values.max(axis=0) >= value
    # Of a piece that lies within the exclusion for the most part, a corner there does not count.
    inside = values[:, shares[piece, element] > 0.5]
    return StressPercentile(
        value=value,
        largest=max(value, float(inside.max(initial=0.0))),
        deviation=_deviation(stress, piece[reached], element[reached], volumes[reached]),
    )


def judged_shares(space: TetSpace, judged: Callable[[FloatArray], BoolArray]) -> FloatArray:
    """Share of every eighth of the elements that is judged, by eight points where a border cuts it.

    ``space``: quadratic. ``judged``: whether points ``(3, ...)`` mm count, ``(...)``. Returns
    ``(8, M)``.
    """
    pieces = space.elements[EIGHTHS].transpose(1, 0, 2)
    shares: FloatArray = judged(space.nodes)[pieces].mean(axis=0)
    piece, element = np.nonzero((shares > 0.0) & (shares < 1.0))
    if element.size:
        inner = at_nodes(np.eye(4))[:, EIGHTHS].mean(axis=2)
        corners = space.nodes[:, pieces[:, piece, element]]
        shares[piece, element] = judged(np.einsum("dcn,cs->dsn", corners, inner)).mean(axis=0)
    return shares


def _deviation(
    stress: RecoveredStress, piece: NDArray[np.intp], element: NDArray[np.intp], volumes: FloatArray
) -> float:
    """Mean over eighths of elements of the von Mises stress of raw less recovered, MPa."""
    elements, at = np.unique(element, return_inverse=True)
    recovered = stress.nodal[:, :, stress.space.elements[:, elements].T]
    difference = von_mises(at_nodes(stress.corners[:, :, elements]) - recovered)
    means = difference[at[:, None], EIGHTHS[piece]].mean(axis=1)
    return float(volumes @ means / volumes.sum())
