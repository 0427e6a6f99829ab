"""Assembled stiffness against scikit-fem's own, and element energies against the matrix."""

from __future__ import annotations

import math

import numpy as np
import pytest
from skfem import (
    Basis,
    BilinearForm,
    ElementTetP0,
    ElementTetP1,
    ElementTetP2,
    ElementVector,
    MeshTet,
)
from skfem.helpers import ddot, eye, sym_grad, trace

from gradedesign.errors import SolverError
from gradedesign.geometry.tets.tet_mesh import TetMesh, signed_volumes
from gradedesign.mechanics.fe.assembly import (
    assemble,
    assembly_pattern,
    matvec,
    strain_energy_per_element,
)
from gradedesign.mechanics.fe.collapsed_rule import collapsed_rule
from gradedesign.mechanics.fe.element_points import barycentric, shape_derivatives
from gradedesign.mechanics.fe.loads import thermal_force
from gradedesign.mechanics.fe.space import TetSpace, skfem_mesh, tet_space
from gradedesign.mechanics.fe.stiffness import (
    AnisotropicStiffness,
    GaussStiffness,
    IsotropicStiffness,
    MomentStiffness,
    gauss_equivalent,
    known_at,
    mean_stiffness,
    pair_products,
    require_positive,
)
from gradedesign.mechanics.fe.stress import element_stress
from gradedesign.mechanics.material.scaling_law import isotropic_stiffness

ELEMENTS = {1: ElementTetP1(), 2: ElementTetP2()}


def distorted_box(shape: tuple[int, int, int] = (3, 2, 2), seed: int = 11) -> TetMesh:
    """A box of tets whose inner and outer vertices are all moved a little."""
    box = MeshTet.init_tensor(*[np.linspace(0.0, 1.0 * n, n + 1) for n in shape])
    rng = np.random.default_rng(seed)
    points = box.p + rng.uniform(-0.12, 0.12, box.p.shape)
    tets = np.array(box.t)
    edges = points[:, tets[1:]] - points[:, tets[:1]]
    negative = np.linalg.det(edges.transpose(2, 0, 1)) < 0
    tets[:2, negative] = tets[1::-1, negative]
    return TetMesh(points=points, tets=tets)


def random_stiffness(count: int, seed: int = 5) -> AnisotropicStiffness:
    """A random symmetric positive definite matrix per element, of size 100 MPa."""
    a = np.random.default_rng(seed).standard_normal((count, 6, 6))
    c = 20.0 * (a @ a.transpose(0, 2, 1) + 0.5 * np.eye(6))
    return AnisotropicStiffness(C=c.transpose(1, 2, 0))


def graded_modulus(count: int) -> IsotropicStiffness:
    return IsotropicStiffness(E=np.geomspace(1.0, 1e3, count), nu=0.31)


def scikit_fem_isotropic(space: TetSpace, stiffness: IsotropicStiffness):
    """lambda tr(e) tr(e) + 2 mu e:e with one modulus per element."""
    basis = Basis(skfem_mesh(space), ElementVector(ELEMENTS[space.order]), intorder=4)
    nu = stiffness.nu
    lam, mu = nu / ((1 + nu) * (1 - 2 * nu)), 1 / (2 * (1 + nu))

    @BilinearForm
    def form(u, v, w):
        eps = sym_grad(u)
        sigma = w.E * (lam * eye(trace(eps), 3) + 2 * mu * eps)
        return ddot(sigma, sym_grad(v))

    modulus = basis.with_element(ElementTetP0()).interpolate(stiffness.E)
    return form.assemble(basis, E=modulus).tocsr()


