"""Stiffness by scikit-fem: of the fully solid part, and for the solver ``scikit-fem``.

The other solvers share the points, tets, materials and nodal forces with that solver, but none of
their discretisation: anyone can check them against it (T. Gustafsson and G. D. McBain, scikit-fem:
A Python package for finite element assembly, J. Open Source Software 5, 2020, 2369).
"""

from __future__ import annotations

from itertools import combinations_with_replacement
from typing import TYPE_CHECKING

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.errors import SolverError
from gradedesign.mechanics.solver.linear_solver import (
    LinearAnswer,
    LinearSolver,
    LinearSystem,
    Solve,
)

if TYPE_CHECKING:
    from scipy.sparse import bsr_matrix, csr_matrix, spmatrix
    from skfem.assembly.form.coo_data import COOData
    from skfem.element import DiscreteField

    from gradedesign.mechanics.fe.space import TetSpace
    from gradedesign.mechanics.fe.stiffness import (
        AnisotropicStiffness,
        GaussStiffness,
        IsotropicStiffness,
        MomentStiffness,
        Stiffness,
    )

#: Its factorisation is for small parts: 1 s and 0.3 GB at 8000 unknowns, 7 s and 0.6 GB at 25 000.
MOST_UNKNOWNS = 30_000


def assemble_scikit_fem(space: TetSpace, stiffness: Stiffness) -> spmatrix:
    """Stiffness matrix without supports, ``(3 N, 3 N)``, N/mm.

    Raises `SolverError` if scikit-fem numbers the nodes otherwise.
    """
    from gradedesign.mechanics.fe.stiffness import IsotropicStiffness

    if isinstance(stiffness, IsotropicStiffness):
        return _isotropic(space, stiffness)
    return _anisotropic(space, stiffness)


def _isotropic(space: TetSpace, stiffness: IsotropicStiffness) -> bsr_matrix:
    """From the integrals of products of two derivatives, each a form of a scalar field.

    One form of the vector field has nine times their entries at once: 48,000 quadratic tetrahedra
    took 15.5 s and 2.3 GB.
    """
    from scipy.sparse import bsr_matrix, csr_matrix
    from skfem import Basis, BilinearForm, ElementTetP1, ElementTetP2
    from skfem.models.elasticity import lame_parameters

    from gradedesign.mechanics.fe.space import skfem_mesh

    element = ElementTetP1() if space.order == 1 else ElementTetP2()
    basis = Basis(skfem_mesh(space), element, intorder=2)
    _require_same_nodes(space, basis.doflocs)
    modulus = stiffness.E[:, None]

    def products(i: int, j: int) -> COOData:
        @BilinearForm
        def form(u: DiscreteField, v: DiscreteField, _: object) -> FloatArray:
            return np.asarray(modulus * v.grad[i] * u.grad[j])

        return form.coo_data(basis)

    n, first = space.node_count, products(0, 0)
    # All forms have the entries of the first: their places are found once.
    places, entry = np.unique(
        first.indices[0] * np.int64(n) + first.indices[1], return_inverse=True
    )
    row, column = np.divmod(places, n)
    start = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=n))])
    numbers = csr_matrix((np.arange(1, len(places) + 1), column, start), shape=(n, n))
    swapped = numbers.T.tocsr().data - 1
    lame, shear = lame_parameters(1.0, stiffness.nu)
    blocks = np.zeros((len(places), 3, 3))
    for i, j in combinations_with_replacement(range(3), 2):
        data = first.data if (i, j) == (0, 0) else products(i, j).data
        summed = np.bincount(entry, data, minlength=len(places))
        other = summed[swapped]
        blocks[:, i, j] = lame * summed + shear * other
        blocks[:, j, i] = lame * other + shear * summed
    # Of i = j both terms are alike: what remains are the squares of the gradient's components.
    squares = np.einsum("eii->e", blocks) * (shear / (lame + shear))
    for i in range(3):
        blocks[:, i, i] += squares
    return bsr_matrix((blocks, column.astype(np.int32), start.astype(np.int32)))


