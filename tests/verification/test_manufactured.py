"""Order of convergence on a manufactured solution in the unit cube."""

import numpy as np
from meshes import box_mesh, solve_one, uniform
from skfem import Basis, ElementTetP2, ElementVector, LinearForm
from skfem.helpers import dot
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from gradedesign.geometry.tets.tet_mesh import signed_volumes
from gradedesign.mechanics.fe.element_points import element_points, shape_values
from gradedesign.mechanics.fe.space import skfem_mesh, tet_space
from gradedesign.mechanics.fe.stress import element_stress
from gradedesign.mechanics.fe.supports import Supports

E, NU = 1000.0, 0.3
LAM, MU = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))
AMPLITUDE = np.array([1.0, -0.5, 0.7])
PI = np.pi


def waves(x):
    """The bump sin sin sin, its gradient (3, ...) and its second derivatives (3, 3, ...)."""
    s, c = np.sin(PI * x), np.cos(PI * x)
    bump = s[0] * s[1] * s[2]
    gradient = PI * np.array([c[0] * s[1] * s[2], s[0] * c[1] * s[2], s[0] * s[1] * c[2]])
    second = np.zeros((3, *x.shape))
    for i in range(3):
        second[i, i] = -(PI**2) * bump
        j, k = (i + 1) % 3, (i + 2) % 3
        second[j, k] = second[k, j] = PI**2 * c[j] * c[k] * s[i]
    return bump, gradient, second


def exact_displacement(x):
    return np.multiply.outer(AMPLITUDE, waves(x)[0])


def exact_stress(x):
    gradient = np.multiply.outer(AMPLITUDE, np.ones(x.shape[1:]))[:, None] * waves(x)[1][None]
    identity = np.eye(3).reshape(3, 3, *[1] * (x.ndim - 1))
    return MU * (gradient + gradient.swapaxes(0, 1)) + LAM * np.trace(gradient) * identity


def body_force_density(x):
    """Minus the divergence of the stress: -(lam + mu) grad div u - mu laplace u."""
    second = waves(x)[2]
    pull = np.einsum("j,ij...->i...", AMPLITUDE, second)
    laplace = np.multiply.outer(AMPLITUDE, np.trace(second))
    return -(LAM + MU) * pull - MU * laplace


def errors(n):
    """L2 errors of displacement and stress on n^3 boxes, relative to the exact norms."""
    space = tet_space(box_mesh((1.0, 1.0, 1.0), (n, n, n)))
    basis = Basis(skfem_mesh(space), ElementVector(ElementTetP2()), intorder=6)

    @LinearForm
    def work(v, w):
        return dot(body_force_density(w.x), v)

    force = work.assemble(basis).reshape(-1, 3).T
    fixed = np.tile(((space.nodes == 0) | (space.nodes == 1)).any(axis=0), (3, 1))
    supports = Supports(fixed=fixed, value=np.zeros(fixed.shape))
    material = uniform(space, E, NU)
    u = solve_one(space, material, supports, force, rtol=1e-10).displacement

    reference, weights = get_quadrature(RefTet, 6)
    lam = np.array([1 - reference.sum(axis=0), *reference]).T
    corners = space.mesh.points[:, space.mesh.tets]
    found = np.einsum("dam,qa->dmq", u[:, space.elements], shape_values(2, lam))
    exact = exact_displacement(np.einsum("dkm,qk->dmq", corners, lam))
    volume = signed_volumes(space.mesh)

    def norm(field, weight):
        squares = (field**2).reshape(-1, *field.shape[-2:]).sum(axis=0)
        return np.sqrt(volume @ squares @ weight)

    stress = element_stress(space, material, u)
    sigma = exact_stress(element_points(space))
    quarter = np.full(4, 0.25)
    return (
        norm(found - exact, 6 * weights) / norm(exact, 6 * weights),
        norm(stress - sigma, quarter) / norm(sigma, quarter),
    )


def test_order_of_convergence():
    # Theory: h^3 for displacement in L2, h^2 for stress, with quadratic elements.
    sizes = np.array([4, 6, 9])
    displacement, stress = np.array([errors(n) for n in sizes]).T
    slope = [-np.polyfit(np.log(sizes), np.log(e), 1)[0] for e in (displacement, stress)]
    assert 2.8 <= slope[0] <= 3.6
    assert 1.8 <= slope[1] <= 2.6
    # Converging to the right answer, not merely converging: 1 % wrong would stop here.
    assert displacement[-1] < 2e-3
    assert stress[-1] < 2e-2