def scikit_fem_anisotropic(space: TetSpace, stiffness: AnisotropicStiffness):
    """Voigt strains, xx, yy, zz, yz, xz, xy with engineering shear, with C in between."""
    basis = Basis(skfem_mesh(space), ElementVector(ELEMENTS[space.order]), intorder=4)
    c = stiffness.C

    def voigt(u):
        e = sym_grad(u)
        return np.stack([e[0, 0], e[1, 1], e[2, 2], 2 * e[1, 2], 2 * e[0, 2], 2 * e[0, 1]])

    @BilinearForm
    def form(u, v, w):
        return np.einsum("ieq,ije,jeq->eq", voigt(v), c, voigt(u))

    return form.assemble(basis).tocsr()


@pytest.mark.parametrize("order", [1, 2])
def test_isotropic_stiffness_is_that_of_scikit_fem(order):
    space = tet_space(distorted_box(), order)
    stiffness = graded_modulus(space.element_count)
    ours = assemble(assembly_pattern(space), stiffness)
    theirs = scikit_fem_isotropic(space, stiffness)
    assert ours.blocksize == (3, 3)
    assert ours.has_sorted_indices
    assert abs(ours.tocsr() - theirs).max() <= 1e-12 * abs(theirs).max()


@pytest.mark.parametrize("order", [1, 2])
def test_anisotropic_stiffness_is_that_of_scikit_fem(order):
    space = tet_space(distorted_box(), order)
    stiffness = random_stiffness(space.element_count)
    ours = assemble(assembly_pattern(space), stiffness)
    theirs = scikit_fem_anisotropic(space, stiffness)
    assert abs(ours.tocsr() - theirs).max() <= 1e-12 * abs(theirs).max()


@pytest.mark.parametrize("order", [1, 2])
def test_matrices_of_an_isotropic_stiffness_give_the_same(order):
    space = tet_space(distorted_box((2, 2, 1)), order)
    isotropic = graded_modulus(space.element_count)
    pattern = assembly_pattern(space)
    a = assemble(pattern, isotropic)
    b = assemble(pattern, AnisotropicStiffness(C=isotropic_stiffness(isotropic.E, isotropic.nu)))
    np.testing.assert_allclose(a.data, b.data, rtol=0, atol=1e-13 * abs(a.data).max())


def test_a_pattern_serves_many_stiffnesses_and_repeats_to_the_last_bit():
    space = tet_space(distorted_box(), 2)
    pattern = assembly_pattern(space)
    one = graded_modulus(space.element_count)
    first = assemble(pattern, one).data.copy()
    double = assemble(pattern, IsotropicStiffness(E=2.0 * one.E, nu=one.nu)).data
    np.testing.assert_allclose(double, 2.0 * first, rtol=1e-14)
    np.testing.assert_array_equal(assemble(pattern, one).data, first)


@pytest.mark.parametrize("order", [1, 2])
def test_product_is_that_of_scipy(order):
    space = tet_space(distorted_box(), order)
    matrix = assemble(assembly_pattern(space), random_stiffness(space.element_count))
    u = np.random.default_rng(3).standard_normal(space.nodes.shape)
    expected = (matrix @ u.T.ravel()).reshape(-1, 3).T
    np.testing.assert_allclose(
        matvec(matrix, u), expected, rtol=0, atol=1e-13 * abs(expected).max()
    )


@pytest.mark.parametrize("order", [1, 2])
def test_rigid_motions_need_no_force(order):
    space = tet_space(distorted_box(), order)
    matrix = assemble(assembly_pattern(space), random_stiffness(space.element_count))
    scale = abs(matrix.data).max() * abs(space.nodes).max()
    for t, w in [((1, 2, 3), (0, 0, 0)), ((0, 0, 0), (0.3, -0.2, 0.5))]:
        u = np.array(t, float)[:, None] + np.cross(w, space.nodes, axisb=0).T
        assert abs(matvec(matrix, u)).max() < 1e-13 * scale


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("kind", [graded_modulus, random_stiffness])
def test_element_energies_sum_to_the_matrix_energy(order, kind):
    space = tet_space(distorted_box(), order)
    stiffness = kind(space.element_count)
    matrix = assemble(assembly_pattern(space), stiffness)
    rng = np.random.default_rng(23)
    u, v = rng.standard_normal((2, *space.nodes.shape))
    energy = strain_energy_per_element(space, stiffness, u, v)
    expected = (u * matvec(matrix, v)).sum()
    assert energy.sum() == pytest.approx(expected, rel=1e-11)
    alone = strain_energy_per_element(space, stiffness, u)
    assert alone.sum() == pytest.approx((u * matvec(matrix, u)).sum(), rel=1e-12)


