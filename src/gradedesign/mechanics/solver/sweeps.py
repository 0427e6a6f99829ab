"""Block Gauss-Seidel smoothing of the quadratic level, over half of its symmetric matrix.

A sweep upwards from zero also gives the residual and a sweep downwards after the coarse correction
makes the cycle symmetric: together they read the stored half twice, where Chebyshev's iteration of
two steps reads the whole matrix four times. Nodes are renumbered along Morton's curve, so that
pieces of consecutive nodes are compact and hardly couple to each other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.system.threads import in_ranges
from gradedesign.mechanics.solver import _sweep_kernels as kernels
from gradedesign.mechanics.solver._multigrid_kernels import inverse_diagonal
from gradedesign.mechanics.solver.block_rows import SingleArray

#: Nodes of a piece, which threads share. A gyroid sheet of 3.5 M unknowns takes 31 iterations at a
#: quarter of it, 30 at this size, and 28 in one piece.
PIECE = 65536
#: Entries of the half matrix from which threads pay: half as many as of a whole one.
THREADED = 1_500_000
#: Shifts and masks that put two zero bits between the lowest 20 bits of a number.
_SPREAD = (
    (32, 0x1F00000000FFFF), (16, 0x1F0000FF0000FF), (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3), (2, 0x1249249249249249),
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sweeps:
    """A symmetric matrix of 3 by 3 blocks, renumbered and split for sweeps."""

    order: NDArray[np.int32]  #: ``(n,)`` int32. Node at every new place.
    pieces: IntArray  #: ``(k + 1,)``. First place of every piece, and n.
    #: Start, column and blocks: the lower triangle inside pieces, and all between pieces.
    inner: kernels.Rows
    outer: kernels.Rows
    #: ``(n, 3, 3)`` float32. Inverted diagonal blocks, with `weakest` on their diagonal; zero where
    #: fixed.
    inverse: SingleArray
    #: ``(3 n,)`` float32. Half the row sums of the magnitudes of `outer`. On the diagonal they make
    #: the sweep converge whatever the pieces are (Baker, Falgout, Kolev and Yang, SIAM J. Sci.
    #: Comput. 33, 2011, p. 2864, section 5).
    weakest: SingleArray
    keep: SingleArray  #: ``(3 n,)`` float32. 0 on fixed unknowns, 1 elsewhere, in new places.


def build_sweeps(
    matrix: bsr_matrix, keep: FloatArray, nodes: FloatArray, piece: int = PIECE
) -> Sweeps:
    """Renumber and split a symmetric matrix.

    - ``matrix``: 3 by 3 blocks, symmetric
    - ``keep (3 n,)``: 0 on fixed unknowns, 1 elsewhere
    - ``nodes (3, n)``, mm
    - ``piece``: largest number of nodes of a piece
    """
    order = along_curve(nodes)
    count = max(1, -(-order.size // piece))
    pieces = np.linspace(0, order.size, count + 1).astype(np.int64)
    inner, outer, diagonal, weakest = kernels.split_rows(
        matrix.indptr.astype(np.int32, copy=False),
        matrix.indices.astype(np.int32, copy=False),
        np.ascontiguousarray(matrix.data, dtype=np.float64),
        keep,
        order,
        pieces,
    )
    diagonal.reshape(-1, 9)[:, ::4] += weakest.reshape(-1, 3)
    kept = np.ascontiguousarray(keep.reshape(-1, 3)[order]).ravel()
    own = np.arange(order.size + 1, dtype=np.int32)
    return Sweeps(
        order=order,
        pieces=pieces,
        inner=inner,
        outer=outer,
        inverse=inverse_diagonal(own, own[:-1], diagonal, kept),
        weakest=weakest,
        keep=kept.astype(np.float32),
    )


def along_curve(nodes: FloatArray) -> NDArray[np.int32]:
    """Order of nodes ``(3, n)`` along Morton's curve.

    By the interleaved bits of their coordinates, 20 each: G. M. Morton, A computer oriented
    geodetic data base, IBM, 1966.
    """
    low = nodes.min(axis=1)
    extent = float((nodes.max(axis=1) - low).max())
    size = extent / (2**20 - 1) if extent > 0.0 else 1.0
    keys = np.zeros(nodes.shape[1], np.uint64)
    for axis in range(3):
        bits = ((nodes[axis] - low[axis]) / size).astype(np.uint64)
        for shift, mask in _SPREAD:
            bits = (bits | (bits << np.uint64(shift))) & np.uint64(mask)
        keys |= bits << np.uint64(axis)
    return np.argsort(keys, kind="stable").astype(np.int32)


def sweep_up(s: Sweeps, f: SingleArray, x: SingleArray, y: SingleArray) -> None:
    """Set x to a sweep from zero for ``A x = f``, and y to the residual; all ``(k, 3 n)``."""
    _on_pieces(s, kernels.sweep_forward, s.inner, s.inverse, f, x, y)
    _on_pieces(s, kernels.take_outer, s.outer, s.weakest, x, y)


def sweep_down(s: Sweeps, f: SingleArray, x: SingleArray, y: SingleArray) -> None:
    """Improve x by the sweep in reverse order; y is scratch."""
    np.copyto(y, f)
    _on_pieces(s, kernels.take_outer, s.outer, s.weakest, x, y)
    _on_pieces(s, kernels.sweep_backward, s.inner, s.inverse, x, y)


def _on_pieces(s: Sweeps, kernel: Callable[..., None], *arguments: Any) -> None:
    """Call a kernel for all pieces."""
    pieces = range(s.pieces.size - 1)
    in_ranges(kernel, pieces, s.pieces, *arguments, threaded=s.inner[2].size >= THREADED)
