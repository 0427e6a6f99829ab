"""The independent constants of a stiffness, and what is known of each in a property table."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.material.property_table import PropertyTable

#: Entries below this share of the largest are zero but for noise.
_NOTHING = 1e-3

_Entries = tuple[tuple[int, int], ...]
#: Entries of the matrix in Voigt order that cubic symmetry makes equal.
_CUBIC: Mapping[str, _Entries] = {
    "C11": ((0, 0), (1, 1), (2, 2)),
    "C12": ((0, 1), (0, 2), (1, 2)),
    "C44": ((3, 3), (4, 4), (5, 5)),
}
_NORMAL_SHEAR = ("C11", "C22", "C33", "C12", "C13", "C23", "C44", "C55", "C66")


def independent_entries(symmetry: str) -> Mapping[str, _Entries]:
    """Names of the constants of a stiffness, and where each stands in the matrix.

    Three under cubic symmetry; nine, ``C11`` to ``C66``, under tetragonal and orthotropic symmetry
    about the axes; else all twenty-one.

    ``symmetry``: ``cubic``, ``tetragonal``, ``orthotropic`` or ``none``.

    Examples
    --------
    >>> list(independent_entries("cubic"))
    ['C11', 'C12', 'C44']
    """
    if symmetry == "cubic":
        return _CUBIC
    every = {f"C{i + 1}{j + 1}": ((i, j),) for i in range(6) for j in range(i, 6)}
    return every if symmetry == "none" else {name: every[name] for name in _NORMAL_SHEAR}


def relative_errors(
    stiffness: FloatArray, uncertainty: FloatArray, symmetry: str
) -> dict[str, FloatArray]:
    """Relative error of every elastic constant: its largest uncertainty over its mean value.

    The error of a constant is NaN in rows where it is below a thousandth of the largest constant;
    constants for which every row is NaN are left out. Returns each ``(k,)``.

    ``stiffness (k, 6, 6)``, ``uncertainty (k, 6, 6)``: in one unit.

    Examples
    --------
    >>> stiffness, off = np.ones((2, 6, 6)), np.full((2, 6, 6), 0.02)
    >>> {k: v.round(3).tolist() for k, v in relative_errors(stiffness, off, "cubic").items()}
    {'C11': [0.02, 0.02], 'C12': [0.02, 0.02], 'C44': [0.02, 0.02]}
    """
    least = _NOTHING * np.abs(stiffness).max(axis=(1, 2))
    errors = {}
    for name, entries in independent_entries(symmetry).items():
        i, j = np.transpose(entries)
        value = np.abs(stiffness[:, i, j]).mean(axis=1)
        error = np.full(value.shape, np.nan)
        np.divide(uncertainty[:, i, j].max(axis=1), value, out=error, where=value > least)
        if not np.isnan(error).all():
            errors[name] = error
    return errors


def constant_errors(table: PropertyTable) -> dict[str, FloatArray]:
    """`relative_errors` of a table at each of its densities; empty if it states none."""
    if table.uncertainty is None:
        return {}
    return relative_errors(table.stiffness, table.uncertainty, table.symmetry)