@pytest.mark.parametrize("order", [1, 2])
def test_element_energy_of_a_constant_strain(order):
    """u = G x has the energy density eps:C:eps everywhere, by hand."""
    space = tet_space(distorted_box(), order)
    stiffness = random_stiffness(space.element_count)
    gradient = np.array([[0.1, 0.4, -0.2], [0.0, -0.3, 0.5], [0.7, 0.2, 0.6]])
    eps = np.array([0.1, -0.3, 0.6, 0.5 + 0.2, -0.2 + 0.7, 0.4 + 0.0])
    expected = signed_volumes(space.mesh) * np.einsum("i,ijm,j->m", eps, stiffness.C, eps)
    energy = strain_energy_per_element(space, stiffness, gradient @ space.nodes)
    np.testing.assert_allclose(energy, expected, rtol=1e-11)


def test_energy_of_one_element_is_the_derivative_by_its_modulus():
    """u^T K u is linear in E: a unit modulus in one element alone gives that element's share."""
    space = tet_space(distorted_box((1, 1, 1)), 2)
    u = np.random.default_rng(9).standard_normal(space.nodes.shape)
    pattern = assembly_pattern(space)
    share = strain_energy_per_element(
        space, IsotropicStiffness(E=np.ones(space.element_count), nu=0.3), u
    )
    for e in range(space.element_count):
        only = np.zeros(space.element_count)
        only[e] = 1.0
        matrix = assemble(pattern, IsotropicStiffness(E=only, nu=0.3))
        assert (u * matvec(matrix, u)).sum() == pytest.approx(share[e], rel=1e-11)


@pytest.mark.parametrize("order", [1, 2])
def test_shape_derivatives_sum_to_zero_along_every_direction(order):
    """The shape functions sum to one, so their derivatives along edges of the tet cancel."""
    total = shape_derivatives(order, barycentric("gauss")).sum(axis=1)
    np.testing.assert_allclose(total - total[:, :1], 0.0, atol=1e-14)


def test_wrong_sizes_are_refused():
    space = tet_space(distorted_box((1, 1, 1)), 1)
    pattern = assembly_pattern(space)
    with pytest.raises(SolverError, match="given for 5 elements, but the space has 6"):
        assemble(pattern, graded_modulus(5))
    with pytest.raises(SolverError, match="u has shape"):
        strain_energy_per_element(space, graded_modulus(6), np.zeros((3, 2)))


def test_stiffness_records_refuse_what_means_nothing():
    with pytest.raises(ValueError, match=r"ratio is 0\.5"):
        IsotropicStiffness(E=np.ones(3), nu=0.5)
    with pytest.raises(ValueError, match="not finite"):
        IsotropicStiffness(E=np.array([1.0, np.nan]), nu=0.3)
    skew = np.zeros((6, 6, 2))
    skew[0, 1] = 1.0
    with pytest.raises(ValueError, match="C is not symmetric"):
        AnisotropicStiffness(C=skew)


def test_unstable_elements_are_named():
    with pytest.raises(SolverError, match="1 elements is not positive; element 1 has -2 MPa"):
        require_positive(IsotropicStiffness(E=np.array([1.0, -2.0]), nu=0.3))
    c = np.repeat(np.eye(6)[:, :, None], 3, axis=2)
    c[2, 2, 1] = -0.25
    with pytest.raises(SolverError, match=r"eigenvalue of element 1 is -0\.25 MPa"):
        require_positive(AnisotropicStiffness(C=c))
    require_positive(random_stiffness(4))


