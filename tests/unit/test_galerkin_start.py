"""First guesses from earlier solutions, on a small clamped block."""

from dataclasses import replace

import numpy as np
import pytest
from skfem import MeshTet

from gradedesign.geometry.tets.tet_mesh import TetMesh
from gradedesign.mechanics.fe.elastic_system import prepare_elastic
from gradedesign.mechanics.fe.multigrid_solver import MULTIGRID
from gradedesign.mechanics.fe.solution import LoadVector
from gradedesign.mechanics.fe.solve import solve_cases
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.stiffness import IsotropicStiffness
from gradedesign.mechanics.fe.supports import Supports
from gradedesign.mechanics.solver.galerkin_start import galerkin_start

#: Multigrid however small the block is: a direct solver takes no first guess.
ALWAYS = replace(MULTIGRID, least_unknowns=0)


@pytest.fixture(scope="module")
def block():
    """Space, clamp and two loads of a block of 4 x 2 x 2."""
    grid = MeshTet.init_tensor(*[np.linspace(0, a, 2 * a + 1) for a in (4, 2, 2)])
    tets = np.array(grid.t)
    edges = grid.p[:, tets[1:]] - grid.p[:, tets[:1]]
    negative = np.linalg.det(edges.transpose(2, 0, 1)) < 0
    tets[:2, negative] = tets[1::-1, negative]
    space = tet_space(TetMesh(points=grid.p, tets=tets), 2)
    fixed = np.zeros(space.nodes.shape, dtype=bool)
    fixed[:, space.nodes[0] == 0.0] = True
    supports = Supports(fixed=fixed, value=np.zeros(fixed.shape))
    end = space.nodes[0] == 4.0
    loads = []
    for name, axis in (("pull", 0), ("side", 1)):
        force = np.zeros(space.nodes.shape)
        force[axis, end] = 1.0
        loads.append(LoadVector(name=name, supports=supports, force=force))
    return space, loads


def _system(space, modulus, earlier=()):
    stiffness = IsotropicStiffness(E=modulus, nu=0.3)
    return prepare_elastic(space, stiffness, solver=ALWAYS, earlier=earlier)


def _graded(space, change=0.0):
    """Stiffness that grows along the block, changed by a share that varies with the element."""
    count = space.element_count
    return np.linspace(1000.0, 3000.0, count) * (1 + change * np.sin(np.arange(count)))


def test_known_solutions_need_no_iteration(block):
    space, loads = block
    first = solve_cases(_system(space, _graded(space)), loads)
    assert min(s.iterations for s in first) > 3
    # A sum of loads, whose solution no field alone is.
    both = replace(loads[0], force=loads[0].force - 3.0 * loads[1].force)
    earlier = [s.displacement for s in first]
    (again,) = solve_cases(_system(space, _graded(space), earlier), [both])
    assert again.iterations <= 1
    expected = first[0].displacement - 3.0 * first[1].displacement
    error = np.abs(again.displacement - expected).max()
    assert error <= 1e-7 * np.abs(expected).max()


def test_a_design_near_by_needs_fewer_iterations_for_the_same_answer(block):
    space, loads = block
    first = solve_cases(_system(space, _graded(space)), loads)
    cold = solve_cases(_system(space, _graded(space, 0.001)), loads)
    earlier = [s.displacement for s in first]
    warm = solve_cases(_system(space, _graded(space, 0.001), earlier), loads)
    for a, b in zip(cold, warm, strict=True):
        assert b.iterations < a.iterations
        # Both to a residual of 1e-8.
        error = np.abs(a.displacement - b.displacement).max()
        assert error <= 1e-6 * np.abs(a.displacement).max()


def test_no_combination_has_less_energy_of_error(block):
    """Galerkin's property, against combinations drawn at random."""
    space, loads = block
    rng = np.random.default_rng(5)
    system = _system(space, _graded(space))
    free = ~loads[0].supports.fixed.T.ravel()
    right = free * rng.normal(size=(1, free.size))
    fields = rng.normal(size=(3, *space.nodes.shape))
    best = galerkin_start(system.matrix, free, right, fields)[0]
    rows = np.array([free * u.T.ravel() for u in fields])
    weights = np.linalg.lstsq(rows.T, best, rcond=None)[0]

    def energy(x):
        return 0.5 * x @ (system.matrix @ x) - right[0] @ x

    assert not best[~free].any()
    assert all(
        energy(best) < energy((weights * (1 + 0.01 * rng.normal(size=3))) @ rows) for _ in range(20)
    )


def test_fields_that_are_zero_or_repeated_do_no_harm(block):
    space, loads = block
    system = _system(space, _graded(space))
    free = ~loads[0].supports.fixed.T.ravel()
    right = (free * loads[0].force.T.ravel())[None]
    assert not galerkin_start(system.matrix, free, right, []).any()
    zero = np.zeros(space.nodes.shape)
    assert not galerkin_start(system.matrix, free, right, [zero]).any()
    u = solve_cases(system, loads[:1])[0].displacement
    one, many = (
        galerkin_start(system.matrix, free, right, f) for f in ([u], [u, 1e6 * u, zero, u])
    )
    np.testing.assert_allclose(many, one, atol=1e-9 * np.abs(one).max())
