"""Groups of nodes that only badly cut elements hold, solved together when smoothing.

Where a surface leaves slivers of elements, quadratic functions become nearly dependent there and
the diagonal says nothing of it: iterations would depend on how the grid is cut. The nodes that no
well filled element holds are therefore relaxed element by element with the inverse of their whole
stiffness, an additive Schwarz method (de Prenter et al., Comput. Methods Appl. Mech. Eng. 350,
2019, p. 237; Jomo et al., Comput. Methods Appl. Mech. Eng. 378, 2021, 113740).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.finite_cell import _patch_kernels as kernels
from gradedesign.finite_cell.basis import CUT_POINTS, gauss_places, gradients_at, point_stiffness
from gradedesign.finite_cell.elements import Elements, soft_weights, solid_fraction
from gradedesign.finite_cell.operator import Operator
from gradedesign.finite_cell.space import BrickSpace

#: A node is weak if no element that holds it has a larger share of solid.
WEAK = 0.25
#: Share of the patches' corrections that is taken: neighbouring patches overlap.
OVERLAP = 0.5
#: Elements whose matrices are made at once.
CHUNK = 256


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Patches:
    """Inverted matrices of the weak nodes of elements.

    Attributes
    ----------
    nodes : (n, 27) int32 array
        Of every element.
    weak : (N,) bool array
    chosen : (k,) int array
        Elements with weak nodes, by colour.
    colours : (9,) int array
    offsets : (k + 1,) int array
    inverse : (total,) float32 array
    """

    nodes: NDArray[np.int32]
    weak: BoolArray
    chosen: IntArray
    colours: IntArray
    offsets: IntArray
    inverse: NDArray[np.float32]


def build_patches(
    elements: Elements,
    space: BrickSpace,
    stiffness: Operator,
    softness: float,
    keep: NDArray[np.float32],
) -> Patches | None:
    """Assemble and invert the patches; None if no node is weak.

    Parameters
    ----------
    elements : Elements
    space : BrickSpace
    stiffness : Operator
        In double precision.
    softness : float
    keep : (N, 3) float32 array
    """
    fill = solid_fraction(elements)
    best = np.zeros(len(space.place))
    np.maximum.at(best, space.nodes, fill[:, None])
    weak = best < WEAK
    chosen, colours = _by_colour(elements, weak[space.nodes].any(axis=1))
    if not len(chosen):
        return None
    counts = weak[space.nodes[chosen]].sum(axis=1)
    offsets = np.concatenate([[0], np.cumsum((3 * counts) ** 2)])
    row_of = np.full(len(space.nodes), -1)
    row_of[chosen] = np.arange(len(chosen))
    first, near = _elements_of_weak(space, chosen, weak)
    matrices = element_matrices(elements, stiffness, softness, chosen)
    packed = np.zeros(offsets[-1])
    kernels.assemble_patches(
        weak, space.nodes, chosen, row_of, first, near, matrices, offsets, packed
    )
    del matrices
    inverse = np.zeros(offsets[-1], np.float32)
    for size in np.unique(counts).tolist():
        rows = np.flatnonzero(counts == size)
        nodes = space.nodes[chosen[rows]]
        free = keep[nodes[weak[nodes]]].reshape(len(rows), 3 * size)
        width = 3 * size
        at = offsets[rows, None] + np.arange(width**2)
        inverse[at] = _inverted(packed[at].reshape(-1, width, width), free).reshape(len(rows), -1)
    return Patches(nodes=space.nodes, weak=weak, chosen=chosen, colours=colours, offsets=offsets, inverse=inverse)


def element_matrices(
    elements: Elements, stiffness: Operator, softness: float, chosen: IntArray
) -> FloatArray:
    """Stiffness of some cut elements, ``(k, 81, 81)``, N/mm."""
    edges = elements.grid.edges
    gradients = gradients_at(gauss_places(CUT_POINTS), edges)
    lame = (float(stiffness.lame[0]), float(stiffness.lame[1]))
    basis = point_stiffness(gradients, lame).reshape(CUT_POINTS**3, -1)
    weights = soft_weights(elements, softness)[chosen - elements.whole]
    matrices = (weights @ basis).reshape(-1, 81, 81)
    springs = stiffness.springs
    if springs is not None:
        row = {int(e): r for r, e in enumerate(chosen)}
        for e, block in zip(springs.element.tolist(), springs.blocks, strict=True):
            if e in row:
                matrices[row[e]] += block
    return matrices


def _by_colour(elements: Elements, chosen: BoolArray) -> tuple[IntArray, IntArray]:
    """Chosen elements by colour."""
    index = np.flatnonzero(chosen)
    x, y, z = elements.position[index].T
    colour = (x & 1) + 2 * (y & 1) + 4 * (z & 1)
    start = np.concatenate([[0], np.cumsum(np.bincount(colour, minlength=8))])
    return index[np.argsort(colour, kind="stable")], start


def _elements_of_weak(
    space: BrickSpace, chosen: IntArray, weak: BoolArray
) -> tuple[IntArray, IntArray]:
    """Elements around every weak node; all of them are among the chosen ones."""
    nodes = space.nodes[chosen]
    hit = weak[nodes]
    node = nodes[hit]
    element = np.broadcast_to(chosen[:, None], nodes.shape)[hit]
    order = np.argsort(node, kind="stable")
    first = np.concatenate([[0], np.cumsum(np.bincount(node, minlength=len(weak)))])
    return first, element[order]


def _inverted(matrices: FloatArray, free: NDArray[np.float32]) -> FloatArray:
    """Inverses over the free unknowns, zero elsewhere; scaled by the diagonal on the way."""
    both = free[:, :, None] * free[:, None, :]
    matrices = matrices * both
    diagonal = np.einsum("eii->ei", matrices)
    diagonal[free == 0] = 1.0
    scale = 1.0 / np.sqrt(np.einsum("eii->ei", matrices))
    matrices *= scale[:, :, None] * scale[:, None, :]
    # What single precision cannot resolve beside 1 would make the smoother indefinite.
    values, vectors = np.linalg.eigh(matrices)
    values = np.maximum(values, 1e-6 * values[:, -1:])
    inverse = np.einsum("eik,ek,ejk->eij", vectors, 1.0 / values, vectors, optimize=True)
    return inverse * (scale[:, :, None] * scale[:, None, :]) * both
