"""Stiffness of a space as a block-sparse matrix, in two passes.

The pattern is found once per space and reused for every stiffness. Degree of freedom
``3 * node + component`` is scikit-fem's. Integrals are exact: with straight sides the integrand is
quadratic at most, and the four-point rule integrates that exactly.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.system.threads import in_ranges
from gradedesign.errors import ResourceError, SolverError
from gradedesign.mechanics.fe._assembly_kernels import (
    count_columns,
    elements_of_nodes,
    list_columns,
    stiffness_blocks,
    stiffness_blocks_of_moments,
)
from gradedesign.mechanics.fe._energy_kernels import element_energies
from gradedesign.mechanics.fe._isotropic_kernels import isotropic_blocks
from gradedesign.mechanics.fe.element_points import barycentric, shape_derivatives
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.fe.stiffness import (
    PAIRS,
    UNIFORM,
    GaussStiffness,
    MomentStiffness,
    Stiffness,
    element_count,
    kernel_coefficients,
    moment_coefficients,
)
from gradedesign.mechanics.solver._multigrid_kernels import multiply


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AssemblyPattern:
    """Sparsity pattern of the blocks of a space's stiffness."""

    space: TetSpace
    row: NDArray[np.int32]  #: ``(n + 1,)`` int32. First block of every node's row.
    #: ``(n_blocks,)`` int32. Node of every block, ascending within a row.
    column: NDArray[np.int32]
    #: Elements at every node: start ``(n + 1,)``, element and local node.
    incidence: tuple[IntArray, NDArray[np.int32], NDArray[np.int8]]


def assembly_pattern(space: TetSpace) -> AssemblyPattern:
    """Find the sparsity pattern of a space.

    Raises `ResourceError` if the matrix has more blocks than 32-bit indices can count.
    """
    incidence = elements_of_nodes(space.elements, space.node_count)
    nodes = range(space.node_count)
    row = np.zeros(space.node_count + 1, np.int64)
    in_ranges(count_columns, nodes, space.elements, incidence, row)
    np.cumsum(row, out=row)
    column = np.zeros(row[-1], np.int32)
    in_ranges(list_columns, nodes, space.elements, incidence, row, column)
    if 9 * column.size > 8 * np.iinfo(np.int32).max:
        raise ResourceError(
            f"the stiffness of {space.dof_count} unknowns has {column.size} blocks, more than "
            f"32-bit indices allow; use a coarser mesh"
        )
    return AssemblyPattern(
        space=space, row=row.astype(np.int32), column=column, incidence=incidence
    )


def assemble(pattern: AssemblyPattern, stiffness: Stiffness) -> bsr_matrix:
    """Assemble the stiffness matrix, without supports.

    Raises `SolverError` if `stiffness` is for another number of elements. Returns bsr_matrix:
    ``(3 n, 3 n)`` with 3 by 3 blocks and sorted columns, N/mm.
    """
    space = pattern.space
    _require_matching(space, stiffness)
    if isinstance(stiffness, GaussStiffness | MomentStiffness):
        kernel: Callable[..., None] = stiffness_blocks_of_moments
        coefficients = moment_coefficients(stiffness)
        tables: Any = _vertex_tables(space.order)
    else:
        coefficients = np.ascontiguousarray(kernel_coefficients(stiffness)[:, 0])
        kernel = isotropic_blocks if coefficients.shape[1] == 2 else stiffness_blocks
        tables = _stiffness_tables(space.order)
    blocks = np.zeros((pattern.column.size, 3, 3))
    in_ranges(
        kernel,
        range(space.node_count),
        space.nodes,
        space.elements,
        coefficients,
        tables,
        pattern.incidence,
        pattern.row,
        pattern.column,
        blocks,
    )
    n = space.dof_count
    return bsr_matrix((blocks, pattern.column, pattern.row), shape=(n, n), copy=False)


def matvec(matrix: bsr_matrix, displacement: FloatArray) -> FloatArray:
    """Nodal forces ``(3, n)`` in N of a displacement ``(3, n)`` in mm: the stiffness times it."""
    x = np.ascontiguousarray(displacement.T, dtype=np.float64).ravel()
    y = np.zeros_like(x)
    multiply(matrix.indptr, matrix.indices, matrix.data, x, np.ones_like(x), 0.0, y)
    return np.ascontiguousarray(y.reshape(-1, 3).T)


