"""Poisson problems with natural boundaries on a grid of trilinear elements."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.fft import dctn, idctn

from gradedesign.arrays import FloatArray
from gradedesign.errors import SolverError
from gradedesign.geometry.maps._phase_kernels import apply_stiffness

#: Of the loads, in the norm of the preconditioner; phases are then right to about 1e-4 of a cell.
#: Chosen, not measured.
RTOL = 1e-5
#: Iterations after which a solve is given up. Chosen, not measured.
_ITERATIONS = 500


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


def element_stiffness(spacing: FloatArray) -> FloatArray:
    """Laplacian of one trilinear element, corners by corners, ``(2, 2, 2, 2, 2, 2)``."""
    stiff = [np.array([[1.0, -1.0], [-1.0, 1.0]]) / h for h in spacing]
    mass = [h * np.array([[2.0, 1.0], [1.0, 2.0]]) / 6 for h in spacing]
    return np.asarray(
        np.einsum("ap,bq,cr->abcpqr", stiff[0], mass[1], mass[2])
        + np.einsum("ap,bq,cr->abcpqr", mass[0], stiff[1], mass[2])
        + np.einsum("ap,bq,cr->abcpqr", mass[0], mass[1], stiff[2])
    )


def solve_weighted(
    load: FloatArray,
    weight: FloatArray,
    start: FloatArray,
    spacing: FloatArray,
    solve_box: Callable[[FloatArray], FloatArray],
) -> FloatArray:
    """Solve ``div(w grad(phase)) = div(w target)`` with weights, some of which may be 0.

    Parameters
    ----------
    load : (nx, ny, nz) array
        Of elements with their weights, see
        :func:`gradedesign.geometry.maps._phase_kernels.divergence`.
    weight : (ex, ey, ez) array
        0 to 1.
    start : (nx, ny, nz) array
        First guess. Where all weights are 0 the result continues the change from it harmonically.
    spacing : (3,) array, mm
    solve_box : callable
        Of :func:`box_solver`, the preconditioner.

    Returns
    -------
    (nx, ny, nz) array

    Raises
    ------
    SolverError
        If conjugate gradients do not converge.

    Notes
    -----
    With weights 0 and 1 the preconditioned operator has the eigenvalue 0 on fields that vanish
    inside, which no load drives, and else eigenvalues between a constant of the part's shape and
    1, whatever the grid: the number of iterations does not grow with it.
    """
    element = element_stiffness(spacing)
    x = start.copy()
    residual = load - apply_stiffness(x, weight, element)
    aim = RTOL * np.sqrt(max(float((load * solve_box(load)).sum()), 0.0))
    z = solve_box(residual)
    direction = z
    square = float((residual * z).sum())
    for _ in range(_ITERATIONS):
        if np.sqrt(max(square, 0.0)) <= aim:
            return x
        pushed = apply_stiffness(direction, weight, element)
        step = square / float((direction * pushed).sum())
        x += step * direction
        residual -= step * pushed
        z = solve_box(residual)
        before, square = square, float((residual * z).sum())
        direction = z + (square / before) * direction
    raise SolverError(
        f"phase fields did not converge in {_ITERATIONS} iterations (residual "
        f"{np.sqrt(square):.3g}, wanted {aim:.3g}); solve over the whole box instead of inside "
        f"the part"
    )
