"""The parts of the multigrid solver against dense algebra, and its convergence on hard problems."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from scipy.sparse import bsr_matrix, kron
from scipy.sparse import eye as identity
from skfem import MeshTet

from gradedesign.geometry.tets.quality import piece_labels
from gradedesign.geometry.tets.tet_mesh import TetMesh, centroids
from gradedesign.mechanics.fe.assembly import assemble, assembly_pattern
from gradedesign.mechanics.fe.multigrid import build_hierarchy, preconditioner
from gradedesign.mechanics.fe.quadratic_level import edge_means
from gradedesign.mechanics.fe.space import TetSpace, edge_ends, tet_space, vertex_space
from gradedesign.mechanics.fe.stiffness import AnisotropicStiffness, IsotropicStiffness
from gradedesign.mechanics.material.scaling_law import isotropic_stiffness
from gradedesign.mechanics.solver import _multigrid_kernels as kernels
from gradedesign.mechanics.solver.aggregation import coarsen
from gradedesign.mechanics.solver.block_rows import (
    BlockRows,
    inverted_diagonal,
    largest_eigenvalue,
    product,
    single_precision,
)
from gradedesign.mechanics.solver.conjugate_gradients import conjugate_gradients
from gradedesign.mechanics.solver.rigid_modes import rigid_body_modes


def oriented(points: np.ndarray, tets: np.ndarray) -> TetMesh:
    """A mesh of positive tets over used vertices only."""
    used, tets = np.unique(tets, return_inverse=True)
    points, tets = points[:, used], tets.reshape(4, -1)
    edges = points[:, tets[1:]] - points[:, tets[:1]]
    negative = np.linalg.det(edges.transpose(2, 0, 1)) < 0
    tets[:2, negative] = tets[1::-1, negative]
    return TetMesh(points=points, tets=tets)


def beam(n: int, length: int = 3) -> TetMesh:
    grid = MeshTet.init_tensor(*[np.linspace(0.0, a, a * n + 1) for a in (length, 1, 1)])
    return oriented(grid.p, np.array(grid.t))


def gyroid(n: int = 14) -> TetMesh:
    """A cell of gyroid sheet between plates, cut from cubes: thin walls and ragged faces."""
    grid = MeshTet.init_tensor(*[np.linspace(0.0, 1.0, n + 1)] * 3)
    x, y, z = 2 * np.pi * grid.p[:, grid.t].mean(axis=1)
    f = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    plate = np.abs(z - np.pi) > np.pi - 2 * np.pi * 1.5 / n
    mesh = oriented(grid.p, np.array(grid.t)[:, (np.abs(f) < 0.4) | plate])
    label = piece_labels(mesh)
    return oriented(mesh.points, mesh.tets[:, label == np.bincount(label).argmax()])


def clamped(space: TetSpace, axis: int = 0) -> np.ndarray:
    return np.repeat((space.nodes[axis] < 1e-9)[None], 3, axis=0)


def iterations(space: TetSpace, stiffness, axis: int = 0) -> int:
    """Iterations to 1e-8 under a random load, after a check of the true residual."""
    matrix = assemble(assembly_pattern(space), stiffness)
    fixed = clamped(space, axis)
    keep = (~fixed.T).ravel().astype(float)
    right = keep * np.random.default_rng(13).standard_normal((1, keep.size))
    cycle = preconditioner(build_hierarchy(space, stiffness, matrix, fixed), 1)
    end = conjugate_gradients(matrix, keep, right, cycle, rtol=1e-8, max_iterations=200)
    left = keep * (matrix @ end.x[0]) - right[0]
    assert np.linalg.norm(left) <= 1.001e-8 * np.linalg.norm(right)
    assert not end.x[:, keep == 0].any()
    return int(end.iterations[0])


@pytest.mark.parametrize(("r", "c"), [(1, 1), (3, 3), (3, 6), (6, 3), (6, 6)])
@pytest.mark.parametrize("threaded", [0, 10**9])
def test_products_with_every_kind_of_block(r, c, threaded, monkeypatch):
    """Against scipy; one by one blocks stand for identity blocks of three."""
    monkeypatch.setattr(kernels, "THREADED", threaded)
    rng = np.random.default_rng(29)
    dense = rng.standard_normal((7 * r, 5 * c)) * np.kron(rng.random((7, 5)) < 0.5, np.ones((r, c)))
    matrix = bsr_matrix(dense, blocksize=(r, c))
    full = kron(matrix, identity(3)).toarray() if r == c == 1 else dense
    x, y = rng.standard_normal(full.shape[1]), rng.standard_normal(full.shape[0])
    keep = (rng.random(full.shape[0]) < 0.7).astype(np.float32)
    out = y.astype(np.float32)
    product(single_precision(matrix), x.astype(np.float32), keep, 0.5, out)
    np.testing.assert_allclose(out, 0.5 * y + keep * (full @ x), rtol=0, atol=2e-5)
    several = rng.standard_normal((3, full.shape[1]))
    outs = np.stack([y, -y, 2 * y]).astype(np.float32)
    expected = 0.5 * outs + keep * (several @ full.T)
    product(single_precision(matrix), several.astype(np.float32), keep, 0.5, outs)
    np.testing.assert_allclose(outs, expected, rtol=0, atol=2e-5)


@pytest.mark.parametrize("threaded", [0, 10**9])
def test_relaxation_is_its_formula(threaded, monkeypatch):
    monkeypatch.setattr(kernels, "THREADED", threaded)
    rng = np.random.default_rng(37)
    inverse = rng.standard_normal((4, 6, 6)).astype(np.float32)
    f, y, d, x = rng.standard_normal((4, 24)).astype(np.float32)
    step = np.einsum("nij,nj->ni", inverse, (f - y).reshape(4, 6)).ravel()
    expected = 0.3 * d + 0.7 * step
    moved = x + expected
    pairs = [np.stack([v, 2 * v]) for v in (f, y, d, x)]
    kernels.relax(inverse, f, y, 0.3, 0.7, d, x)
    kernels.relax(inverse, pairs[0], pairs[1], 0.3, 0.7, pairs[2], pairs[3])
    np.testing.assert_allclose(pairs[2], np.outer([1, 2], expected), rtol=0, atol=2e-5)
    np.testing.assert_allclose(pairs[3], np.outer([1, 2], moved), rtol=0, atol=2e-5)
    np.testing.assert_allclose(d, expected, rtol=0, atol=1e-5)
    np.testing.assert_allclose(x, moved, rtol=0, atol=1e-5)


def test_diagonal_blocks_are_inverted_over_what_is_free():
    rng = np.random.default_rng(41)
    a = rng.standard_normal((3, 6, 6))
    blocks = a @ a.transpose(0, 2, 1) + np.eye(6)
    blocks[2] = 0.0
    blocks[2, :4, :4] = np.eye(4)  # an aggregate with two modes missing
    matrix = bsr_matrix((blocks, np.arange(3), np.arange(4)))
    keep = np.ones(18)
    keep[[1, 4]] = 0.0
    inverse = inverted_diagonal(matrix, keep)
    free = np.flatnonzero(keep[:6])
    np.testing.assert_allclose(
        inverse[0][np.ix_(free, free)], np.linalg.inv(blocks[0][np.ix_(free, free)]), rtol=1e-4
    )
    assert not inverse[0][1].any()
    assert not inverse[0][:, 4].any()
    np.testing.assert_allclose(inverse[1], np.linalg.inv(blocks[1]), rtol=1e-3, atol=1e-6)
    np.testing.assert_allclose(inverse[2], blocks[2], atol=1e-7)


@pytest.mark.parametrize(("order", "n"), [(1, 2), (2, 1)])
def test_the_largest_eigenvalue_is_not_underestimated(order, n):
    """Against dense eigenvalues; the margin of 10 % lies above them."""
    space = tet_space(beam(n), order)
    matrix = assemble(
        assembly_pattern(space), IsotropicStiffness(E=np.ones(space.element_count), nu=0.3)
    )
    keep = (~clamped(space).T).ravel().astype(float)
    inverse = inverted_diagonal(matrix, keep)
    estimate = largest_eigenvalue(single_precision(matrix), keep, inverse)
    blocks = [inverse[i].astype(float) for i in range(space.node_count)]
    scaled = np.zeros(matrix.shape)
    for i, block in enumerate(blocks):
        scaled[3 * i : 3 * i + 3] = block @ matrix.toarray()[3 * i : 3 * i + 3]
    exact = abs(np.linalg.eigvals(scaled * keep)).max()
    assert exact <= estimate <= 1.15 * exact


def test_the_linear_level_is_the_exact_galerkin_product():
    space = tet_space(gyroid(6), 2)
    rng = np.random.default_rng(43)
    stiffness = AnisotropicStiffness(
        C=isotropic_stiffness(rng.random(space.element_count) + 0.1, 0.2)
    )
    fine = assemble(assembly_pattern(space), stiffness)
    linear = assemble(assembly_pattern(vertex_space(space)), stiffness)
    vertices = np.arange(space.mesh.points.shape[1], dtype=np.int32)
    ends = np.concatenate([np.stack([vertices, vertices]), edge_ends(space)], axis=1)
    up = kron(edge_means(ends, vertices.size), identity(3)).tocsr()
    assert abs(up.T @ fine @ up - linear).max() <= 1e-12 * abs(linear).max()


def test_aggregation_keeps_rigid_motions():
    """Without supports the smoothed prolongation reproduces the six rigid modes exactly."""
    space = tet_space(beam(4), 1)
    matrix = assemble(
        assembly_pattern(space), IsotropicStiffness(E=np.ones(space.element_count), nu=0.3)
    )
    keep = np.ones(space.dof_count)
    inverse = inverted_diagonal(matrix, keep)
    modes = rigid_body_modes(space.nodes).reshape(-1, 6)
    coarse = coarsen(matrix, keep, inverse, 2.5, modes)
    assert coarse is not None
    np.testing.assert_allclose(coarse.prolongation @ coarse.candidates, modes, rtol=0, atol=1e-6)
    galerkin = coarse.prolongation.T @ matrix @ coarse.prolongation
    assert abs(galerkin - coarse.matrix).max() < 1e-12
    assert coarse.matrix.shape[0] < 0.3 * matrix.shape[0]


@pytest.mark.parametrize("order", [1, 2])
def test_the_cycle_is_symmetric_and_positive(order):
    space = tet_space(gyroid(), order)
    stiffness = IsotropicStiffness(E=np.ones(space.element_count), nu=0.3)
    matrix = assemble(assembly_pattern(space), stiffness)
    fixed = clamped(space, 2)
    keep = (~fixed.T).ravel().astype(float)
    cycle = preconditioner(build_hierarchy(space, stiffness, matrix, fixed), 2)
    a, b = both = keep * np.random.default_rng(47).standard_normal((2, keep.size))
    ca, cb = cycle(both)
    assert a @ ca > 0.0
    assert abs(a @ cb - b @ ca) < 1e-4 * (a @ ca)
    assert not ca[keep == 0].any()
    small, nothing = cycle(np.stack([1e-30 * a, 0.0 * a]))
    np.testing.assert_allclose(small, 1e-30 * ca, rtol=1e-3, atol=1e-34)
    assert not nothing.any()


@pytest.mark.parametrize(("order", "sizes"), [(1, (8, 14)), (2, (4, 8))])
def test_iterations_hardly_grow_with_refinement(order, sizes):
    counts = []
    for n in sizes:
        space = tet_space(beam(n), order)
        counts.append(iterations(space, IsotropicStiffness(E=np.ones(space.element_count), nu=0.3)))
    assert max(counts) <= 25
    assert counts[1] <= counts[0] + 5


def test_graded_modulus_of_contrast_thousand():
    space = tet_space(beam(6), 2)
    x, y, z = centroids(space.mesh)
    e = 1e3 ** (-0.5 * (1 + np.sin(3 * x) * np.cos(5 * y) * np.sin(4 * z)))
    assert iterations(space, IsotropicStiffness(E=e, nu=0.3)) <= 30


def test_strongly_anisotropic_stiffness():
    """A lattice 20 times stiffer along z than across."""
    space = tet_space(beam(5), 2)
    c = np.diag([1.0, 1.0, 20.0, 0.5, 0.5, 0.4])
    stiffness = AnisotropicStiffness(C=np.repeat(c[:, :, None], space.element_count, axis=2))
    assert iterations(space, stiffness) <= 60


@pytest.mark.parametrize("order", [1, 2])
def test_thin_walled_gyroid(order):
    """The solver study took 50-62 iterations on such sheets with V-cycles."""
    space = tet_space(gyroid(), order)
    assert (
        iterations(space, IsotropicStiffness(E=np.ones(space.element_count), nu=0.3), axis=2) <= 40
    )


def test_columns_are_solved_each_for_itself():
    """Two together, one of them zero or begun at its answer, end as each does alone."""
    space = tet_space(beam(4), 2)
    stiffness = IsotropicStiffness(E=np.ones(space.element_count), nu=0.3)
    matrix = assemble(assembly_pattern(space), stiffness)
    fixed = clamped(space)
    keep = (~fixed.T).ravel().astype(float)
    hierarchy = build_hierarchy(space, stiffness, matrix, fixed)
    right = keep * np.random.default_rng(53).standard_normal((2, keep.size))
    right[1] *= 1e-3 * space.nodes.T.ravel() ** 2
    solve = partial(conjugate_gradients, matrix, keep, max_iterations=200)
    both = solve(right, preconditioner(hierarchy, 2), rtol=1e-8)
    for k in range(2):
        alone = solve(right[k : k + 1], preconditioner(hierarchy, 1), rtol=1e-8)
        assert both.iterations[k] == alone.iterations[0]
        close = 1e-6 * np.abs(alone.x).max()
        np.testing.assert_allclose(both.x[k], alone.x[0], rtol=0, atol=close)
    again = solve(
        np.stack([right[0], 0 * right[1]]), preconditioner(hierarchy, 2), rtol=1e-7, start=both.x
    )
    assert again.iterations.tolist() == [0, 0]
    assert not again.x[1].any()
    stopped = conjugate_gradients(
        matrix, keep, right, preconditioner(hierarchy, 2), rtol=1e-8, max_iterations=3
    )
    assert stopped.iterations.tolist() == [3, 3]
    assert (stopped.residual > 1e-8).all()


def test_block_rows_are_single_precision():
    rows = single_precision(bsr_matrix(np.eye(6), blocksize=(3, 3)))
    assert isinstance(rows, BlockRows)
    assert rows.blocks.dtype == np.float32
    assert rows.row.dtype == rows.column.dtype == np.int32
