"""Preconditioner of the quadratic bricks: smoothing, then linear bricks, then coarser elements.

The linear functions on the same elements are part of the quadratic ones, and every coarser level
is part of the next finer one, so all coarse matrices are Galerkin products. All runs in single
precision; conjugate gradients around it in double. Above 300 lines: the set-up of the levels and
the cycle over them share their record.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.common.system.threads import in_ranges
from gradedesign.mechanics.fe.multigrid import Hierarchy, preconditioner
from gradedesign.mechanics.finite_cell import _patch_kernels as kernels
from gradedesign.mechanics.finite_cell.basis import (
    CUT_POINTS,
    WHOLE_POINTS,
    gauss_places,
    gauss_weights,
    gradients_at,
    point_stiffness,
)
from gradedesign.mechanics.finite_cell.elements import Elements, soft_weights
from gradedesign.mechanics.finite_cell.hanging import FreeNodes, free_corners, free_nodes
from gradedesign.mechanics.finite_cell.operator import Operator, apply, single
from gradedesign.mechanics.finite_cell.patches import (
    OVERLAP,
    Patches,
    add_patches,
    build_patches,
    free_matrices,
)
from gradedesign.mechanics.finite_cell.space import BrickSpace, linear_space
from gradedesign.mechanics.finite_cell.tree import (
    CORNERS,
    child_weights,
    linear_shapes,
    rows_of,
    slots_of,
    tree_hierarchy,
)
from gradedesign.mechanics.solver.block_rows import BlockRows, largest_preconditioned, product

log = logging.getLogger(__name__)

#: Chebyshev steps on the quadratic level and the part of the spectrum they damp. As on the linear
#: level of `fe.multigrid`.
SMOOTHING = (2, 12.0)
#: Elements whose matrices are made at once. Chosen, not measured.
CHUNK = 4096
#: Elements with hanging nodes whose matrices are made at once: these have 81 unknowns. Chosen, not
#: measured.
_HANGING_CHUNK = 512
#: Rows of a vector that are worth a thread: 0.1 ms of memory. Chosen, not measured.
_ROWS_A_THREAD = 16384


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Preconditioner:
    """Matrices, levels and patches of one multigrid cycle."""

    operator: Operator  #: In single precision.
    keep: NDArray[np.float32]  #: ``(N, 3)`` float32.
    #: ``(N, 3, 3)`` float32. Inverted diagonal blocks; zero for fixed components and weak nodes.
    inverse: NDArray[np.float32]
    patches: Patches | None
    largest: float  #: Largest eigenvalue of the smoother times the operator.
    #: From the linear level and to it.
    prolong: BlockRows
    restrict: BlockRows
    coarse_keep: NDArray[np.float32]  #: ``(3 n,)`` float32.
    coarse: Hierarchy


def build_preconditioner(
    elements: Elements, space: BrickSpace, stiffness: Operator, softness: float, fixed: BoolArray
) -> Preconditioner:
    """Set up all levels.

    ``space``: of order 2. ``stiffness``: in double precision. ``fixed (N, 3)``: hanging nodes among
    them.
    """
    report_step(f"multigrid of {3 * len(space.place)} unknowns")
    keep = (~fixed).astype(np.float32)
    free = free_nodes(elements, space.nodes, space.hanging)
    inverse = _inverse_diagonal(elements, space, free, stiffness, softness, fixed)
    corners = free_corners(elements, space.nodes)
    linear = linear_space(space, corners.nodes)
    prolong = _prolongation(space, linear, corners)
    coarse_keep = np.ones((len(linear.place), 3), np.float32)
    entries = prolong.tocoo()
    same = entries.data == 1.0
    coarse_keep[entries.col[same]] = keep[entries.row[same]]
    del entries, same
    # Nobody else holds the matrices: they go as soon as the next level has its own.
    coarse = tree_hierarchy(
        elements.position,
        linear.nodes,
        _linear_matrices(elements, corners, stiffness, softness),
        coarse_keep,
        *_first_transfer(elements, corners),
    )
    # Last: they are large, and what sets up the other levels is gone by now.
    patches = build_patches(elements, space, free, stiffness, softness, keep)
    if patches is not None:
        inverse[patches.weak] = 0.0
    low = single(stiffness)
    result = Preconditioner(
        operator=low,
        keep=keep,
        inverse=inverse,
        patches=patches,
        largest=_largest(low, keep, inverse, patches),
        prolong=rows_of(prolong),
        restrict=rows_of(prolong.T.tocsr()),
        coarse_keep=coarse_keep.ravel(),
        coarse=coarse,
    )
    log.info(
        "multigrid levels of %d, %s unknowns, %d patches, largest eigenvalue %.2f",
        keep.size, ", ".join(map(str, coarse.sizes)), 0 if patches is None else len(patches.chosen),
        result.largest,
    )  # fmt: skip
    return result


def cycle(levels: Preconditioner) -> Callable[[FloatArray, FloatArray], None]:
    """One cycle from a zero start, as a function of residuals and corrections ``(N, 3)``.

    The function owns its scratch: it serves one solve at a time.
    """
    shape = levels.keep.shape
    x, f, y, d, r, z = (np.zeros(shape, np.float32) for _ in range(6))
    coarse = preconditioner(levels.coarse, 1)
    g = np.zeros((1, levels.coarse_keep.size), np.float32)

    def run(residual: FloatArray, out: FloatArray) -> None:
        scale = float(max(residual.max(), -residual.min())) or 1.0
        np.divide(residual, scale, out=f, casting="same_kind")
        x[:] = 0.0
        y[:] = 0.0
        _smooth(levels, x, f, y, d, r, z, from_zero=True)
        apply(levels.operator, x, y)
        in_ranges(kernels.masked_residual, _rows(y), levels.keep, f, y)
        product(levels.restrict, y.reshape(1, -1), levels.coarse_keep, 0.0, g)
        correction = coarse(g.astype(np.float64)).astype(np.float32)
        product(levels.prolong, correction, levels.keep.ravel(), 1.0, x.reshape(1, -1))
        _smooth(levels, x, f, y, d, r, z, from_zero=False)
        np.multiply(x, scale, out=out, dtype=np.float64)

    return run


def _smooth(
    levels: Preconditioner,
    x: NDArray[np.float32],
    f: NDArray[np.float32],
    y: NDArray[np.float32],
    d: NDArray[np.float32],
    r: NDArray[np.float32],
    z: NDArray[np.float32],
    *,
    from_zero: bool,
) -> None:
    """Chebyshev's iteration over the upper part of the spectrum (Saad, algorithm 12.1)."""
    steps, span = SMOOTHING
    smallest = levels.largest / span
    centre, half = (levels.largest + smallest) / 2, (levels.largest - smallest) / 2
    sigma = centre / half
    rho = 1.0 / sigma
    momentum, step = 0.0, 1.0 / centre
    for k in range(steps):
        if k > 0 or not from_zero:
            apply(levels.operator, x, y)
        if k > 0:
            new = 1.0 / (2.0 * sigma - rho)
            momentum, step = new * rho, 2.0 * new / half
            rho = new
        _relaxed(levels.inverse, levels.patches, f, y, r, z)
        in_ranges(kernels.step_along, _rows(x), np.float32(momentum), np.float32(step), z, d, x)


