"""Remapping of the thesis cantilever's nodal densities (Ramirez, section 4.3; logs L3455 on).

The stresses are ours: 20-node hexahedra, 20 x 4 x 3 of them, 1471 nodes, which gives the thesis'
largest nodal von Mises stress of 3.6705 MPa. Its laws turn them into densities, and its logs give
the grid, tolerance, sensitivity and largest density after mapping.
"""

import numpy as np
import pytest
import skfem
from skfem.models.elasticity import lame_parameters, linear_elasticity

from gradedesign_volumes.point_cloud import remap_points

#: c3, n3 and the least density of the primitive and the gyroid (tables 4.1, 4.2 and the logs).
LAWS = {"primitive": (0.289, 1.225, 0.100), "gyroid": (0.426, 1.537, 0.123)}


def corner_stress(basis, displacement):
    """Stress components at the corners of every element, extrapolated from 2 x 2 x 2 points."""
    lam, mu = lame_parameters(200e3, 0.3)
    strain = basis.interpolate(displacement).grad
    strain = 0.5 * (strain + strain.transpose(1, 0, 2, 3))
    stress = 2 * mu * strain
    for i in range(3):
        stress[i, i] += lam * np.trace(strain)
    points = 2 * basis.quadrature[0] - 1
    # The trilinear function through the eight points, at the corners.
    corners = 2 * basis.mesh.elem.refdom.p - 1
    signs = np.sign(points)[:, None, :]
    shape = np.prod((1 + np.sqrt(3) * corners[:, :, None] * signs) / 2, axis=0)
    return np.einsum("ijeq,cq->ijec", stress, shape)


@pytest.fixture(scope="module")
def nodal():
    """Nodes ``(3, 1471)`` and von Mises stress at them."""
    lines = (np.linspace(0, 1500, 21), np.linspace(0, 300, 5), np.linspace(0, 200, 4))
    mesh = skfem.MeshHex.init_tensor(*lines)
    element = skfem.ElementVector(skfem.ElementHexS2())
    basis = skfem.Basis(mesh, element, quadrature=_gauss(2))
    # Reduced integration, as the thesis' element has it.
    stiffness = linear_elasticity(*lame_parameters(200e3, 0.3)).assemble(basis)
    tip = skfem.FacetBasis(mesh, element, facets=mesh.facets_satisfying(lambda x: x[0] == 1500))
    load = skfem.LinearForm(lambda v, w: -5000 / (300 * 200) * v[2] + 0 * w.x[0]).assemble(tip)
    held = basis.get_dofs(lambda x: x[0] == 0)
    u = skfem.solve(*skfem.condense(stiffness, load, D=held))
    stress = corner_stress(basis, u)
    at = np.zeros((3, 3, mesh.nvertices))
    count = np.bincount(mesh.t.ravel())
    for i in range(3):
        for j in range(3):
            at[i, j] = np.bincount(mesh.t.ravel(), stress[i, j].T.ravel()) / count
    ends = mesh.edges
    points = np.hstack([mesh.p, mesh.p[:, ends].mean(axis=1)])
    at = np.concatenate([at, at[:, :, ends].mean(axis=2)], axis=2)
    deviator = at - np.trace(at) / 3 * np.eye(3)[:, :, None]
    return points, np.sqrt(1.5 * (deviator**2).sum(axis=(0, 1)))


def _gauss(n):
    x, w = np.polynomial.legendre.leggauss(n)
    x, w = (x + 1) / 2, w / 2
    points = np.stack(np.meshgrid(x, x, x, indexing="ij")).reshape(3, -1)
    return points, np.einsum("i,j,k->ijk", w, w, w).ravel()


def test_the_stresses_are_those_of_the_thesis(nodal):
    points, stress = nodal
    assert points.shape == (3, 1471)
    assert stress.max() == pytest.approx(3.6705, abs=0.0005)


@pytest.mark.parametrize(
    ("spacing", "shape", "tolerance", "sensitivity", "largest"),
    [
        (10.0, (151, 31, 21), 5.00, 37.50, {"primitive": 0.325, "gyroid": 0.317}),
        (50.0, (31, 7, 5), 18.75, 50.00, {"primitive": 0.318, "gyroid": 0.312}),
    ],
)
@pytest.mark.parametrize("cell", LAWS)
def test_the_map_is_that_of_the_thesis(
    nodal, cell, spacing, shape, tolerance, sensitivity, largest
):
    points, stress = nodal
    c3, n3, floor = LAWS[cell]
    rho = np.clip((stress / 50.0 / c3) ** (1 / n3), floor, 0.5)
    assert rho.mean() == pytest.approx({"primitive": 0.145, "gyroid": 0.164}[cell], abs=5e-4)
    mapped = remap_points(points, rho, spacing)
    assert mapped.values.shape == shape
    assert mapped.tolerance == pytest.approx(tolerance)
    assert mapped.sensitivity == pytest.approx(sensitivity)
    # The mean of the map is not in the thesis; ours of earlier, by a plain loop over all pairs.
    means = {"primitive": {10: 0.135, 50: 0.144}, "gyroid": {10: 0.155, 50: 0.163}}
    assert mapped.values.mean() == pytest.approx(means[cell][int(spacing)], abs=1e-3)
    assert mapped.values.max() == pytest.approx(largest[cell], abs=1e-3)
    assert mapped.values.min() == pytest.approx(floor)
