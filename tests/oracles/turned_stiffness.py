"""Moduli of a stiffness in turned axes, from the definition."""

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import SolverError


def stress_rotation(rotation: FloatArray) -> FloatArray:
    """Matrix ``(6, 6)`` that turns Voigt stresses: components along the columns to global ones.

    Parameters
    ----------
    rotation : (3, 3) array
        Columns are the local axes in global coordinates.
    """
    r = rotation
    pairs = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
    m = np.zeros((6, 6))
    for a, (i, j) in enumerate(pairs):
        for b, (k, p) in enumerate(pairs):
            m[a, b] = r[i, k] * r[j, p] + (r[i, p] * r[j, k] if k != p else 0.0)
    return m


def rotated_stiffness(stiffness: FloatArray, rotation: FloatArray) -> FloatArray:
    """Stiffness in global axes of a cell whose axes are the columns of ``rotation``.

    Raises
    ------
    SolverError
        If the matrix is not a rotation.
    """
    r = np.asarray(rotation, dtype=np.float64)
    if r.shape != (3, 3) or not np.allclose(r.T @ r, np.eye(3), atol=1e-9):
        raise SolverError(f"{r.tolist()} is not a rotation matrix; its columns must be unit axes")
    m = stress_rotation(r)
    return np.asarray(m @ stiffness @ m.T)


def shear_and_poisson(
    stiffness: FloatArray, direction: FloatArray, across: FloatArray
) -> tuple[float, float]:
    """Shear modulus in the plane of two directions, and contraction across under tension along.

    Parameters
    ----------
    stiffness : (6, 6) array
    direction, across : (3,) arrays
        Orthogonal.
    """
    n, m = direction / np.linalg.norm(direction), across / np.linalg.norm(across)
    if abs(float(n @ m)) > 1e-9:
        raise SolverError(f"directions {n.tolist()} and {m.tolist()} are not orthogonal")
    s = np.linalg.inv(stiffness)
    frame = stress_rotation(np.stack([n, m, np.cross(n, m)], axis=1))
    local = frame.T @ s @ frame
    return float(1 / local[5, 5]), float(-local[0, 1] / local[0, 0])