def random_at_points(mesh: TetMesh, count: int) -> np.ndarray:
    """Random matrices at points, ``(6, 6, count, m)``, different in every element and point."""
    tets = mesh.tets.shape[1]
    return random_stiffness(tets * count, seed=23).C.reshape(6, 6, count, tets)


def moments_of(c: np.ndarray, points: np.ndarray, weights: np.ndarray) -> MomentStiffness:
    return MomentStiffness(C=np.einsum("pq,ijqm->ijpm", pair_products(points, weights), c))


def scikit_fem_at_points(space: TetSpace, c: np.ndarray, points: np.ndarray, weights: np.ndarray):
    """Matrices at the points of a rule, integrated by that rule."""
    quadrature = points[:, 1:].T, weights / 6
    basis = Basis(skfem_mesh(space), ElementVector(ELEMENTS[space.order]), quadrature=quadrature)

    def voigt(e):
        return np.stack([e[0, 0], e[1, 1], e[2, 2], 2 * e[1, 2], 2 * e[0, 2], 2 * e[0, 1]])

    @BilinearForm
    def form(u, v, _):
        return np.einsum("imq,ijqm,jmq->mq", voigt(sym_grad(v)), c, voigt(sym_grad(u)))

    return form.assemble(basis).toarray()


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_collapsed_rules_integrate_their_degree(count):
    points, weights = collapsed_rule(count)
    assert points.min() > 0
    assert weights.min() > 0
    np.testing.assert_allclose(points.sum(axis=1), 1.0, atol=1e-14)
    degree = 2 * count - 1
    for i, j, k in np.ndindex(degree + 2, degree + 2, degree + 2):
        if i + j + k > degree + 1:
            continue
        # Dirichlet's formula over the tetrahedron of volume 1/6.
        exact = 6 * np.prod([math.factorial(n) for n in (i, j, k)]) / math.factorial(i + j + k + 3)
        found = weights @ (points[:, 1] ** i * points[:, 2] ** j * points[:, 3] ** k)
        if i + j + k <= degree:
            assert found == pytest.approx(exact, rel=1e-12)
    # One degree more is beyond the rule.
    exact = 6 * math.factorial(degree + 1) / math.factorial(degree + 4)
    assert abs(weights @ points[:, 1] ** (degree + 1) / exact - 1) > 1e-6


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("rule", ["gauss", "27 points"])
def test_a_varying_stiffness_is_scikit_fems_on_the_same_rule(order, rule):
    mesh = distorted_box()
    space = tet_space(mesh, order)
    if rule == "gauss":
        points, weights = barycentric("gauss"), np.full(4, 0.25)
        c = random_at_points(mesh, 4)
        stiffness = GaussStiffness(C=c)
    else:
        points, weights = collapsed_rule(3)
        c = random_at_points(mesh, 27)
        stiffness = moments_of(c, points, weights)
    expected = scikit_fem_at_points(space, c, points, weights)
    found = assemble(assembly_pattern(space), stiffness).toarray()
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())
    rng = np.random.default_rng(8)
    u, v = rng.standard_normal((2, *space.nodes.shape))
    energy = strain_energy_per_element(space, stiffness, u, v).sum()
    assert energy == pytest.approx(u.T.ravel() @ expected @ v.T.ravel(), rel=1e-10)


@pytest.mark.parametrize("rule", ["gauss", "27 points"])
def test_a_constant_at_points_is_one_for_each_element(rule):
    mesh = distorted_box()
    space = tet_space(mesh, 2)
    constant = random_stiffness(mesh.tets.shape[1])
    points, weights = collapsed_rule(3)
    if rule == "gauss":
        spread = GaussStiffness(C=np.repeat(constant.C[:, :, None], 4, axis=2))
    else:
        spread = moments_of(np.repeat(constant.C[:, :, None], 27, axis=2), points, weights)
    pattern = assembly_pattern(space)
    expected = assemble(pattern, constant).toarray()
    found = assemble(pattern, spread).toarray()
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())
    require_positive(spread)


