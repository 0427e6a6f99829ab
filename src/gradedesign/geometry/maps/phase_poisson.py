"""Poisson problems with natural boundaries on a grid of trilinear elements."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.fft import dctn, idctn

from gradedesign.arrays import FloatArray


def box_solver(shape: tuple[int, int, int], spacing: FloatArray) -> Callable[..., FloatArray]:
    """Direct solver on the whole box.

    Parameters
    ----------
    shape : (int, int, int)
        Nodes.
    spacing : (3,) array, mm

    Returns
    -------
    callable
        Loads ``(nx, ny, nz)`` that sum to 0, to the solution of mean 0 (weighted by the
        trapezoidal rule).

    Notes
    -----
    On a uniform line of linear elements with natural ends both the stiffness and the mass matrix,
    rows of the end nodes doubled, have the eigenvectors ``cos(pi k i / (n - 1))``; so the box is
    diagonalised by the type-1 cosine transform.
    """
    stiff, mass = [], []
    for count, h in zip(shape, spacing, strict=True):
        cosine = np.cos(np.pi * np.arange(count) / (count - 1))
        stiff.append((2 - 2 * cosine) / h)
        mass.append(h * (2 + cosine) / 3)
    (kx, ky, kz), (mx, my, mz) = stiff, mass
    eigen = (
        np.einsum("i,j,k->ijk", kx, my, mz)
        + np.einsum("i,j,k->ijk", mx, ky, mz)
        + np.einsum("i,j,k->ijk", mx, my, kz)
    )
    eigen[0, 0, 0] = np.inf  # the constant, which no load drives
    ends = [np.where(np.isin(np.arange(n), (0, n - 1)), 2.0, 1.0) for n in shape]
    doubled = np.einsum("i,j,k->ijk", *ends)

    def solve(load: FloatArray) -> FloatArray:
        return np.asarray(idctn(dctn(load * doubled, type=1) / eigen, type=1))

    return solve