def _relaxed(
    inverse: NDArray[np.float32],
    patches: Patches | None,
    f: NDArray[np.float32],
    y: NDArray[np.float32],
    r: NDArray[np.float32],
    z: NDArray[np.float32],
) -> None:
    """Set z to the correction of the diagonal blocks and the patches for f - y."""
    in_ranges(kernels.block_jacobi, _rows(r), inverse, f, y, r, z)
    if patches is not None:
        add_patches(patches, np.float32(OVERLAP), r, z)


def _rows(x: NDArray[np.float32]) -> range:
    """Rows of a vector ``(N, 3)``, in as many as are worth a thread."""
    return range(0, len(x), _ROWS_A_THREAD)


def _largest(
    low: Operator,
    keep: NDArray[np.float32],
    inverse: NDArray[np.float32],
    patches: Patches | None,
) -> float:
    """Largest eigenvalue of the smoother times the operator."""
    zero = np.zeros_like(keep)

    def product_of(p: NDArray[np.float32]) -> NDArray[np.float32]:
        y = np.zeros_like(p)
        apply(low, p, y)
        return y * keep

    def relaxed(f: NDArray[np.float32]) -> NDArray[np.float32]:
        r, z = np.zeros_like(f), np.zeros_like(f)
        _relaxed(inverse, patches, f, zero, r, z)
        return z

    return largest_preconditioned(product_of, relaxed, keep)


def _inverse_diagonal(
    elements: Elements,
    space: BrickSpace,
    free: FreeNodes,
    stiffness: Operator,
    softness: float,
    fixed: BoolArray,
) -> NDArray[np.float32]:
    """Inverted 3 by 3 diagonal blocks of all nodes; zero for fixed components."""
    edges, n = elements.grid.edges, len(space.place)
    moduli = stiffness.moduli.astype(np.float64)
    diagonal = np.zeros((9, n))
    weights = soft_weights(elements, softness)
    size = np.where(free.kind == 0, elements.size, 0).astype(np.float64)
    for count, part, w in (
        (WHOLE_POINTS, slice(elements.whole), gauss_weights(WHOLE_POINTS)[None]),
        (CUT_POINTS, slice(elements.whole, None), weights),
    ):
        blocks = _diagonal_blocks(gradients_at(gauss_places(count), edges), moduli)
        for a in range(27):
            own = (w @ blocks[:, a]) * size[part, None]
            _add_at(diagonal, free.nodes[part, a], own)
    springs = stiffness.springs
    if springs is not None:
        plain = free.kind[springs.element] == 0
        for a in range(27):
            own = springs.blocks[plain, 3 * a : 3 * a + 3, 3 * a : 3 * a + 3].reshape(-1, 9)
            _add_at(diagonal, space.nodes[springs.element[plain], a], own)
    hanging = np.flatnonzero(free.kind)
    for k in range(0, len(hanging), _HANGING_CHUNK):
        chosen = hanging[k : k + _HANGING_CHUNK]
        matrices = free_matrices(elements, free, stiffness, softness, chosen)
        for a in range(27):
            own = matrices[:, 3 * a : 3 * a + 3, 3 * a : 3 * a + 3].reshape(-1, 9)
            _add_at(diagonal, free.nodes[chosen, a], own)
    blocks = np.ascontiguousarray(diagonal.T).reshape(n, 3, 3)
    del diagonal
    held = fixed.any(axis=1)
    open_ = (~fixed[held]).astype(np.float64)
    both = open_[:, :, None] * open_[:, None, :]
    some = blocks[held] * both
    some[:, range(3), range(3)] += 1.0 - open_
    blocks[held] = some
    inverse = np.linalg.inv(blocks).astype(np.float32)
    inverse[held] *= both.astype(np.float32)
    return inverse


