"""Rigid motions: their basis, and which of them the supports leave free.

A body without enough supports makes the stiffness singular, and a solver may return nonsense for
it without complaint. So every connected piece of the mesh is checked before solving: the six rigid
motions, seen by its fixed components only, must be independent.
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

#: Squared sine below which directions count as dependent: supports 1e-5 of their spread apart.
DEPENDENT = 1e-10
#: Pieces named in an error message. Chosen, not measured.
NAMED_PIECES = 4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FreePiece:
    """A connected piece of the mesh that can move without strain.

    Attributes
    ----------
    number : int
        Counted from 1, the largest piece first.
    volume_share : float
        Share of the volume of the mesh.
    centroid : (3,) array, mm
        Mean of its nodes.
    modes : tuple of str
        What it is free to do.
    """

    number: int
    volume_share: float
    centroid: FloatArray
    modes: tuple[str, ...]


def rigid_body_modes(points: FloatArray) -> FloatArray:
    """Three translations and three rotations about the centre of the points.

    Rotations are scaled to the size of the point set, so that all six are of like length.

    Parameters
    ----------
    points : (3, n) array, mm

    Returns
    -------
    (n, 3, 6) array
        Displacement of every point in every mode.
    """
    x, y, z = points - points.mean(axis=1, keepdims=True)
    size = float(np.sqrt((x**2 + y**2 + z**2).mean())) or 1.0
    modes = np.zeros((points.shape[1], 3, 6))
    modes[:, range(3), range(3)] = 1.0
    modes[:, 1, 3], modes[:, 2, 3] = -z / size, y / size
    modes[:, 0, 4], modes[:, 2, 4] = z / size, -x / size
    modes[:, 0, 5], modes[:, 1, 5] = -y / size, x / size
    return modes


def connected_pieces(space: TetSpace) -> IntArray:
    """Number of the connected piece of every node, ``(n,)``; pieces that share a node are one."""
    first, rest = space.elements[:1], space.elements[1:]
    i = np.broadcast_to(first, rest.shape).ravel()
    j = rest.ravel()
    n = space.node_count
    graph = coo_array((np.ones(i.size, np.int8), (i, j)), shape=(n, n))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def free_pieces(space: TetSpace, fixed: BoolArray) -> tuple[FreePiece, ...]:
    """Pieces of the mesh that the supports leave free to move as rigid bodies.

    Parameters
    ----------
    space : TetSpace
    fixed : (3, n) bool array
        Components with a prescribed displacement.

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

    Raises
    ------
    SolverError
        Naming the load case, the pieces and the motions they are free to make.
    """
    free = free_pieces(space, fixed)
    if not free:
        return
    lines = [
        f"piece {p.number} ({100 * p.volume_share:.3g} % of the volume, around "
        f"{_triple(p.centroid)} mm) is {'; '.join(p.modes)}"
        for p in free[:NAMED_PIECES]
    ]
    more = len(free) - len(lines)
    rest = f"; and {more} more pieces" if more > 0 else ""
    raise SolverError(
        f"load case '{name}': the supports leave rigid motions free: {'. '.join(lines)}{rest}. "
        f"Fix more faces or components, or remove disconnected components from the mesh"
    )


def free_modes(points: FloatArray, fixed: BoolArray) -> tuple[str, ...]:
    """Describe the rigid motions of one piece that its supports leave free.

    Parameters
    ----------
    points : (3, n) array, mm
    fixed : (3, n) bool array
        Components with a prescribed displacement.

    Returns
    -------
    tuple of str
        Empty where the piece is held.
    """
    if not fixed.any():
        return ("without any support",)
    fixed_points = points[:, fixed.any(axis=0)]
    centre = fixed_points.mean(axis=1)
    modes = rigid_body_modes(fixed_points)
    seen = modes[fixed[:, fixed.any(axis=0)].T]
    values, vectors = np.linalg.eigh(seen.T @ seen / len(seen))
    null = vectors[:, values < DEPENDENT * values[-1]]
    size = float(np.sqrt(((fixed_points - centre[:, None]) ** 2).sum(axis=0).mean())) or 1.0
    return _describe(null, size, centre)


def _describe(null: FloatArray, size: float, centre: FloatArray) -> tuple[str, ...]:
    """Name a space of motions: columns are a shift, then a turn times `size`, about `centre`."""
    if null.shape[1] == 0:
        return ()
    shift, turn = null[:3], null[3:]
    _, singular, right = np.linalg.svd(turn)
    rank = int((singular > 1e-6).sum())
    slides = _reduced(shift @ right[rank:].T)
    named = [f"free to translate along {_direction(t)}" for t in slides.T]
    turns = _reduced(np.concatenate([turn @ right[:rank].T, shift @ right[:rank].T]))
    for column in turns.T:
        w, t = column[:3] / size, column[3:]
        if slides.size:
            t = t - slides @ np.linalg.lstsq(slides, t, rcond=None)[0]
        point = centre + np.cross(w, t) / (w @ w)
        named.append(
            f"free to rotate about an axis through {_triple(point)} mm along {_direction(w)}"
        )
    return tuple(named)


def _reduced(basis: FloatArray) -> FloatArray:
    """Equivalent basis with as many zeros as elimination gives, to recognise axes."""
    rows = basis.T.copy()
    count = len(rows)
    done = 0
    for column in range(rows.shape[1]):
        if done == count:
            break
        best = done + int(np.argmax(np.abs(rows[done:, column])))
        if abs(rows[best, column]) < 1e-6 * np.abs(rows).max():
            continue
        rows[[done, best]] = rows[[best, done]]
        rows[done] /= rows[done, column]
        for row in range(count):
            if row != done:
                rows[row] -= rows[row, column] * rows[done]
        done += 1
    return rows[:done].T


def _direction(vector: FloatArray) -> str:
    """``x``, ``y``, ``z`` or a unit vector."""
    unit = vector / np.linalg.norm(vector)
    axis = int(np.argmax(np.abs(unit)))
    if abs(unit[axis]) > 1.0 - 1e-6:
        return "xyz"[axis]
    return _triple(unit)


def _triple(vector: FloatArray) -> str:
    """Three figures in brackets; rounding noise is shown as 0."""
    quiet = np.where(np.abs(vector) < 1e-6 * np.abs(vector).max(initial=0.0), 0.0, vector)
    return "({:.4g}, {:.4g}, {:.4g})".format(*quiet)
