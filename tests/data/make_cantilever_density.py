"""Make ``cantilever_density.npz``: optimised densities of the thesis beam, for tests of grading.

Run as ``python tests/data/make_cantilever_density.py``; minutes on one core. Two maps of the beam
of Ramirez Salazar 2022, chapter 4 (1500 x 300 x 200 mm, clamped at x = 0, 5 kN down at x = 1500 mm,
2 mm, 50 MPa):

``bricks`` (90, 18, 12)
    Element densities of 16.7 mm bricks with 8 nodes. Gyroid by the power laws of the thesis'
    4 x 4 x 4 cells (E 0.402 rho^1.176, strength 0.426 rho^1.537), densities 0.123 to 0.688,
    isotropic with Poisson's ratio 0.3, conical filter of 30 mm on the densities after each step of
    the optimality criterion, at most 30 steps or until none changes by 0.004. A plain model that
    shares no step with the project's sizing: a fixed target for cell maps.
``own`` (121, 25, 17)
    The project's own sizing, ``cases/ramirez-cantilever``, on nodes 12.5 mm apart from corner to
    corner.
"""

from pathlib import Path

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree
from skfem import Basis, BilinearForm, ElementHex1, ElementVector, MeshHex
from skfem.helpers import ddot, sym_grad, trace
from skfem.models.elasticity import lame_parameters

from gradedesign.design.case.read_case import load_case
from gradedesign.design.loop.iteration_steps import SizingPlan, design_filter, size_design
from gradedesign.design.resolve.design_model import prepare
from gradedesign.geometry.lattice.density_grid import density_grid_from_elements
from gradedesign.mechanics.explicit.correction import Correction
from gradedesign.mechanics.solver.direct import solve_direct
from gradedesign.program.host.registry import build_registry

HERE = Path(__file__).parent
SIZE, COUNT = (1500.0, 300.0, 200.0), (90, 18, 12)
STEP = SIZE[0] / COUNT[0]
E, FORCE, LIMIT, STRESS, RADIUS = 200e3, 5000.0, 2.0, 50.0, 30.0
C1, N1, C3, N3, LOW, HIGH = 0.402, 1.176, 0.426, 1.537, 0.123, 0.688
LAMBDA, MU = lame_parameters(1.0, 0.3)


@BilinearForm
def _elasticity(u, v, _):
    return LAMBDA * trace(sym_grad(u)) * trace(sym_grad(v)) + 2 * MU * ddot(
        sym_grad(u), sym_grad(v)
    )


def bricks():
    """Densities of the plain model, ``(90, 18, 12)``."""
    lines = [np.linspace(0, size, n + 1) for size, n in zip(SIZE, COUNT, strict=True)]
    mesh = MeshHex.init_tensor(*lines)
    basis = Basis(mesh, ElementVector(ElementHex1()))
    dofs = basis.element_dofs.T
    one = Basis(mesh.restrict(np.array([0])), ElementVector(ElementHex1()))
    order = one.element_dofs[:, 0]
    stiffness = _elasticity.assemble(one).toarray()[np.ix_(order, order)]
    rows, columns = np.repeat(dofs, 24, axis=1).ravel(), np.tile(dofs, (1, 24)).ravel()
    load = _tip_load(mesh, basis)
    free = np.full(basis.N, fill_value=True)
    free[basis.get_dofs(lambda x: x[0] < 1e-6).all()] = False
    centres = mesh.p[:, mesh.t].mean(axis=1)
    smooth = _filter(centres)
    rho = np.full(mesh.nelements, 0.3)
    for _ in range(30):
        modulus = E * C1 * rho**N1
        values = (modulus[:, None, None] * stiffness).ravel()
        matrix = sp.coo_matrix((values, (rows, columns)), shape=(basis.N, basis.N))
        u = solve_direct(sp.bsr_matrix(matrix), free, load[None])[0][0]
        energy = np.einsum("ei,ij,ej->e", u[dofs], stiffness, u[dofs]) * modulus / FORCE
        needed = (_von_mises(basis, u) * modulus / (C3 * STRESS)) ** (1 / N3)
        new = smooth @ _step(rho, energy, np.clip(needed, LOW, HIGH))
        change, rho = np.abs(new - rho).max(), new
        if change < 0.004:
            break
    index = np.floor(centres / STEP).astype(int)
    result = np.zeros(COUNT)
    result[tuple(index)] = rho
    return result


def own():
    """Node densities of the project's own sizing, ``(121, 25, 17)``."""
    case = load_case(HERE.parents[1] / "cases" / "ramirez-cantilever" / "case.toml")
    setup = prepare(case, build_registry())
    one = Correction()
    sized = size_design(
        setup, one, {}, design_filter(setup), SizingPlan(target=0.998, most_iterations=60)
    )
    grid = density_grid_from_elements(
        setup.homogenised.space.mesh, sized.rho, spacing=12.5, margin=0.0
    )
    return grid.values


def _tip_load(mesh, basis):
    """Force of 5 kN down, spread evenly over the end face by trapezoids."""
    nodes = np.flatnonzero(mesh.p[0] > SIZE[0] - 1e-6)
    y, z = mesh.p[1, nodes], mesh.p[2, nodes]
    share = np.where((y < 1e-6) | (y > SIZE[1] - 1e-6), 0.5, 1.0)
    share *= np.where((z < 1e-6) | (z > SIZE[2] - 1e-6), 0.5, 1.0)
    load = np.zeros(basis.N)
    load[basis.nodal_dofs[2, nodes]] = -FORCE * share / share.sum()
    return load


def _von_mises(basis, u):
    """Of the mean strain of each element, for a modulus of 1."""
    strain = sym_grad(basis.interpolate(u)).mean(axis=-1)
    stress = 2 * MU * strain + LAMBDA * np.trace(strain) * np.eye(3)[:, :, None]
    deviator = stress - np.trace(stress) / 3 * np.eye(3)[:, :, None]
    return np.sqrt(1.5 * (deviator**2).sum(axis=(0, 1)))


def _filter(centres):
    """Conical weights within the radius, rows summing to 1."""
    pairs = cKDTree(centres.T).sparse_distance_matrix(
        cKDTree(centres.T), RADIUS, output_type="coo_matrix"
    )
    weight = sp.csr_matrix((RADIUS - pairs.data, (pairs.row, pairs.col)), shape=pairs.shape)
    return sp.diags(1 / np.asarray(weight.sum(axis=1)).ravel()) @ weight


def _step(rho, energy, needed):
    """Least densities that keep the linearised tip displacement, by bisection."""
    low, high = 1e-9, 1e9
    for _ in range(100):
        middle = np.sqrt(low * high)
        new = rho * (middle * N1 * energy / rho) ** (1 / (1 + N1))
        new = np.clip(np.maximum(np.clip(new, 0.7 * rho, 1.4 * rho), needed), LOW, HIGH)
        if (energy * (rho / new) ** N1).sum() > LIMIT:
            low = middle
        else:
            high = middle
    return new


if __name__ == "__main__":
    maps = {"bricks": bricks().astype(np.float32), "own": own().astype(np.float32)}
    np.savez_compressed(HERE / "cantilever_density.npz", **maps)