def strain_energy_per_element(
    space: TetSpace, stiffness: Stiffness, u: FloatArray, v: FloatArray | None = None
) -> FloatArray:
    """Bilinear energy ``u^T K_e v`` of every element.

    With the derivative of the stiffness by an element's density in place of `stiffness`, this is
    the sensitivity of the adjoint method. Returns ``(m,)``, N mm.

    ``u (3, n)``, ``v (3, n)``, mm: displacements; `v` is `u` if not given.
    """
    (pairs,) = pair_energies(space, stiffness, [(u, u if v is None else v)])
    return np.asarray(pairs.sum(axis=1))


def pair_energies(
    space: TetSpace, stiffness: Stiffness, fields: Iterable[tuple[FloatArray, FloatArray]]
) -> Iterator[FloatArray]:
    """Terms of `strain_energy_per_element` for each of several pairs of displacements.

    Yields
    ------
    (m, 10) array, N mm
        By pairs of barycentric coordinates in the order of `PAIRS`: each is in proportion to the
        stiffness's moment with it.
    """
    _require_matching(space, stiffness)
    if isinstance(stiffness, GaussStiffness | MomentStiffness):
        coefficients = moment_coefficients(stiffness)
    else:
        coefficients = kernel_coefficients(stiffness)
    shapes = shape_derivatives(space.order, barycentric("vertices"))
    for u, v in fields:
        energy = np.zeros((space.element_count, len(PAIRS)))
        in_ranges(
            element_energies,
            range(space.element_count),
            space.nodes,
            space.elements,
            coefficients,
            shapes,
            UNIFORM,
            _nodal(space, u, "u"),
            _nodal(space, v, "v"),
            energy,
        )
        yield energy


def _vertex_tables(order: int) -> tuple[FloatArray, NDArray[np.int8]]:
    """Derivative of every shape function at every vertex, and by which coordinate, ``(4, k)`` each.

    At a vertex it depends on one barycentric coordinate at most.
    """
    d = shape_derivatives(order, barycentric("vertices"))
    return d.sum(axis=2), np.abs(d).argmax(axis=2).astype(np.int8)


def _stiffness_tables(
    order: int,
) -> tuple[NDArray[np.int8], NDArray[np.int8], NDArray[np.int8], FloatArray]:
    """Integrals of products of shape gradients, non-zero terms only.

    Returns
    -------
    support : (k, 2) array
        Barycentric coordinates a local node's shape function depends on; -1 where there is none.
    count : (k, k) array
        Number of terms for a pair of local nodes a, b.
    term : (k, k, 4, 2) array
        Index into the support of a, and barycentric coordinate v, of each term.
    weight : (k, k, 4) array
        Mean of ``dNa/dlambda_u dNb/dlambda_v`` over the tet.
    """
    d = shape_derivatives(order, barycentric("gauss"))
    means = np.einsum("qau,qbv->abuv", d, d) / len(d)
    k = means.shape[0]
    depends = [np.flatnonzero(row) for row in (d != 0.0).any(axis=0)]
    support = np.full((k, 2), -1, np.int8)
    count = np.zeros((k, k), np.int8)
    term = np.zeros((k, k, 4, 2), np.int8)
    weight = np.zeros((k, k, 4))
    for a, b in itertools.product(range(k), repeat=2):
        support[a, : len(depends[a])] = depends[a]
        for t, ((s, u), v) in enumerate(itertools.product(enumerate(depends[a]), depends[b])):
            term[a, b, t] = s, v
            weight[a, b, t] = means[a, b, u, v]
            count[a, b] = t + 1
    return support, count, term, weight


def _require_matching(space: TetSpace, stiffness: Stiffness) -> None:
    """Refuse a stiffness of another number of elements."""
    if element_count(stiffness) != space.element_count:
        raise SolverError(
            f"the stiffness is given for {element_count(stiffness)} elements, but the space has "
            f"{space.element_count}; build both from the same mesh"
        )


def _nodal(space: TetSpace, value: FloatArray, name: str) -> FloatArray:
    """A contiguous nodal field after a check of its shape."""
    if value.shape != space.nodes.shape:
        raise SolverError(
            f"{name} has shape {value.shape}, expected {space.nodes.shape} for the space"
        )
    return np.ascontiguousarray(value, dtype=np.float64)
