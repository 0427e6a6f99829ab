"""Stress of well-filled elements from the points where it is most accurate."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.finite_cell.basis import gauss_places
from gradedesign.finite_cell.elements import Elements, solid_fraction
from gradedesign.finite_cell.space import BrickSpace
from gradedesign.finite_cell.stress import CHUNK, SolidPoints, select_points, stress_at

#: Gauss points along an edge at which quadratic bricks have their most accurate stress.
BARLOW = 2
#: Share of solid from which an element counts as well filled. In others the points may lie in the
#: void, far from the solid.
WELL_FILLED = 0.5


def recovered_stress(
    elements: Elements,
    space: BrickSpace,
    u: FloatArray,
    lame: tuple[float, float],
    at: SolidPoints,
    thermal_strain: float = 0.0,
) -> FloatArray:
    """Cauchy stress at points of the solid, ``(3, 3, m)``, MPa.

    In elements that are at least half solid it is the trilinear function through the stress at
    their 2 x 2 x 2 Gauss points; elsewhere that of `stress_at`. Elements are not averaged with
    their neighbours: a brick is wider than a wall, so that a patch would mix both of its faces.

    Parameters
    ----------
    elements : Elements
    space : BrickSpace
    u : (N, 3) array, mm
    lame : (float, float), MPa
    at : SolidPoints
    thermal_strain : float
        Free expansion, subtracted from the strain.

    References
    ----------
    J. Barlow (1976), Optimal stress locations in finite element models, Int. J. Numer. Methods
    Eng. 10, 243-251.
    """
    filled = solid_fraction(elements)[at.element] >= WELL_FILLED
    stress = np.zeros((3, 3, at.volume.size))
    poor = np.flatnonzero(~filled)
    stress[:, :, poor] = stress_at(
        elements, space, u, lame, select_points(at, poor), thermal_strain
    )
    index = np.flatnonzero(filled)
    for k in range(0, index.size, CHUNK):
        part = index[k : k + CHUNK]
        own, row = np.unique(at.element[part], return_inverse=True)
        sampled = stress_at(elements, space, u, lame, _barlow_points(own), thermal_strain)
        corners = sampled.reshape(3, 3, own.size, BARLOW**3)
        weights = _trilinear(at.reference[:, part])
        stress[:, :, part] = np.einsum("mq,ijmq->ijm", weights, corners[:, :, np.ravel(row)])
    return stress


def _barlow_points(element: IntArray) -> SolidPoints:
    """Gauss points of elements, x fastest, element after element."""
    reference = np.tile(gauss_places(BARLOW), element.size)
    return SolidPoints(
        points=reference,
        volume=np.zeros(reference.shape[1]),
        element=np.repeat(element, BARLOW**3),
        reference=reference,
    )


def _trilinear(reference: FloatArray) -> FloatArray:
    """Weights of the eight Gauss points at places ``(3, m)`` of elements, ``(m, 8)``."""
    low, high = gauss_places(BARLOW)[0, :BARLOW]
    share = (reference - low) / (high - low)
    x, y, z = (np.stack([1.0 - s, s], axis=-1) for s in share)
    return np.einsum("mk,mj,mi->mkji", z, y, x).reshape(-1, BARLOW**3)
