"""Sweeps over half of a matrix against dense triangles, and conjugate gradients' fused updates."""

from __future__ import annotations

import numpy as np
import pytest
from skfem import MeshTet

from gradedesign.geometry.tets.tet_mesh import TetMesh
from gradedesign.mechanics.fe.assembly import assemble, assembly_pattern
from gradedesign.mechanics.fe.space import TetSpace, tet_space
from gradedesign.mechanics.fe.stiffness import IsotropicStiffness
from gradedesign.mechanics.solver import _conjugate_kernels as kernels
from gradedesign.mechanics.solver import sweeps
from gradedesign.mechanics.solver.sweeps import along_curve, build_sweeps, sweep_down, sweep_up


def block() -> TetSpace:
    grid = MeshTet.init_tensor(*[np.linspace(0.0, a, 4) for a in (3, 1, 1)])
    tets = np.array(grid.t)
    edges = grid.p[:, tets[1:]] - grid.p[:, tets[:1]]
    negative = np.linalg.det(edges.transpose(2, 0, 1)) < 0
    tets[:2, negative] = tets[1::-1, negative]
    return tet_space(TetMesh(points=grid.p, tets=tets), 2)


def problem() -> tuple[TetSpace, object, np.ndarray]:
    space = block()
    rng = np.random.default_rng(61)
    matrix = assemble(
        assembly_pattern(space), IsotropicStiffness(E=1.0 + rng.random(space.element_count), nu=0.3)
    )
    keep = np.ones((space.node_count, 3))
    keep[space.nodes[0] < 1e-9] = 0.0
    keep[5, 1] = 0.0
    return space, matrix, keep.ravel()


def dense(space, matrix, keep, s) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Matrix in the order of the sweeps, its part inside pieces, and its strengthened diagonal."""
    dofs = (3 * s.order[:, None] + np.arange(3)).ravel()
    full = (matrix.toarray() * keep[:, None] * keep)[np.ix_(dofs, dofs)]
    piece = np.repeat(np.searchsorted(s.pieces, np.arange(space.node_count), side="right"), 3)
    inside = full * (piece[:, None] == piece)
    node = np.repeat(np.arange(space.node_count), 3)
    diagonal = full * (node[:, None] == node)
    diagonal += np.diag(0.5 * np.abs(full - inside).sum(axis=1))
    return full, inside, diagonal


@pytest.mark.parametrize("piece", [30, 10_000])
@pytest.mark.parametrize("threaded", [0, 10**9])
def test_sweeps_solve_the_triangles(piece, threaded, monkeypatch):
    """Up: (D + L) x = f from zero, with the residual; down: (D + U) dx = f - A x."""
    monkeypatch.setattr(sweeps, "THREADED", threaded)
    space, matrix, keep = problem()
    s = build_sweeps(matrix, keep, space.nodes, piece)
    assert (s.pieces.size > 2) == (piece == 30)
    full, inside, diagonal = dense(space, matrix, keep, s)
    fixed = np.flatnonzero(s.keep == 0)
    diagonal[fixed, fixed] = 1.0
    node = np.repeat(np.arange(space.node_count), 3)
    lower = diagonal + inside * (node[:, None] > node)
    rng = np.random.default_rng(67)
    f = (s.keep * rng.standard_normal((2, keep.size))).astype(np.float32)
    x, y = np.zeros_like(f), np.ones_like(f)
    sweep_up(s, f, x, y)
    expected = np.linalg.solve(lower, f.T).T
    np.testing.assert_allclose(x, expected, rtol=0, atol=1e-5 * abs(expected).max())
    np.testing.assert_allclose(y, f - x @ full, rtol=0, atol=1e-4)
    assert not x[:, fixed].any()
    begun = (s.keep * rng.standard_normal((2, keep.size))).astype(np.float32)
    x = begun.copy()
    sweep_down(s, f, x, y)
    expected = begun + np.linalg.solve(lower.T, (f - begun @ full).T).T
    np.testing.assert_allclose(x, expected, rtol=0, atol=1e-4 * abs(expected).max())


@pytest.mark.parametrize("piece", [20, 100])
def test_sweeps_converge_whatever_the_pieces(piece):
    """Each sweep down lowers the energy of the error, in pieces of a few nodes too."""
    space, matrix, keep = problem()
    s = build_sweeps(matrix, keep, space.nodes, piece)
    full, _, _ = dense(space, matrix, keep, s)
    rng = np.random.default_rng(71)
    x = (s.keep * rng.standard_normal((1, keep.size))).astype(np.float32)
    energy = [(x @ full @ x.T).item()]
    for _ in range(30):
        sweep_down(s, np.zeros_like(x), x, np.zeros_like(x))
        energy.append((x @ full @ x.T).item())
    assert (np.diff(energy) < 0).all()


def test_the_curve_keeps_neighbours_together():
    """Every node once; consecutive nodes of a grid are near each other."""
    x = np.linspace(0.0, 7.0, 8)
    nodes = np.stack(np.meshgrid(x, x, x, indexing="ij")).reshape(3, -1)
    order = along_curve(nodes)
    assert sorted(order) == list(range(512))
    corners = np.sort(nodes[:, order].reshape(3, 64, 8), axis=2)
    assert (corners.max(axis=2) - corners.min(axis=2) == 1).all()
    assert along_curve(np.zeros((3, 2))).tolist() == [0, 1]


def test_fused_updates_are_their_formulas():
    rng = np.random.default_rng(73)
    x, r, p, q = rng.standard_normal((4, 103))
    moved, left = x + 0.3 * p, r - 0.3 * q
    square = kernels.descend(x, r, p, q, 0.3)
    np.testing.assert_allclose(x, moved, rtol=0, atol=1e-15)
    np.testing.assert_allclose(r, left, rtol=0, atol=1e-15)
    assert square == pytest.approx(left @ left, rel=1e-14)
    turned = -0.2 * p + q
    kernels.turn(p, q, -0.2)
    np.testing.assert_allclose(p, turned, rtol=0, atol=1e-15)
