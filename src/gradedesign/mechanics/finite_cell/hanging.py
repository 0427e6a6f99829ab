"""Hanging nodes: those of small elements that follow the displacement of a large neighbour.

A small element's face covers a quarter of a large one's. Where the solid goes through, nodes at
the same place are one; the others take the quadratic function of the large face, so that
displacements are continuous (the constrained approximation of Demkowicz et al., Comput. Methods
Appl. Mech. Eng. 77, 1989, p. 79). Arrays of nodal values hold them behind the free nodes, and the
products with the stiffness set them.

For what is done element by element, a small element with hanging nodes has as many free ones: a
node that hangs across an edge of twice its length stands for the far node of that edge.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.mechanics.finite_cell.basis import quadratic
from gradedesign.mechanics.finite_cell.elements import Elements


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Hanging:
    """Nodes whose displacement follows from free ones; they are the last of all."""

    #: (h, N - h) sparse matrix. Values at hanging nodes from those at free ones.
    values: csr_matrix
    spread: csr_matrix  #: (N - h, h) sparse matrix. Its transpose.
    owner: IntArray  #: ``(h,)``. A large element that holds each.


def hanging_nodes(
    elements: Elements, nodes: NDArray[np.int32], place: NDArray[np.int32], held: IntArray
) -> tuple[NDArray[np.int32], IntArray, Hanging]:
    """Number hanging nodes behind the free ones.

    ``nodes (n, 27)``. ``place (N, 3)``: in halves of the grid's edges. ``held (h, 2)``: of
    `attach_small`. Returns ``nodes (n, 27)``; ``order (N,)``: earlier number of every node.
    """
    node, owner = nodes.ravel()[held[:, 0]], held[:, 1]
    hangs = np.zeros(len(place), dtype=bool)
    hangs[node] = True
    order = np.concatenate([np.flatnonzero(~hangs), np.flatnonzero(hangs)])
    number = np.zeros(len(place), np.int32)
    number[order] = np.arange(len(place))
    free = len(place) - len(node)
    nodes = number[nodes]
    within = place[node] - 2 * elements.position[owner]
    along = quadratic(np.arange(5) / 4.0)[0][within]
    weights = np.einsum("hk,hj,hi->hkji", along[:, 2], along[:, 1], along[:, 0]).reshape(-1, 27)
    row, slot = np.nonzero(weights)
    at = number[node] - free
    values = csr_matrix(
        (weights[row, slot], (at[row], nodes[owner[row], slot])), shape=(len(node), free)
    )
    of = np.zeros(len(node), np.int64)
    of[at] = owner
    return nodes, order, Hanging(values=values, spread=values.T.tocsr(), owner=of)


def fill_hanging(hanging: Hanging | None, u: NDArray[Any]) -> None:
    """Set the hanging rows of nodal values ``(N, 3)`` from the others."""
    if hanging is not None:
        free = hanging.values.shape[1]
        u[free:] = hanging.values @ u[:free]


def gather_hanging(hanging: Hanging | None, f: NDArray[Any]) -> None:
    """Move nodal forces ``(N, 3)`` at hanging nodes to those that they follow."""
    if hanging is not None:
        free = hanging.values.shape[1]
        f[:free] += hanging.spread @ f[free:]
        f[free:] = 0.0


def single_hanging(hanging: Hanging | None) -> Hanging | None:
    """Copy in single precision."""
    if hanging is None:
        return None
    return Hanging(
        values=hanging.values.astype(np.float32),
        spread=hanging.spread.astype(np.float32),
        owner=hanging.owner,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FreeNodes:
    """Free nodes of every element, and the values at its own nodes from theirs."""

    nodes: NDArray[np.int32]  #: ``(n, q)`` int32.
    kind: IntArray  #: ``(n,)``. 0 where no node hangs.
    #: ``(k, q, q)``. Of every kind: values at the nodes of the element from those at its free
    #: nodes.
    tables: FloatArray
    #: ``(k, q, 3)`` int8. Where the free nodes lie, in halves of the element's edges from its lower
    #: corner.
    far: NDArray[np.int8]


def free_nodes(elements: Elements, nodes: NDArray[np.int32], hanging: Hanging | None) -> FreeNodes:
    """Of quadratic elements, from all nodes ``(n, 27)``."""
    count = int(nodes.max()) + 1
    owner = np.full(count, -1)
    if hanging is not None:
        owner[count - len(hanging.owner) :] = hanging.owner
    slots = np.stack([np.arange(27) % 3, np.arange(27) // 3 % 3, np.arange(27) // 9], axis=1)
    # Outside end, middle of the large edge, far end: the values a quarter along it.
    return _free(elements, nodes, nodes, owner, slots, (3 / 8, 3 / 4, -1 / 8))


def free_corners(elements: Elements, nodes: NDArray[np.int32]) -> FreeNodes:
    """Of linear elements on the corners of quadratic ones, from all their nodes ``(n, 27)``.

    Corners of small elements hang where a large one has a node in the middle of an edge or a face.
    """
    slots = 2 * np.stack([np.arange(8) & 1, np.arange(8) >> 1 & 1, np.arange(8) >> 2], axis=1)
    corners = nodes[:, slots @ [1, 3, 9]]
    owner = np.full(int(nodes.max()) + 1, -1)
    large = np.flatnonzero(elements.size > 1)
    if len(large) and len(large) < len(nodes):
        between = np.setdiff1d(np.arange(27), slots @ [1, 3, 9])
        owner[nodes[np.ix_(large, between)]] = large[:, None]
    return _free(elements, corners, nodes, owner, slots, (0.5, 0.5, 0.0))


def _free(
    elements: Elements,
    own: NDArray[np.int32],
    nodes: NDArray[np.int32],
    owner: IntArray,
    slots: IntArray,
    weights: tuple[float, float, float],
) -> FreeNodes:
    """Free nodes of elements of any order.

    - ``own (n, q)``: nodes of the elements
    - ``nodes (n, 27)``: those of quadratic elements, to find far nodes
    - ``owner (N,)``: large element that holds each node that hangs, -1 for others
    - ``slots (q, 3)``: places of the nodes in the element, in halves of its edges
    - ``weights``: of the outer end, the middle and the far end of an edge for a node that hangs on
      it
    """
    count = slots.shape[0]
    kind = np.zeros(len(own), np.int64)
    hangs = (owner[own] >= 0) & (elements.size == 1)[:, None]
    rows = np.flatnonzero(hangs.any(axis=1))
    plain = slots.astype(np.int8)[None]
    if not len(rows):
        return FreeNodes(nodes=own, kind=kind, tables=np.eye(count)[None], far=plain)
    octant = elements.position[rows] & 1
    keys = np.concatenate([hangs[rows], octant], axis=1)
    distinct, which = np.unique(keys, axis=0, return_inverse=True)
    kind[rows] = 1 + which
    tables, far = [np.eye(count)], [plain[0]]
    for key in distinct:
        table, at = _kind(key[:count].astype(bool), key[count:], slots, weights)
        tables.append(table)
        far.append(at)
    free = FreeNodes(nodes=own.copy(), kind=kind, tables=np.stack(tables), far=np.stack(far))
    e, a = np.nonzero(hangs)
    large = owner[own[e, a]]
    place = 2 * elements.position[e] + free.far[kind[e], a]
    local = (place - 2 * elements.position[large]) // 2
    free.nodes[e, a] = nodes[large, local @ [1, 3, 9]]
    return free


def _kind(
    hangs: BoolArray, octant: IntArray, slots: IntArray, weights: tuple[float, float, float]
) -> tuple[FloatArray, NDArray[np.int8]]:
    """Values at the nodes of a small element from those at its free nodes, and their places."""
    count = len(slots)
    table = np.eye(count)
    far = slots.astype(np.int8)
    outer = np.where(octant == 0, 0, 2)
    for a in np.flatnonzero(hangs):
        # Places in the block of eight, from the end of its edge that the element holds.
        within = np.abs(slots[a] - outer)
        across = within == (1 if count == 27 else 2)
        table[a] = 0.0
        for b in range(count):
            from_end = np.abs(slots[b] - outer)
            middle = from_end == 2
            value = 1.0
            for axis in range(3):
                if not across[axis]:
                    value *= float(slots[a, axis] == slots[b, axis])
                elif from_end[axis] == 0:
                    value *= weights[0]
                elif count == 27:
                    value *= weights[1] if middle[axis] else weights[2]
                else:
                    value *= weights[1]
            table[a, b] = value
        far[a] = np.where(across, np.where(octant == 0, 4, -2), slots[a])
    return table, far
