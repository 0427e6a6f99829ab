"""Values of compiled kernels at points of any shape, in threads."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.system.threads import in_ranges

#: Points that are worth a thread: 0.1 ms of work. Chosen, not measured.
_POINTS = 4096


def compiled_values(
    kernel: Callable[..., object], u: FloatArray, *arguments: Any, channels: int | None = None
) -> FloatArray:
    """Evaluate a compiled kernel at points.

    Parameters
    ----------
    kernel : callable
        ``kernel(low, high, points, *arguments, value)`` of ``numba.njit(nogil=True)``, not parallel
        itself: writes into ``value (n,)``, or ``(channels, n)``, for ``points (3, n)`` from number
        low to before high, what depends on no other point.
    u : (3, ...) array
    *arguments
        As the kernel takes them.
    channels : int, optional
        Values at each point; one without it.

    Returns
    -------
    (...) or (channels, ...) array
        Float32 for points in float32, else float64.

    Examples
    --------
    >>> from numba import njit
    >>> @njit(nogil=True)
    ... def doubled(low, high, points, value):
    ...     for k in range(low, high):
    ...         value[k] = 2.0 * points[0, k]
    >>> compiled_values(doubled, np.array([[1.0, 2.0], [0.0, 0.0], [0.0, 0.0]])).tolist()
    [2.0, 4.0]
    """
    points = np.asarray(u)
    kind = points.dtype if points.dtype == np.float32 else np.dtype(np.float64)
    flat = np.ascontiguousarray(points.reshape(3, -1), dtype=kind)
    ahead = () if channels is None else (channels,)
    value: FloatArray = np.zeros((*ahead, flat.shape[1]), dtype=kind)
    in_ranges(kernel, range(0, flat.shape[1], _POINTS), flat, *arguments, value)
    return value.reshape((*ahead, *points.shape[1:]))
