"""Rotation of stresses and stiffnesses in Voigt order."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import VOIGT_PLACES, FloatArray


def bond_matrix(rotation: FloatArray) -> FloatArray:
    """Stress transformation of Voigt vectors, ``(6, 6, ...)``, so that ``C' = M C M^T``.

    ``rotation (3, 3, ...)``: takes cell components to global ones, ``x' = R x``.

    References
    ----------
    W. L. Bond, Proc. Phys. Soc. 1943.
    """
    pairs = tuple(zip(*VOIGT_PLACES, strict=True))
    r = np.asarray(rotation, dtype=np.float64)
    m = np.zeros((6, 6, *r.shape[2:]))
    for a, (i, j) in enumerate(pairs):
        for b, (p, q) in enumerate(pairs):
            m[a, b] = r[i, p] * r[j, q] if p == q else r[i, p] * r[j, q] + r[i, q] * r[j, p]
    return m