@pytest.mark.parametrize("rule", ["gauss", "27 points"])
def test_linear_tetrahedra_feel_the_mean_of_a_varying_stiffness(rule):
    mesh = distorted_box()
    points, weights = collapsed_rule(3)
    stiffness = (
        GaussStiffness(C=random_at_points(mesh, 4))
        if rule == "gauss"
        else moments_of(random_at_points(mesh, 27), points, weights)
    )
    pattern = assembly_pattern(tet_space(mesh, 1))
    expected = assemble(pattern, stiffness).toarray()
    found = assemble(pattern, mean_stiffness(stiffness)).toarray()
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())


def test_a_varying_stiffness_is_checked():
    mesh = distorted_box()
    points, weights = collapsed_rule(3)
    stiffness = moments_of(random_at_points(mesh, 27), points, weights)
    with pytest.raises(SolverError, match="only its moments are given"):
        known_at(stiffness, "gauss")
    for kind, count in ((MomentStiffness, 10), (GaussStiffness, 4)):
        bad = random_at_points(mesh, count).copy()
        bad[0, 0, 2, 3] = -1.0
        with pytest.raises(SolverError, match=r"of 1 elements is not positive definite.*element 3"):
            require_positive(kind(C=bad))
        bad[0, 1] += 1.0
        with pytest.raises(ValueError, match="not symmetric"):
            kind(C=bad)


def test_stress_and_thermal_force_of_a_stiffness_at_gauss_points():
    mesh = distorted_box()
    space = tet_space(mesh, 2)
    c = random_at_points(mesh, 4)
    stiffness = GaussStiffness(C=c)
    # Point by point: each has the stress that its own matrix makes, as if it were the element's.
    u = np.random.default_rng(9).standard_normal(space.nodes.shape)
    stress = element_stress(space, stiffness, u)
    for q in range(4):
        alone = element_stress(space, AnisotropicStiffness(C=c[:, :, q]), u)[..., q]
        np.testing.assert_allclose(stress[..., q], alone, rtol=1e-12)
    # A body that expands freely is in balance with its thermal forces, and free of stress.
    expansion, change = 2e-5, 70.0
    free = expansion * change * space.nodes
    force = thermal_force(space, stiffness, expansion, change)
    needed = matvec(assemble(assembly_pattern(space), stiffness), free)
    np.testing.assert_allclose(force, needed, atol=1e-12 * np.abs(needed).max())
    with pytest.raises(SolverError, match="asked for at vertices"):
        element_stress(space, stiffness, u, at="vertices")
    left = element_stress(space, stiffness, free, thermal_strain=expansion * change)
    assert np.abs(left).max() < 1e-12 * np.abs(element_stress(space, stiffness, free)).max()


def test_thermal_forces_of_moments_are_those_of_the_rule_that_made_them():
    mesh = distorted_box()
    space = tet_space(mesh, 2)
    c = random_at_points(mesh, 4)
    moments = moments_of(c, barycentric("gauss"), np.full(4, 0.25))
    warm = np.random.default_rng(5).uniform(10, 60, mesh.tets.shape[1])
    expected = thermal_force(space, GaussStiffness(C=c), 1e-5, warm)
    found = thermal_force(space, moments, 1e-5, warm)
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())
    points, weights = collapsed_rule(3)
    many = random_at_points(mesh, 27)
    equal = gauss_equivalent(moments_of(many, points, weights))
    np.testing.assert_allclose(equal.C.mean(axis=2), np.einsum("q,ijqm->ijm", weights, many))
    with pytest.raises(SolverError, match="even in every element only"):
        thermal_force(space, moments, 1e-5, lambda x: 20.0 + x[0])
