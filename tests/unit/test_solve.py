"""Solved elasticity: exact fields, checks that refuse, and agreement of the solvers."""

from __future__ import annotations

import logging
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
from skfem import MeshTet

from gradedesign.errors import ResourceError, SolverError
from gradedesign.geometry.tets.tet_mesh import TetMesh
from gradedesign.mechanics.fe import multigrid, multigrid_solver, solve
from gradedesign.mechanics.fe.assembly import assemble, assembly_pattern, matvec
from gradedesign.mechanics.fe.elastic_system import prepare_elastic
from gradedesign.mechanics.fe.multigrid_solver import MULTIGRID
from gradedesign.mechanics.fe.scikit_fem import SCIKIT_FEM
from gradedesign.mechanics.fe.solution import LoadVector
from gradedesign.mechanics.fe.solve import (
    predict_memory_bytes,
    solve_cases,
    solve_elastic,
    solve_roughly,
)
from gradedesign.mechanics.fe.space import TetSpace, tet_space
from gradedesign.mechanics.fe.stiffness import AnisotropicStiffness, IsotropicStiffness
from gradedesign.mechanics.fe.supports import Supports
from gradedesign.mechanics.solver import direct
from gradedesign.mechanics.solver.direct import DIRECT


def box(size, shape) -> TetMesh:
    """Tets of a box with a corner in the origin."""
    grid = MeshTet.init_tensor(
        *[np.linspace(0.0, a, n + 1) for a, n in zip(size, shape, strict=True)]
    )
    tets = np.array(grid.t)
    edges = grid.p[:, tets[1:]] - grid.p[:, tets[:1]]
    negative = np.linalg.det(edges.transpose(2, 0, 1)) < 0
    tets[:2, negative] = tets[1::-1, negative]
    return TetMesh(points=grid.p, tets=tets)


def steel(space: TetSpace) -> IsotropicStiffness:
    return IsotropicStiffness(E=np.full(space.element_count, 2.1e5), nu=0.3)


def held(space: TetSpace, where, value=None, components=(0, 1, 2)) -> Supports:
    """Fix components of the nodes where a condition holds."""
    fixed = np.zeros(space.nodes.shape, dtype=bool)
    fixed[np.array(components)[:, None], np.flatnonzero(where)[None, :]] = True
    values = np.zeros(space.nodes.shape) if value is None else np.where(fixed, value, 0.0)
    return Supports(fixed=fixed, value=values)