def _add_at(diagonal: FloatArray, nodes: NDArray[np.int32], own: FloatArray) -> None:
    """Add blocks ``(k, 9)`` of nodes to those of all, ``(9, N)``."""
    for c in range(9):
        diagonal[c] += np.bincount(nodes, weights=own[:, c], minlength=diagonal.shape[1])


def _diagonal_blocks(gradients: FloatArray, moduli: FloatArray) -> FloatArray:
    """Diagonal blocks of points of unit volume, ``(points, 27, 9)``."""
    g = np.moveaxis(gradients, -1, -2)
    outer = moduli.sum(axis=0) * g[..., :, None] * g[..., None, :]
    outer[..., range(3), range(3)] += g**2 @ moduli[1]
    return outer.reshape(*g.shape[:-1], 9)


def _linear_matrices(
    elements: Elements, corners: FreeNodes, stiffness: Operator, softness: float
) -> NDArray[np.float32]:
    """Galerkin products on the linear functions of free nodes, ``(n, 24, 24)``."""
    to_quadratic = np.kron(_linear_at_nodes(), np.eye(3))
    gradients = gradients_at(gauss_places(CUT_POINTS), elements.grid.edges)
    linear = gradients @ _linear_at_nodes()
    basis = point_stiffness(linear, stiffness.moduli.astype(np.float64)).reshape(CUT_POINTS**3, -1)
    matrices = np.zeros((len(elements.position), 24, 24), np.float32)
    matrices[: elements.whole] = (gauss_weights(CUT_POINTS) @ basis).reshape(24, 24)
    full = gauss_weights(CUT_POINTS)
    for k in range(0, len(elements.weights), CHUNK):
        part = (1.0 - softness) * elements.weights[k : k + CHUNK] + softness * full
        at = elements.whole + k
        matrices[at : at + len(part)] = (part @ basis).reshape(-1, 24, 24)
    matrices *= elements.size.astype(np.float32)[:, None, None]
    springs = stiffness.springs
    if springs is not None:
        matrices[springs.element] += to_quadratic.T @ springs.blocks @ to_quadratic
    for kind in range(1, len(corners.tables)):
        own = np.flatnonzero(corners.kind == kind)
        table = np.kron(corners.tables[kind], np.eye(3)).astype(np.float32)
        matrices[own] = table.T @ matrices[own] @ table
    return matrices


def _first_transfer(
    elements: Elements, corners: FreeNodes
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Row for every linear element, and functions of the next coarser one at its free nodes.

    Large elements stay as they are on the next level.
    """
    children = child_weights()
    if elements.size.max(initial=1) == 1:
        return slots_of(elements.position), children
    slot = slots_of(elements.position) + 8 * corners.kind
    slot[elements.size > 1] = 8 * len(corners.tables)
    octant = CORNERS[:, None]
    weights = [
        linear_shapes(np.moveaxis((2 * octant + far[None]) / 4.0, -1, 0)) for far in corners.far
    ]
    table = np.concatenate([*weights, np.eye(8)[None]]).astype(np.float32)
    return slot, table


def _linear_at_nodes() -> FloatArray:
    """Values of the eight linear functions at the 27 nodes, ``(27, 8)``."""
    at = np.stack([np.arange(27) % 3, np.arange(27) // 3 % 3, np.arange(27) // 9]) / 2.0
    return linear_shapes(at)


def _prolongation(space: BrickSpace, linear: BrickSpace, corners: FreeNodes) -> csr_matrix:
    """Values at quadratic nodes from linear ones; hanging nodes are left out."""
    n = len(space.place)
    owner, local = np.zeros(n, np.int64), np.zeros(n, np.int64)
    for a in range(27):
        owner[space.nodes[:, a]] = np.arange(len(space.nodes))
        local[space.nodes[:, a]] = a
    w = _linear_at_nodes()[local]
    of_hanging = np.flatnonzero(corners.kind[owner])
    w[of_hanging] = np.einsum(
        "na,nab->nb", w[of_hanging], corners.tables[corners.kind[owner[of_hanging]]]
    )
    if space.hanging is not None:
        w[space.hanging.values.shape[1] :] = 0.0
    row, corner = np.nonzero(w)
    column = linear.nodes[owner[row], corner]
    return csr_matrix((w[row, corner], (row, column)), shape=(n, len(linear.place)))
