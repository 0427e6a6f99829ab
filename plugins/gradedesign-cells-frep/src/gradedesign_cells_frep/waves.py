"""Slabs as periodic functions, Pasko et al. 2009, eq. 4, negative inside."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_frep.parameters import repeats, within

SOURCE = "Pasko, Vilbrandt, Fryazinov & Adzhiev, TR-NCCA-2009-02 (2009), "


def slab_waves(
    u: FloatArray,
    *,
    frequency: Sequence[float],
    phase: Sequence[float],
    threshold: Sequence[float] = (0.0, 0.0, 0.0),
) -> FloatArray:
    """Three sets of infinite parallel slabs, one orthogonal to each axis.

    The paper's ``s = sin(q x + p) - l``, turned and a quarter of a period on:
    ``l - sin(2 pi (q u + p - 1/4))`` is at most 0 in the slabs, whose middle planes lie at
    ``q u + p = 1/2`` and which fill the share ``1/2 - asin(l) / pi`` of the cell. They lie evenly
    about the middle of the cell, as the paper's do not: where the density grows through a cell,
    what grows before its middle and behind it has the mean that was asked for.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1
    frequency : (3,) sequence
        Slabs in a cell along each axis, whole numbers.
    phase : (3,) sequence
        Shift of the slabs along each axis, periods.
    threshold : (3,) sequence
        Above -1 and below 1.

    Returns
    -------
    (3, ...) array

    Raises
    ------
    CaseError
        If a parameter is out of range.
    """
    points = np.asarray(u)
    waves = []
    for axis, (q, p, limit) in enumerate(zip(frequency, phase, threshold, strict=True)):
        count = repeats("frequency", q)
        shift = within("phase", p, -1.0, 1.0, "periods of the slabs")
        level = within("threshold", limit, -0.99, 0.99, "the sine at the faces of the slabs")
        waves.append(level + np.cos(2 * np.pi * (count * points[axis] + shift)))
    return np.stack(waves)
