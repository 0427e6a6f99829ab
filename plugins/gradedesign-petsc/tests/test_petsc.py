"""petsc-gamg: the displacements of the multigrid solver, on two MPI ranks."""

import numpy as np
import pytest
from skfem import MeshTet

from gradedesign import SolverError
from gradedesign.geometry.tets.tet_mesh import TetMesh
from gradedesign.mechanics.fe.multigrid_solver import MULTIGRID
from gradedesign.mechanics.fe.solution import LoadVector
from gradedesign.mechanics.fe.solve import solve_elastic
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.stiffness import IsotropicStiffness
from gradedesign.mechanics.fe.supports import Supports
from gradedesign_petsc import petsc_solver
from gradedesign_petsc.petsc_solver import PETSC_GAMG, find_ranks


@pytest.fixture
def two_ranks(monkeypatch):
    """Two ranks, also as root and on one processor."""
    monkeypatch.setenv("GRADEDESIGN_PETSC_LAUNCH", "mpirun -n 2")
    monkeypatch.setenv("OMPI_ALLOW_RUN_AS_ROOT", "1")
    monkeypatch.setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
    monkeypatch.setenv("OMPI_MCA_rmaps_base_oversubscribe", "1")
    try:
        return find_ranks()
    except SolverError as error:
        pytest.skip(str(error))


def beam():
    """A beam of 40 x 10 x 10 mm with a soft half, clamped at one end, in two load cases."""
    axes = [np.linspace(0.0, a, n + 1) for a, n in ((40.0, 12), (10.0, 4), (10.0, 4))]
    grid = MeshTet.init_tensor(*axes)
    tets = np.array(grid.t)
    edges = grid.p[:, tets[1:]] - grid.p[:, tets[:1]]
    negative = np.linalg.det(edges.transpose(2, 0, 1)) < 0
    tets[:2, negative] = tets[1::-1, negative]
    space = tet_space(TetMesh(points=grid.p, tets=tets), 2)
    fixed = np.zeros(space.nodes.shape, dtype=bool)
    fixed[:, space.nodes[0] < 1e-9] = True
    supports = Supports(fixed=fixed, value=np.zeros(space.nodes.shape))
    end = space.nodes[0] > 40.0 - 1e-9
    cases = []
    for name, axis, newtons in (("down", 2, -300.0), ("pull", 0, 2000.0)):
        force = np.zeros(space.nodes.shape)
        force[axis, end] = newtons / np.count_nonzero(end)
        cases.append(LoadVector(name=name, force=force, supports=supports))
    middle = grid.p[0][tets].mean(axis=0)
    stiffness = IsotropicStiffness(E=np.where(middle < 20.0, 2.1e5, 2.1e4), nu=0.3)
    return space, stiffness, cases


@pytest.mark.usefixtures("two_ranks")
def test_the_displacements_of_the_multigrid_solver_on_two_ranks():
    space, stiffness, cases = beam()
    assert space.dof_count > 5000
    expected = solve_elastic(space, stiffness, cases, rtol=1e-11, solver=MULTIGRID)
    found = solve_elastic(space, stiffness, cases, rtol=1e-11, solver=PETSC_GAMG)
    for one, other in zip(found, expected, strict=True):
        scale = np.abs(other.displacement).max()
        np.testing.assert_allclose(one.displacement, other.displacement, atol=1e-8 * scale, rtol=0)
    assert all(3 < solution.iterations < 60 for solution in found)


def test_what_the_ranks_say_when_they_fail(two_ranks, tmp_path):
    with pytest.raises(SolverError, match=r"ranks ended with code \d+: .*indptr\.npy"):
        petsc_solver.run_ranks(two_ranks, tmp_path, 1e-8)


def test_what_is_missing_is_named(monkeypatch):
    monkeypatch.setenv("GRADEDESIGN_PETSC_LAUNCH", "no-such-launcher -n 2")
    with pytest.raises(SolverError, match="needs no-such-launcher, which is not installed"):
        find_ranks()
    monkeypatch.setenv("GRADEDESIGN_PETSC_LAUNCH", "env")
    monkeypatch.setenv("GRADEDESIGN_PETSC_PYTHON", "/no/such/python")
    with pytest.raises(SolverError, match="/no/such/python cannot import"):
        find_ranks()