def random_force(space: TetSpace, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(space.nodes.shape)


def cantilever(shape=(8, 3, 3), order=2) -> tuple[TetSpace, LoadVector]:
    """A beam of 40 x 10 x 10 mm, clamped at x = 0, with 300 N spread over the nodes of its end."""
    space = tet_space(box((40.0, 10.0, 10.0), shape), order)
    force = np.zeros(space.nodes.shape)
    end = space.nodes[0] > 40.0 - 1e-9
    force[2, end] = -300.0 / np.count_nonzero(end)
    return space, LoadVector(name="tip", supports=held(space, space.nodes[0] < 1e-9), force=force)


#: Multigrid on systems of any size.
ALWAYS = replace(MULTIGRID, least_unknowns=0)


def test_a_prepared_system_serves_later_load_cases(monkeypatch):
    """Three load cases at once, then one more: as each alone, from one multigrid hierarchy."""
    space, tip = cantilever()
    forces = [tip.force, 2 * tip.force[[1, 2, 0]], tip.force[[2, 1, 0]], -tip.force]
    cases = [replace(tip, name=str(k), force=force) for k, force in enumerate(forces)]
    alone = [solve_elastic(space, steel(space), [case], solver=ALWAYS)[0] for case in cases]
    built = []
    build = multigrid.build_hierarchy
    monkeypatch.setattr(multigrid, "build_hierarchy", lambda *a: built.append(1) or build(*a))
    system = prepare_elastic(space, steel(space), solver=ALWAYS)
    together = (*solve_cases(system, cases[:3]), *solve_cases(system, cases[3:]))
    assert len(built) == 1
    for one, other in zip(alone, together, strict=True):
        assert other.name == one.name
        assert other.residual <= 1e-8
        close = 1e-6 * np.abs(one.displacement).max()
        np.testing.assert_allclose(other.displacement, one.displacement, rtol=0, atol=close)


def test_a_prepared_system_checks_new_supports():
    space, tip = cantilever()
    system = prepare_elastic(space, steel(space))
    solve_cases(system, [tip])
    loose = replace(tip, name="loose", supports=held(space, space.nodes[0] < 1e-9, components=(2,)))
    with pytest.raises(SolverError, match="loose"):
        solve_cases(system, [loose])


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("solver", [ALWAYS, DIRECT, SCIKIT_FEM], ids=lambda s: s.name)
def test_patch_of_constant_strain(order, solver):
    """A linear field on the boundary is a solution inside, whatever the (constant) stiffness."""
    space = tet_space(box((3.0, 2.0, 2.0), (3, 3, 3)), order)
    a = np.random.default_rng(17).standard_normal((6, 6))
    c = np.repeat((a @ a.T + 2.0 * np.eye(6))[:, :, None], space.element_count, axis=2)
    exact = 1e-3 * np.array([[1.0, 2.0, -1.0], [0.0, 3.0, 1.0], [2.0, 0.5, -2.0]]) @ space.nodes
    x, y, z = space.nodes
    skin = (x == 0) | (x == 3) | (y == 0) | (y == 2) | (z == 0) | (z == 2)
    case = LoadVector(
        name="patch", supports=held(space, skin, exact), force=np.zeros(space.nodes.shape)
    )
    (solution,) = solve_elastic(space, AnisotropicStiffness(C=c), [case], solver=solver)
    np.testing.assert_allclose(solution.displacement, exact, rtol=0, atol=1e-9)
    named = ("pardiso", "superlu") if solver is DIRECT else (solver.name,)
    assert solution.method in named


def test_bar_under_tension_stretches_as_hooke_says():
    """Uniaxial tension, rollers on three faces: u = F L / (E A), E = 2.1e5 MPa, A = 100 mm^2."""
    space = tet_space(box((40.0, 10.0, 10.0), (4, 2, 2)), 2)
    x, y, z = space.nodes
    end = x > 40.0 - 1e-9
    fixed = np.stack([x < 1e-9, y < 1e-9, z < 1e-9])
    value = np.zeros_like(space.nodes)
    fixed[0, end] = True
    value[0, end] = 0.01
    case = LoadVector(
        name="pull", supports=Supports(fixed=fixed, value=value), force=np.zeros(fixed.shape)
    )
    (solution,) = solve_elastic(space, steel(space), [case])
    assert solution.reaction[0, end].sum() == pytest.approx(2.1e5 * 100.0 * 0.01 / 40.0, rel=1e-9)
    np.testing.assert_allclose(solution.displacement[1], -0.3 * 0.01 / 40.0 * y, atol=1e-12)
    assert solution.energy == pytest.approx(0.5 * 5250.0 * 0.01, rel=1e-9)


def test_multigrid_and_direct_solver_agree():
    space, case = cantilever()
    (small,) = solve_elastic(space, steel(space), [case], rtol=1e-10)
    assert small.method in ("pardiso", "superlu")
    (iterated,) = solve_elastic(space, steel(space), [case], rtol=1e-10, solver=ALWAYS)
    assert iterated.method == "multigrid"
    assert 5 < iterated.iterations < 40
    scale = abs(small.displacement).max()
    np.testing.assert_allclose(iterated.displacement, small.displacement, rtol=0, atol=1e-8 * scale)


@pytest.mark.parametrize("method", ["pardiso", "superlu"])
def test_direct_solvers_agree_with_dense_algebra(method, monkeypatch):
    if method == "superlu":
        monkeypatch.setattr(direct, "_pardiso", lambda: None)
    else:
        pytest.importorskip("pypardiso")
    space, case = cantilever((3, 2, 2))
    (solution,) = solve_elastic(space, steel(space), [case])
    assert solution.method == method
    matrix = assemble(assembly_pattern(space), steel(space)).toarray()
    free = ~case.supports.fixed.T.ravel()
    x = np.zeros(free.size)
    x[free] = np.linalg.solve(matrix[np.ix_(free, free)], case.force.T.ravel()[free])
    scale = abs(x).max()
    np.testing.assert_allclose(solution.displacement.T.ravel(), x, rtol=0, atol=1e-9 * scale)


def test_reactions_balance_and_energy_is_work():
    space, case = cantilever((4, 2, 2))
    (solution,) = solve_elastic(space, steel(space), [case])
    np.testing.assert_allclose(solution.reaction.sum(axis=1), [0.0, 0.0, 300.0], atol=1e-6)
    assert not solution.reaction[~case.supports.fixed].any()
    moment = np.cross(space.nodes, solution.reaction + case.force, axis=0).sum(axis=1)
    np.testing.assert_allclose(moment, 0.0, atol=1e-6 * 300.0 * 40.0)
    assert solution.energy == pytest.approx(0.5 * (case.force * solution.displacement).sum())
    assert max(solution.balance.force, solution.balance.moment, solution.balance.energy) < 1e-9
    assert solution.residual < 1e-9


def test_load_cases_keep_their_order_and_superpose():
    space, case = cantilever((4, 2, 2))
    force = random_force(space, 31)
    other = held(space, space.nodes[0] > 40.0 - 1e-9)
    cases = [
        LoadVector(name="a", supports=case.supports, force=force),
        LoadVector(name="b", supports=other, force=force),
        LoadVector(name="c", supports=case.supports, force=case.force),
        LoadVector(name="d", supports=case.supports, force=2.0 * force - 3.0 * case.force),
    ]
    a, b, c, d = solve_elastic(space, steel(space), cases)
    assert [s.name for s in (a, b, c, d)] == ["a", "b", "c", "d"]
    expected = 2.0 * a.displacement - 3.0 * c.displacement
    scale = abs(expected).max()
    np.testing.assert_allclose(d.displacement, expected, rtol=0, atol=1e-9 * scale)
    assert not b.displacement[:, other.fixed[0]].any()


def test_progress_names_each_load_case_once(monkeypatch):
    told = []
    monkeypatch.setattr(solve, "stepping", lambda words: told.append(words) or nullcontext())
    space, case = cantilever((4, 2, 2))
    system = prepare_elastic(space, steel(space))
    for names in (["pull"] * 8, ["pull", "side", "pull"], ["pull", "side", "up"]):
        solve_roughly(system, [replace(case, name=name) for name in names], rtol=1e-4)
    assert told == ["solving pull", "solving pull, side", "solving pull, side and 1 more"]


@pytest.mark.parametrize("solver", [ALWAYS, DIRECT, SCIKIT_FEM], ids=lambda s: s.name)
def test_supports_that_move_a_body_without_strain(solver):
    """A small rotation prescribed on one face turns the whole body and needs no force."""
    space = tet_space(box((30.0, 10.0, 10.0), (6, 2, 2)), 2)
    turned = 1e-3 * np.cross([1.0, -2.0, 0.5], space.nodes, axisb=0).T + 0.25
    case = LoadVector(
        name="turn",
        supports=held(space, space.nodes[0] < 1e-9, turned),
        force=np.zeros(space.nodes.shape),
    )
    (solution,) = solve_elastic(space, steel(space), [case], solver=solver)
    np.testing.assert_allclose(solution.displacement, turned, rtol=0, atol=1e-6)
    assert abs(solution.reaction).max() < 1e-2


def test_no_load_gives_no_displacement():
    space, case = cantilever((3, 1, 1))
    still = LoadVector(name="still", supports=case.supports, force=np.zeros(case.force.shape))
    (solution,) = solve_elastic(space, steel(space), [still])
    assert not solution.displacement.any()
    assert solution.residual == 0.0


def test_results_repeat_to_the_last_bit():
    space, case = cantilever()
    one, two = (solve_elastic(space, steel(space), [case], solver=ALWAYS)[0] for _ in range(2))
    np.testing.assert_array_equal(one.displacement, two.displacement)


def test_fallback_to_the_direct_solver_is_reported(monkeypatch, caplog):
    monkeypatch.setattr(multigrid_solver, "MAX_ITERATIONS", 3)
    space, case = cantilever()
    with caplog.at_level(logging.WARNING):
        (solution,) = solve_elastic(space, steel(space), [case], solver=ALWAYS)
    assert "multigrid stopped at residual" in solution.method
    assert solution.residual < 1e-8
    assert "trying a direct solver" in caplog.text


def test_rough_answers_hold_their_residual(monkeypatch):
    """Several supports and loads at once; what stops short is solved as load cases are."""
    space, tip = cantilever()
    other = replace(
        tip, name="other end", supports=held(space, space.nodes[0] > 40.0 - 1e-9),
        force=random_force(space, 37),
    )  # fmt: skip
    moved = replace(tip.supports, value=0.3 * tip.supports.fixed)
    cases = [
        tip, other, replace(tip, name="turned", force=tip.force[[1, 2, 0]]),
        replace(tip, name="moved", supports=moved),
    ]  # fmt: skip
    system = prepare_elastic(space, steel(space), solver=ALWAYS)
    for case, u in zip(cases, solve_roughly(system, cases, rtol=1e-4), strict=True):
        fixed = case.supports.fixed
        right = (case.force - matvec(system.matrix, case.supports.value))[~fixed]
        left = np.linalg.norm((case.force - matvec(system.matrix, u))[~fixed])
        assert 1e-7 < left / np.linalg.norm(right) < 1.2e-4
        np.testing.assert_array_equal(u[fixed], case.supports.value[fixed])
    exact = solve_cases(system, cases)
    monkeypatch.setattr(multigrid_solver, "MAX_ITERATIONS", 1)
    short = prepare_elastic(space, steel(space), solver=ALWAYS)
    for u, solution in zip(solve_roughly(short, cases, rtol=1e-4), exact, strict=True):
        np.testing.assert_allclose(
            u, solution.displacement, atol=1e-6 * abs(solution.displacement).max()
        )


def test_without_a_direct_solver_an_unfinished_answer_is_refused(monkeypatch):
    monkeypatch.setattr(multigrid_solver, "MAX_ITERATIONS", 3)
    monkeypatch.setattr(direct, "_pardiso", lambda: None)
    monkeypatch.setattr(direct, "SUPERLU_LIMIT", 10)
    space, case = cantilever()
    with pytest.raises(SolverError, match=r"'tip': multigrid stopped after 3 .*install the extra"):
        solve_elastic(space, steel(space), [case], solver=ALWAYS)


def test_a_factorisation_that_does_not_fit_memory_is_refused(monkeypatch):
    pytest.importorskip("pypardiso")
    monkeypatch.setattr(direct, "available_memory_bytes", lambda: 1_000_000)
    space, case = cantilever((4, 2, 2))
    with pytest.raises(ResourceError, match="GiB are left"):
        solve_elastic(space, steel(space), [case])


@pytest.mark.parametrize("method", ["pardiso", "superlu", "multigrid"])
def test_a_hinge_is_refused(method, monkeypatch):
    """Two cubes that share one edge: supports hold the first, the second swings about the edge."""
    if method == "superlu":
        monkeypatch.setattr(direct, "_pardiso", lambda: None)
    else:
        pytest.importorskip("pypardiso")
    first = box((1.0, 1.0, 1.0), (2, 2, 2))
    x, _, z = first.points
    second = first.points + np.array([[1.0], [0.0], [1.0]])
    shared = (x == 0.0) & (z == 0.0)
    partner = [
        int(np.flatnonzero((first.points == second[:, [k]]).all(axis=0))[0])
        for k in np.flatnonzero(shared)
    ]
    number = np.zeros(x.size, int)
    number[shared] = partner
    number[~shared] = x.size + np.arange(np.count_nonzero(~shared))
    mesh = TetMesh(
        points=np.concatenate([first.points, second[:, ~shared]], axis=1),
        tets=np.concatenate([first.tets, number[first.tets]], axis=1),
    )
    space = tet_space(mesh, 2)
    case = LoadVector(
        name="swing", supports=held(space, space.nodes[0] == 0.0), force=random_force(space, 53)
    )
    solver = ALWAYS if method == "multigrid" else DIRECT
    with pytest.raises(SolverError, match=r"not positive definite|is off by"):
        solve_elastic(space, steel(space), [case], solver=solver)


def test_a_wrong_answer_is_caught(monkeypatch):
    """The residual is computed from the matrix, not believed."""
    space, case = cantilever((3, 1, 1))
    right = direct.solve_direct

    def off_by_little(matrix, keep, f):
        x, method = right(matrix, keep, f)
        return 1.00001 * x, method

    monkeypatch.setattr(direct, "solve_direct", off_by_little)
    with pytest.raises(SolverError, match=r"the residual is off by 1\.00e-05"):
        solve_elastic(space, steel(space), [case])
    monkeypatch.setattr(direct, "solve_direct", lambda _m, _k, f: (f * np.nan, "broken"))
    with pytest.raises(SolverError, match="not finite"):
        solve_elastic(space, steel(space), [case])


def test_inputs_that_mean_nothing_are_refused():
    space, case = cantilever((2, 1, 1))
    with pytest.raises(SolverError, match=r"rtol is 0\.001"):
        solve_elastic(space, steel(space), [case], rtol=1e-3)
    other, _ = cantilever((3, 1, 1))
    with pytest.raises(SolverError, match="given for 45 nodes, but the space has 63"):
        solve_elastic(other, steel(other), [case])
    void = IsotropicStiffness(E=np.zeros(space.element_count), nu=0.3)
    with pytest.raises(SolverError, match="is not positive"):
        solve_elastic(space, void, [case])


def test_one_percent_less_stiffness_is_seen():
    space, case = cantilever((4, 2, 2))
    (full,) = solve_elastic(space, steel(space), [case])
    soft = IsotropicStiffness(E=np.full(space.element_count, 0.99 * 2.1e5), nu=0.3)
    (softer,) = solve_elastic(space, soft, [case])
    assert softer.energy / full.energy == pytest.approx(1.0 / 0.99, rel=1e-9)


def test_forces_of_a_solution_are_the_matrix_times_it():
    space, case = cantilever((3, 2, 2))
    (solution,) = solve_elastic(space, steel(space), [case])
    internal = matvec(assemble(assembly_pattern(space), steel(space)), solution.displacement)
    np.testing.assert_allclose(internal, case.force + solution.reaction, atol=1e-8 * 300.0)


def test_memory_prediction_grows_with_the_problem():
    assert predict_memory_bytes(3_000_000, 2) < 8e9
    assert predict_memory_bytes(2_000_000, 2) > predict_memory_bytes(1_000_000, 2) > 1e9
