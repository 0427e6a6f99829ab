"""Check that triangles of a file close, piece by piece: no corner has to be stored or sorted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gradedesign.geometry.triangles._triangle_kernels import directed_balance


def edge_balance(corners: NDArray[np.floating]) -> int:
    """Sum of a hash over the directed edges of triangles, less that over the reversed edges.

    Sums of pieces add up modulo 2^64. The sum over a surface is 0 where every edge is passed as
    often in one direction as in the other: it is closed and consistently oriented. Any other
    surface has 0 with a probability of 2^-64.

    Parameters
    ----------
    corners : (m, 3, 3) array
        Triangle, corner, coordinate; equal corners are the same float32.

    Examples
    --------
    >>> a, b, c, d = np.eye(4)[:, :3]
    >>> edge_balance(np.array([[b, a, c], [a, b, d], [b, c, d], [c, a, d]]))
    0
    >>> edge_balance(np.array([[a, b, c], [a, b, d], [b, c, d], [c, a, d]])) != 0
    True
    """
    exact = np.ascontiguousarray(corners, dtype=np.float32) + np.float32(0.0)  # no negative zero
    return int(directed_balance(exact.view(np.uint32)))
