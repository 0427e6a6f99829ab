"""Groups of nodes that only badly cut elements hold, solved together when smoothing.

Where a surface leaves slivers of elements, quadratic functions become nearly dependent there and
the diagonal says nothing of it: iterations would depend on how the grid is cut. The nodes that no
well filled element holds are therefore relaxed element by element with the inverse of their whole
stiffness, an additive Schwarz method (de Prenter et al., Comput. Methods Appl. Mech. Eng. 350,
2019, p. 237; Jomo et al., Comput. Methods Appl. Mech. Eng. 378, 2021, 113740).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.common.system.threads import in_ranges
from gradedesign.mechanics.finite_cell import _patch_kernels as kernels
from gradedesign.mechanics.finite_cell.basis import (
    CUT_POINTS,
    gauss_places,
    gauss_weights,
    gradients_at,
    point_stiffness,
)
from gradedesign.mechanics.finite_cell.elements import Elements, solid_fraction, sorted_by_colour
from gradedesign.mechanics.finite_cell.hanging import FreeNodes
from gradedesign.mechanics.finite_cell.operator import Operator
from gradedesign.mechanics.finite_cell.space import BrickSpace

#: A node is weak if no element that holds it has a larger share of solid. On a gyroid sheet with
#: one to two elements across the wall: 0.1, 0.25, 0.5 and 0.9 take 109, 61, 32 and 25 iterations
#: and 1, 3, 6 and 24 kB an element as full matrices.
_WEAK = 0.5
#: Share of the patches' corrections that is taken: neighbouring patches overlap. Chosen, not
#: measured.
OVERLAP = 0.5
#: Bricks along the edge of the blocks in which patches are assembled together. Chosen, not
#: measured.
BLOCK = 8
#: How far elements that share a node lie apart on a refined grid, in its bricks: from a small
#: element to a large one before it, whose node it follows. Otherwise one.
REACH = 3
#: Added to the diagonal of matrices scaled to a diagonal of 1: what single precision resolves.
SHIFT = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Patches:
    """Inverted matrices of the weak nodes of elements."""

    nodes: NDArray[np.int32]  #: ``(n, 27)`` int32. Free nodes of every element.
    weak: BoolArray  #: ``(N,)``.
    chosen: IntArray  #: ``(k,)``. Elements with weak nodes, by colour.
    colours: IntArray  #: ``(c + 1,)``.
    begin: IntArray  #: ``(k + 1,)``. First entry of each element's factor in `rows`.
    first: IntArray  #: ``(k + 1,)``. Its first unknown in `scale` and `height`.
    #: ``(u,)`` float32. Inverted roots of the diagonals, zero for fixed unknowns.
    scale: NDArray[np.float32]
    height: NDArray[np.float32]  #: ``(u,)`` float32. Square of the step of each row of the factors.
    #: ``(total,)`` int8. Inverted Cholesky factors, rows up to the diagonal: a quarter of the
    #: memory of inverses in single precision, symmetric and positive definite however they are
    #: rounded. Iterations on gyroid sheets are as many with 16 bits (20 at density 0.3; 22 at 0.15,
    #: where two in three elements hold weak nodes).
    rows: NDArray[np.int8]


def build_patches(
    elements: Elements,
    space: BrickSpace,
    free: FreeNodes,
    stiffness: Operator,
    softness: float,
    keep: NDArray[np.float32],
) -> Patches | None:
    """Assemble and invert the patches; None if no node is weak.

    ``free``: of all elements. ``stiffness``: in double precision. ``keep (N, 3)``.
    """
    weak = _weak_nodes(elements, space, free, stiffness)
    holding = np.flatnonzero(weak[free.nodes].any(axis=1))
    if not len(holding):
        return None
    chosen, colours = _by_colour(elements, space, free, weak, holding)
    counts = weak[free.nodes[chosen]].sum(axis=1)
    widths = 3 * counts
    begin = np.concatenate([[0], np.cumsum(widths * (widths + 1) // 2)])
    first = np.concatenate([[0], np.cumsum(widths)])
    scale, height = np.zeros(first[-1], np.float32), np.zeros(first[-1], np.float32)
    entries = np.zeros(begin[-1], np.int8)
    start, near = _elements_of_weak(free.nodes, holding, weak)
    row_of = np.full(len(space.nodes), -1)
    reach = 1 if space.hanging is None else REACH
    for rows, around in _blocks(elements.position, chosen, reach):
        row_of[around] = np.arange(len(around))
        matrices = free_matrices(elements, free, stiffness, softness, around)
        for size in np.unique(counts[rows]).tolist():
            own = rows[counts[rows] == size]
            packed = np.zeros((len(own), 3 * size, 3 * size))
            in_ranges(
                kernels.assemble_patches, range(len(own)), weak, free.nodes, free.kind,
                space.place, elements.position, elements.size, chosen[own], row_of, start, near,
                matrices, packed,
            )  # fmt: skip
            nodes = free.nodes[chosen[own]]
            unknowns = keep[nodes[weak[nodes]]].reshape(len(own), 3 * size)
            in_ranges(
                kernels.invert_factors, range(len(own)), packed, unknowns, SHIFT, begin[own],
                first[own], scale, height, entries,
            )  # fmt: skip
    return Patches(
        nodes=free.nodes, weak=weak, chosen=chosen, colours=colours, begin=begin, first=first,
        scale=scale, height=height, rows=entries,
    )  # fmt: skip


def add_patches(
    patches: Patches, part: np.float32, r: NDArray[np.float32], z: NDArray[np.float32]
) -> None:
    """Add a part of the solutions of the patches for the residual r to z; both are ``(N, 3)``."""
    p = patches
    for low, high in pairwise(p.colours.tolist()):
        in_ranges(
            kernels.add_patches, range(low, high), p.weak, p.nodes, p.chosen, p.begin, p.first,
            p.scale, p.height, p.rows, part, r, z,
        )  # fmt: skip


def _weak_nodes(
    elements: Elements, space: BrickSpace, free: FreeNodes, stiffness: Operator
) -> BoolArray:
    """Free nodes held only by badly cut elements, and nodes of elements with springs.

    A well filled element that follows such nodes of a large one must be relaxed together with them.
    """
    best = np.zeros(len(space.place))
    np.maximum.at(best, space.nodes, solid_fraction(elements)[:, None])
    weak = best < _WEAK
    if stiffness.springs is not None:
        weak[space.nodes[stiffness.springs.element]] = True
    if space.hanging is not None:
        weak[space.hanging.values.shape[1] :] = False
        stands = (free.kind > 0)[:, None] & (free.nodes != space.nodes)
        follows = (stands & weak[free.nodes]).any(axis=1)
        weak[free.nodes[follows]] = True
    return weak


def _by_colour(
    elements: Elements, space: BrickSpace, free: FreeNodes, weak: BoolArray, holding: IntArray
) -> tuple[IntArray, IntArray]:
    """Sort elements by colour; elements of one colour share no weak node.

    Returns the sorted elements and where each colour begins. With local refinement, elements two
    places apart can share a node, so colours are searched instead of taken from the grid.
    """
    if space.hanging is None:
        return sorted_by_colour(elements, holding)
    colour = np.zeros(len(holding), np.int64)
    kernels.colour_patches(free.nodes[holding], weak, colour)
    start = np.concatenate([[0], np.cumsum(np.bincount(colour))])
    return holding[np.argsort(colour, kind="stable")], start


def free_matrices(
    elements: Elements,
    free: FreeNodes,
    stiffness: Operator,
    softness: float,
    chosen: IntArray,
) -> FloatArray:
    """Stiffness of some elements on their free nodes, ``(k, 81, 81)``, N/mm."""
    gradients = gradients_at(gauss_places(CUT_POINTS), elements.grid.edges)
    moduli = stiffness.moduli.astype(np.float64)
    basis = point_stiffness(gradients, moduli).reshape(CUT_POINTS**3, -1)
    full = gauss_weights(CUT_POINTS)
    weights = np.tile(full, (len(chosen), 1))
    cut = chosen >= elements.whole
    own = elements.weights[chosen[cut] - elements.whole]
    weights[cut] = (1.0 - softness) * own + softness * full
    weights *= elements.size[chosen, None]
    matrices = (weights @ basis).reshape(-1, 81, 81)
    springs = stiffness.springs
    if springs is not None:
        _, rows, from_springs = np.intersect1d(chosen, springs.element, return_indices=True)
        matrices[rows] += springs.blocks[from_springs]
    kinds = free.kind[chosen]
    for kind in np.unique(kinds[kinds > 0]).tolist():
        rows = np.flatnonzero(kinds == kind)
        table = np.kron(free.tables[kind], np.eye(3))
        matrices[rows] = table.T @ matrices[rows] @ table
    return matrices


def _blocks(
    position: NDArray[np.int32], chosen: IntArray, reach: int
) -> Iterator[tuple[IntArray, IntArray]]:
    """Rows of chosen elements in blocks of the grid, with the elements that may share a node."""
    position = position[chosen]
    block = position // BLOCK
    dims = block.max(axis=0).astype(np.int64) + 3
    key = ((block[:, 2] + 1) * dims[1] + block[:, 1] + 1) * dims[0] + block[:, 0] + 1
    order = np.argsort(key, kind="stable")
    keys, first = np.unique(key[order], return_index=True)
    members = dict(zip(keys.tolist(), np.split(order, first[1:]), strict=True))
    steps = np.array([z * dims[1] * dims[0] + y * dims[0] + x for z, y, x in _AROUND])
    for own, rows in members.items():
        near = np.concatenate([members[k] for k in (own + steps).tolist() if k in members])
        low, high = position[rows].min(axis=0) - reach, position[rows].max(axis=0) + reach
        inside = ((position[near] >= low) & (position[near] <= high)).all(axis=1)
        yield rows, chosen[near[inside]]


#: Steps to the 27 blocks around a block.
_AROUND = [(z, y, x) for z in (-1, 0, 1) for y in (-1, 0, 1) for x in (-1, 0, 1)]


def _elements_of_weak(
    nodes: NDArray[np.int32], holding: IntArray, weak: BoolArray
) -> tuple[IntArray, IntArray]:
    """Elements around every weak node, given those that hold one."""
    nodes = nodes[holding]
    hit = weak[nodes]
    node = nodes[hit]
    element = np.broadcast_to(holding[:, None], nodes.shape)[hit]
    order = np.argsort(node, kind="stable")
    first = np.concatenate([[0], np.cumsum(np.bincount(node, minlength=len(weak)))])
    return first, element[order]
