"""Pieces of a mesh that the supports leave free to move as rigid bodies.

A body without enough supports makes the stiffness singular, and a solver may return nonsense for
it without complaint. So every connected piece of the mesh is checked before solving.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.errors import SolverError
from gradedesign.geometry.tets.tet_mesh import signed_volumes
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.solver.rigid_modes import free_modes, triple_words

#: Pieces named in an error message. Chosen, not measured.
_NAMED_PIECES = 4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FreePiece:
    """A connected piece of the mesh that can move without strain."""

    number: int  #: Counted from 1, the largest piece first.
    volume_share: float  #: Share of the volume of the mesh.
    centroid: FloatArray  #: ``(3,)``, mm. Mean of its nodes.
    modes: tuple[str, ...]  #: What it is free to do.


def connected_pieces(space: TetSpace, among: BoolArray | None = None) -> IntArray:
    """Number of the connected piece of every node, ``(n,)``; pieces that share a node are one.

    ``among (M,)``: tetrahedra that connect; a node of none of them is a piece by itself.
    """
    elements = space.elements if among is None else space.elements[:, among]
    first, rest = elements[:1], elements[1:]
    i = np.broadcast_to(first, rest.shape).ravel()
    j = rest.ravel()
    n = space.node_count
    graph = coo_array((np.ones(i.size, np.int8), (i, j)), shape=(n, n))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def free_pieces(space: TetSpace, fixed: BoolArray) -> tuple[FreePiece, ...]:
    """Pieces of the mesh that the supports leave free to move as rigid bodies.

    ``fixed (3, n)``: components with a prescribed displacement.

    Returns
    -------
    tuple of FreePiece
        Empty if every piece is held; the largest first.
    """
    piece = connected_pieces(space)
    volume = np.bincount(piece[space.elements[0]], weights=signed_volumes(space.mesh))
    order = np.argsort(-volume, kind="stable")
    free = []
    by_piece = np.argsort(piece, kind="stable")
    ends = np.cumsum(np.bincount(piece))
    for number, k in enumerate(order, start=1):
        nodes = by_piece[ends[k - 1] if k else 0 : ends[k]]
        modes = free_modes(space.nodes[:, nodes], fixed[:, nodes])
        if modes:
            free.append(
                FreePiece(
                    number=number,
                    volume_share=float(volume[k] / volume.sum()),
                    centroid=space.nodes[:, nodes].mean(axis=1),
                    modes=modes,
                )
            )
    return tuple(free)


def require_held(space: TetSpace, fixed: BoolArray, name: str) -> None:
    """Raise unless the supports hold every piece of the mesh.

    Raises `SolverError` naming the load case, the pieces and the motions they are free to make.
    """
    free = free_pieces(space, fixed)
    if not free:
        return
    lines = [
        f"piece {p.number} ({100 * p.volume_share:.3g} % of the volume, around "
        f"{triple_words(p.centroid)} mm) is {'; '.join(p.modes)}"
        for p in free[:_NAMED_PIECES]
    ]
    more = len(free) - len(lines)
    rest = f"; and {more} more pieces" if more > 0 else ""
    raise SolverError(
        f"load case '{name}': the supports leave rigid motions free: {'. '.join(lines)}{rest}. "
        f"Fix more faces or components, or remove disconnected components from the mesh"
    )
