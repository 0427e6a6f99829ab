"""Whether triangles of a file close, piece by piece: no corner has to be kept or sorted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_Words = NDArray[np.uint64]


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
    bits = np.ascontiguousarray(corners, dtype=np.float32) + np.float32(0.0)  # no negative zero
    words = bits.view(np.uint32).astype(np.uint64)
    key = _mixed(words[..., 0])
    for axis in (1, 2):
        key = _mixed(key + words[..., axis])
    start, end = key, np.roll(key, -1, axis=1)
    turn = np.uint64(0x9E3779B97F4A7C15)
    with np.errstate(over="ignore"):
        forward = _mixed(start * turn + end).sum(dtype=np.uint64)
        return int(forward - _mixed(end * turn + start).sum(dtype=np.uint64))


def _mixed(word: _Words) -> _Words:
    """Spread words over all bits: splitmix64 (Steele, Lea and Flood, OOPSLA 2014)."""
    with np.errstate(over="ignore"):
        word = word + np.uint64(0x9E3779B97F4A7C15)
        word = (word ^ (word >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        word = (word ^ (word >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        return np.asarray(word ^ (word >> np.uint64(31)))