def _anisotropic(
    space: TetSpace, stiffness: AnisotropicStiffness | GaussStiffness | MomentStiffness
) -> csr_matrix:
    """From one form of the vector field with the full stiffness at its points of quadrature."""
    from skfem import Basis, BilinearForm, ElementTetP1, ElementTetP2, ElementVector
    from skfem.helpers import sym_grad

    from gradedesign.mechanics.fe.space import skfem_mesh

    element = ElementVector(ElementTetP1() if space.order == 1 else ElementTetP2())
    points, C = _quadrature(stiffness)
    weights = np.full(len(points), 1.0 / (6.0 * len(points)))
    basis = Basis(skfem_mesh(space), element, quadrature=(points[:, 1:].T, weights))

    @BilinearForm
    def form(u: FloatArray, v: FloatArray, _: object) -> FloatArray:
        strains = _voigt(sym_grad(v)), _voigt(sym_grad(u))
        return np.asarray(np.einsum("imq,ijqm,jmq->mq", strains[0], C, strains[1]))

    _require_same_nodes(space, basis.doflocs[:, ::3])
    matrix: csr_matrix = form.assemble(basis)
    return matrix


def _prepare_scikit_fem(system: LinearSystem) -> Solve:
    """Solve with the fixed degrees of freedom condensed, each right-hand side for itself."""
    from skfem import condense, solve

    matrix = system.matrix.tocsr()
    fixed = np.flatnonzero(~system.free)

    def solve_all(right: FloatArray, _start: FloatArray, _rtol: float) -> LinearAnswer:
        report_step(f"scikit-fem on {len(system.free)} unknowns")
        x = [solve(*condense(matrix, f, D=fixed), permc_spec="MMD_AT_PLUS_A") for f in right]
        return LinearAnswer(x=np.array(x))

    return solve_all


def _quadrature(
    stiffness: AnisotropicStiffness | GaussStiffness | MomentStiffness,
) -> tuple[FloatArray, FloatArray]:
    """Barycentric points ``(q, 4)`` of equal weight and the stiffness there, ``(6, 6, q, m)``.

    Of moments ``C_st``, the points are vertices and edge middles: products of two coordinates are
    there 1 at a vertex, and 1/4 for each of the four products of an edge's two ends at its middle.
    """
    from gradedesign.mechanics.fe.element_points import barycentric
    from gradedesign.mechanics.fe.stiffness import PAIRS, GaussStiffness, MomentStiffness

    if isinstance(stiffness, GaussStiffness):
        return barycentric("gauss"), stiffness.C
    if not isinstance(stiffness, MomentStiffness):
        return barycentric("gauss"), np.repeat(stiffness.C[:, :, None], 4, axis=2)
    points = np.array([0.5 * (np.eye(4)[s] + np.eye(4)[t]) for s, t in PAIRS])
    C = np.zeros_like(stiffness.C)
    corner = {s: k for k, (s, t) in enumerate(PAIRS) if s == t}
    for k, (s, t) in enumerate(PAIRS):
        if s == t:
            C[:, :, k] += stiffness.C[:, :, k]
        else:
            C[:, :, k] = 4.0 * stiffness.C[:, :, k]
            C[:, :, corner[s]] -= stiffness.C[:, :, k]
            C[:, :, corner[t]] -= stiffness.C[:, :, k]
    return points, len(PAIRS) * C


def _voigt(strain: FloatArray) -> FloatArray:
    """Strain ``(3, 3, ...)`` as ``(6, ...)`` with engineering shear."""
    e = strain
    return np.stack([e[0, 0], e[1, 1], e[2, 2], 2 * e[1, 2], 2 * e[0, 2], 2 * e[0, 1]])


def _require_same_nodes(space: TetSpace, where: FloatArray) -> None:
    """Refuse another numbering: forces and supports would act elsewhere."""
    if where.shape != space.nodes.shape or not np.allclose(where, space.nodes, rtol=1e-12):
        raise SolverError(
            "scikit-fem numbers the nodes otherwise than gradedesign; take another release of it"
        )


SCIKIT_FEM = LinearSolver(
    name="scikit-fem",
    prepare=_prepare_scikit_fem,
    assemble=assemble_scikit_fem,
    most_unknowns=MOST_UNKNOWNS,
)
