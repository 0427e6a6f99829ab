"""Which part of the printed solid a point belongs to: lattice, skin or a kept region."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray
from gradedesign.lattice.lattice import LatticeDesign

LATTICE, SKIN, KEPT = 0, 1, 2


def phase_at(design: LatticeDesign, points: FloatArray) -> IntArray:
    """Phase of points ``(3, n)`` mm, ``(n,)``: indices into ``measures.PHASES``."""
    phase = np.full(points.shape[1:], LATTICE, dtype=np.int64)
    if design.skin is not None:
        phase[design.part(points) > -design.skin] = SKIN
    for region in design.kept:
        phase[region.distance(points) < region.margin] = KEPT
    return phase


def considered_at(points: FloatArray, clamped: tuple[Field, ...], radius: float) -> BoolArray:
    """Points farther than the exclusion radius from every clamped region, ``(n,)``."""
    keep = np.ones(points.shape[1:], dtype=bool)
    for distance in clamped:
        keep &= distance(points) > radius
    return keep
