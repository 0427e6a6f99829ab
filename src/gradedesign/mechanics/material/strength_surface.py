"""Strength surface: the local stress in a cell as a function of the whole macroscopic stress."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from itertools import permutations, product

import numpy as np

from gradedesign.arrays import FloatArray, lock, locked
from gradedesign.errors import PluginError
from gradedesign.mechanics.material.bond_matrix import bond_matrix


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StrengthSurface:
    """A norm of the macroscopic stress that stands for the local stress of a cell.

    ``s(sigma)^m = sum_k w_k mean_R (sigma . Q_k(R) . sigma)^(m / 2)`` over the rotations R of the
    cell's symmetry, with every ``Q_k`` the von Mises form of one point of the cell. It is convex,
    of degree one, positive wherever some form is, and symmetric as the cell is.
    """

    exponent: int  #: ``m``, even.
    weights: FloatArray  #: ``(k,)``. Not negative.
    #: ``(k, 6, 6)``. Symmetric, positive semi-definite, on Voigt stresses xx, yy, zz, yz, xz, xy.
    forms: FloatArray
    symmetry: str  #: ``cubic``, ``tetragonal`` (about z), ``orthotropic`` or ``none``.
    #: Relative, over directions that the fit has not seen.
    max_error: float
    rms_error: float
    unsafe_error: float  #: Largest relative amount by which it is too low there.
    percentile: float  #: By volume, of the local von Mises stress it stands for.
    #: ``(2, t)``. Percentages of the cell's solid and the local stress at these percentiles over
    #: that at ``percentile``, mean over directions; both increasing. Empty where it is not known.
    distribution: FloatArray = field(default_factory=lambda: np.zeros((2, 0)))

    def __post_init__(self) -> None:
        k = np.asarray(self.weights).size
        spread = locked(self.distribution, (2, None), name="distribution")
        object.__setattr__(self, "distribution", spread)
        if (np.diff(spread, axis=1) <= 0).any() or (spread <= 0).any() or (spread[0] >= 100).any():
            raise ValueError(
                f"a distribution of local stress needs increasing percentages between 0 and 100 "
                f"and increasing positive stresses, found {spread.tolist()}"
            )
        lock(self, weights=(k,), forms=(k, 6, 6))
        if self.exponent < 2 or self.exponent % 2 or (self.weights < 0).any():
            raise ValueError(
                f"a strength surface needs an even exponent and weights of 0 or more, found "
                f"{self.exponent} and {self.weights.tolist()}"
            )

    def local_stress(self, stress: FloatArray) -> FloatArray:
        """Percentile of the local von Mises stress.

        ``stress (6, ...)``: macroscopic Voigt stress in the cell's axes. Returns ``(...)``: in the
        unit of ``stress``.
        """
        terms = symmetric_powers(self.forms, stress, self.exponent, self.symmetry)
        return np.asarray(np.tensordot(self.weights, terms, axes=1) ** (1 / self.exponent))

    def slope(self, stress: FloatArray) -> FloatArray:
        """Derivative of the local stress by the macroscopic one, ``(6, ...)``.

        Zero where there is no stress.
        """
        # Here, so that importing the package does not load numba.
        from gradedesign.common.system.threads import in_ranges
        from gradedesign.mechanics.material._strength_kernels import CHUNK, power_slopes

        entries, flat = _kernel_arguments(self.forms, stress, self.symmetry)
        # Of a multiple of the stress, of degree 0: its powers neither overflow nor vanish.
        largest = np.abs(flat).max(axis=0, initial=0.0)
        flat = flat / np.where(largest > 0, largest, 1.0)
        slope = np.zeros(flat.shape)
        numbers = range(0, flat.shape[1], CHUNK)
        in_ranges(power_slopes, numbers, entries, self.weights, flat, self.exponent // 2, slope)
        return np.asarray(slope.reshape(stress.shape))


def symmetric_powers(
    forms: FloatArray, stress: FloatArray, exponent: int, symmetry: str
) -> FloatArray:
    """Mean over a symmetry group of ``(sigma . Q . sigma)^(exponent / 2)``.

    ``forms (k, 6, 6)``. ``stress (6, ...)``. Returns ``(k, ...)``.
    """
    # Here, so that importing the package does not load numba.
    from gradedesign.common.system.threads import in_ranges
    from gradedesign.mechanics.material._strength_kernels import CHUNK, mean_powers

    entries, flat = _kernel_arguments(forms, stress, symmetry)
    mean = np.zeros((len(forms), flat.shape[1]))
    in_ranges(mean_powers, range(0, flat.shape[1], CHUNK), entries, flat, exponent // 2, mean)
    return np.asarray(mean.reshape(forms.shape[0], *np.shape(stress)[1:]))


def _kernel_arguments(
    forms: FloatArray, stress: FloatArray, symmetry: str
) -> tuple[FloatArray, FloatArray]:
    """Upper triangles of the turned forms ``(turns, k, 21)``, and stresses ``(6, n)``."""
    turns = _stress_turns(symmetry)
    upper = np.triu_indices(6)
    factor = np.where(upper[0] == upper[1], 1.0, 2.0)
    # Turned forms instead of turned stresses: they are turned once for all points.
    turned = np.einsum("tca,kcd,tdb->tkab", turns, forms, turns, optimize=True)
    entries = np.ascontiguousarray(turned[:, :, upper[0], upper[1]] * factor)
    return entries, np.ascontiguousarray(np.asarray(stress, dtype=np.float64).reshape(6, -1))


@cache
def _stress_turns(symmetry: str) -> FloatArray:
    """Matrices ``(r, 6, 6)`` of the proper rotations of a symmetry, on Voigt stresses."""
    turns = []
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            r = np.zeros((3, 3))
            r[range(3), order] = signs
            if np.linalg.det(r) > 0 and _belongs(r, symmetry):
                turns.append(bond_matrix(r))
    # Turns that act alike on stresses are counted once.
    unique: list[FloatArray] = []
    for m in turns:
        if not any(np.array_equal(m, n) for n in unique):
            unique.append(m)
    return locked(np.stack(unique), (None, 6, 6), name="rotations")


def _belongs(r: FloatArray, symmetry: str) -> bool:
    """Whether a rotation of the cube is one of a lower symmetry."""
    if symmetry == "cubic":
        return True
    if symmetry == "tetragonal":
        return abs(float(r[2, 2])) == 1.0
    if symmetry == "orthotropic":
        return bool((np.abs(np.diag(r)) == 1.0).all())
    if symmetry == "none":
        return bool((np.diag(r) == 1.0).all())
    raise PluginError(
        f"symmetry '{symmetry}' is unknown; expected cubic, tetragonal, orthotropic or none"
    )
