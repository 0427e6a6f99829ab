"""Shape checks and locking of arrays; the sign and order conventions of the project.

Conventions
-----------
Evaluated quantities are components-first: points ``(3, ...)``, stress ``(3, 3, ...)``.
Stored surface meshes are ``(n, 3)``. Implicit fields are negative inside the solid.
Voigt order is xx, yy, zz, yz, xz, xy with engineering shear.
Units are mm, N, MPa, t/mm^3.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]

#: An implicit field: points (3, ...) in mm (or cell units) to values (...), negative inside.
Field: TypeAlias = Callable[[FloatArray], FloatArray]

#: Place in a Voigt vector of every component of a symmetric tensor.
VOIGT = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])
#: Places in a tensor of the Voigt components.
VOIGT_PLACES = ((0, 1, 2, 1, 0, 0), (0, 1, 2, 2, 2, 1))
#: How often a Voigt component stands in its tensor; over it an engineering strain is the tensor's.
VOIGT_COUNTS = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LipschitzField:
    """An implicit field whose slope has a known bound, called as any other field.

    Attributes
    ----------
    values : callable
        Points ``(3, ...)`` in mm to values ``(...)``, negative inside.
    constant : float
        ``|f(a) - f(b)| <= constant |a - b|`` for any two points: 1 of a signed distance in mm.
    """

    values: Field
    constant: float

    def __call__(self, points: FloatArray) -> FloatArray:
        """Values at points."""
        return self.values(points)


def locked(
    value: ArrayLike,
    shape: tuple[int | None, ...],
    *,
    dtype: type | np.dtype[Any] = np.float64,
    name: str = "array",
) -> NDArray[Any]:
    """A read-only array that nobody else writes to, its shape checked.

    Parameters
    ----------
    value : array_like
        Values to store.
    shape : tuple of int or None
        Expected shape; ``None`` accepts any length on that axis.
    dtype : dtype
        Stored type.
    name : str
        Used in the error message.

    Returns
    -------
    array
        C-contiguous, with ``writeable = False``: a copy, or the array itself where it owns its
        memory and is locked already.

    Raises
    ------
    ValueError
        If the shape differs, or a float array holds NaN or infinity.
    """
    is_locked = isinstance(value, np.ndarray) and value.flags.owndata and not value.flags.writeable
    array = np.array(value, dtype=dtype, order="C", copy=None if is_locked else True)
    if array.ndim != len(shape) or any(
        expected is not None and expected != size
        for expected, size in zip(shape, array.shape, strict=True)
    ):
        raise ValueError(f"{name} has shape {array.shape}, expected {shape} (None = any)")
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        bad = int(np.count_nonzero(~np.isfinite(array)))
        raise ValueError(f"{name} holds {bad} values that are not finite")
    array.flags.writeable = False
    return array


def lock(
    record: object, *, dtype: type | np.dtype[Any] = np.float64, **shapes: tuple[int | None, ...]
) -> None:
    """Lock arrays of a frozen record as it is made, each of its shape, see `locked`."""
    for name, shape in shapes.items():
        array = locked(getattr(record, name), shape, dtype=dtype, name=name)
        object.__setattr__(record, name, array)


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """A contiguous read-only view, or copy where it is not contiguous.

    Kernels are compiled for every combination of layouts and permissions that they meet, which
    takes seconds each: what hands on arrays of callers hands on one.
    """
    view = np.ascontiguousarray(array).view()
    view.flags.writeable = False
    return view


def plain_vector(vector: FloatArray) -> list[float]:
    """A vector as plain floats, rounded to nine figures of its largest entry."""
    top = float(np.abs(vector).max(initial=0.0))
    digits = 9 if top == 0.0 else int(8 - np.floor(np.log10(top)))
    return [round(float(v), digits) + 0.0 for v in np.asarray(vector)]
