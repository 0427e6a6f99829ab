"""Loads against scikit-fem's quadrature, and their resultants."""

import numpy as np
import pytest
from skfem import Basis, ElementTetP1, ElementTetP2, ElementVector, FacetBasis, LinearForm
from skfem.helpers import dot

from gradedesign.errors import SolverError
from gradedesign.geometry.tets.tet_mesh import TetMesh, boundary_facets, signed_volumes
from gradedesign.mechanics.fe.facets import facet_areas, facet_owners
from gradedesign.mechanics.fe.loads import (
    body_force,
    pressure_force,
    resultant,
    resultant_load,
    thermal_force,
    traction_force,
)
from gradedesign.mechanics.fe.space import skfem_mesh, tet_space
from gradedesign.mechanics.fe.stiffness import AnisotropicStiffness, IsotropicStiffness

ELEMENTS = {1: ElementVector(ElementTetP1()), 2: ElementVector(ElementTetP2())}


def skewed_mesh():
    """A sheared cube of 8 boxes of six tets: no facet normal along an axis but z."""
    n = 2
    grid = np.array(np.meshgrid(*[np.arange(n + 1.0)] * 3, indexing="ij")).reshape(3, -1)
    first = np.arange((n + 1) ** 3).reshape([n + 1] * 3)[:-1, :-1, :-1].ravel()
    strides = np.array([(n + 1) ** 2, n + 1, 1])
    tets = []
    for order, odd in [("012", 0), ("120", 0), ("201", 0), ("021", 1), ("102", 1), ("210", 1)]:
        t = first + np.cumsum([0, *strides[[int(o) for o in order]]])[:, None]
        tets.append(t[[0, 1, 3, 2]] if odd else t)
    shear = np.array([[1.0, 0.3, 0.2], [0.0, 1.1, -0.1], [0.0, 0.0, 0.9]])
    return TetMesh(points=shear @ grid, tets=np.concatenate(tets, axis=1))


MESH = skewed_mesh()
BOUNDARY, OWNERS = boundary_facets(MESH)
TOP = BOUNDARY[(MESH.points[2][BOUNDARY] > 1.79).all(axis=1)]


def reference_traction(space, facets, traction):
    """Nodal forces by scikit-fem, (3, N)."""
    mesh = skfem_mesh(space)
    ours = {tuple(f) for f in np.sort(facets, axis=1).tolist()}
    index = np.array(
        [i for i, f in enumerate(np.sort(mesh.facets, 0).T.tolist()) if tuple(f) in ours]
    )
    basis = FacetBasis(mesh, ELEMENTS[space.order], facets=index, intorder=8)

    @LinearForm
    def work(v, w):
        return dot(traction(w.x, w.n), v)

    return work.assemble(basis).reshape(-1, 3).T


def constant(vector):
    return lambda x, _n: np.asarray(vector)[:, None, None] + 0 * x


def close(a, b, tolerance=1e-12):
    return np.abs(a - b).max() <= tolerance * np.abs(b).max()


@pytest.mark.parametrize("order", [1, 2])
def test_constant_traction_is_scikit_fems(order):
    space = tet_space(MESH, order)
    force = traction_force(space, BOUNDARY, (1.0, -2.0, 3.0))
    assert close(force, reference_traction(space, BOUNDARY, constant([1.0, -2.0, 3.0])))


@pytest.mark.parametrize("order", [1, 2])
def test_traction_field_is_scikit_fems(order):
    def traction(x):
        return np.array([x[0] ** 3 * x[1], x[2] - x[0] ** 2, 1.0 + x[1] ** 4])

    space = tet_space(MESH, order)
    force = traction_force(space, BOUNDARY, traction)
    assert close(force, reference_traction(space, BOUNDARY, lambda x, _n: traction(x)))


def test_traction_per_facet_is_the_sum_of_single_ones():
    space = tet_space(MESH)
    each = np.random.default_rng(11).normal(size=(3, len(BOUNDARY)))
    single = sum(traction_force(space, BOUNDARY[[k]], each[:, k]) for k in range(len(BOUNDARY)))
    assert close(traction_force(space, BOUNDARY, each), single)


@pytest.mark.parametrize("order", [1, 2])
def test_pressure_is_scikit_fems_and_pushes_inwards(order):
    space = tet_space(MESH, order)
    force = pressure_force(space, BOUNDARY[:, [1, 0, 2]], 2.5)  # corners in the wrong order
    assert close(force, reference_traction(space, BOUNDARY, lambda _x, n: -2.5 * n))
    # The top is 4 base areas of 1.1 mm^2 and looks up, so the push is downwards.
    total, _ = resultant(space, pressure_force(space, TOP, 2.5))
    assert total == pytest.approx([0.0, 0.0, -2.5 * 4.4], abs=1e-12)


def test_pressure_all_round_is_in_balance():
    space = tet_space(MESH)
    force, moment = resultant(space, pressure_force(space, BOUNDARY, 1.0), (5.0, 6.0, 7.0))
    assert np.abs(np.concatenate([force, moment])).max() < 1e-13


def test_pressure_on_a_facet_inside_is_refused():
    space = tet_space(MESH)
    inner = next(
        f
        for t in MESH.tets.T
        for f in [t[[1, 2, 3]], t[[0, 1, 2]]]
        if facet_owners(space, f[None])[2][0] == 2
    )
    with pytest.raises(SolverError, match="1 of 1 facets lie inside the mesh"):
        pressure_force(space, inner[None], 1.0)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("facets", [TOP, TOP[:1], BOUNDARY, BOUNDARY[3:9]])
def test_resultant_is_exactly_as_asked(order, facets):
    space = tet_space(MESH, order)
    about = (3.0, -2.0, 0.5)
    nodal = resultant_load(space, facets, (10.0, -20.0, 5.0), (3.0, 40.0, -7.0), about)
    force, moment = resultant(space, nodal, about)
    assert force == pytest.approx([10.0, -20.0, 5.0], rel=1e-12, abs=1e-11)
    assert moment == pytest.approx([3.0, 40.0, -7.0], rel=1e-12, abs=1e-11)


def test_force_alone_is_a_uniform_traction():
    space = tet_space(MESH)
    force = resultant_load(space, TOP, (0.0, 0.0, 8.0))
    assert close(force, traction_force(space, TOP, (0.0, 0.0, 8.0 / facet_areas(space, TOP).sum())))


def test_moment_on_a_sliver_is_refused():
    # One facet 1 mm long and 1e-7 mm high carries no moment about its length.
    mesh = TetMesh(
        points=np.array([[0.0, 1.0, 0.5, 0.5], [0.0, 0.0, 1e-7, 0.0], [0.0, 0.0, 0.0, 1.0]]),
        tets=np.array([[0], [1], [2], [3]]),
    )
    with pytest.raises(SolverError, match="lie on a line"):
        resultant_load(tet_space(mesh), [[0, 2, 1]], (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))


@pytest.mark.parametrize("order", [1, 2])
def test_body_force_is_scikit_fems(order):
    space = tet_space(MESH, order)
    density = np.random.default_rng(5).uniform(1e-9, 8e-9, space.element_count)
    pull = np.array([100.0, 0.0, -9810.0])
    basis = Basis(skfem_mesh(space), ELEMENTS[order], intorder=4)

    @LinearForm
    def work(v, w):
        return density[:, None] * dot(pull[:, None, None] + 0 * w.x, v)

    expected = work.assemble(basis).reshape(-1, 3).T
    force = body_force(space, density, pull)
    assert close(force, expected)
    total, _ = resultant(space, force)
    assert total == pytest.approx(pull * (density @ signed_volumes(MESH)), rel=1e-12)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("isotropic", [True, False])
def test_thermal_force_is_scikit_fems(order, isotropic):
    space = tet_space(MESH, order)
    rng = np.random.default_rng(9)
    if isotropic:
        stiffness = IsotropicStiffness(E=rng.uniform(1e3, 2e3, space.element_count), nu=0.3)
        # E / (1 - 2 nu) times the expansion in all directions, by hand.
        initial = stiffness.E / 0.4 * np.eye(3)[:, :, None]
    else:
        root = rng.normal(size=(6, 6, space.element_count))
        stiffness = AnisotropicStiffness(C=np.einsum("ikm,jkm->ijm", root, root))
        voigt = stiffness.C[:, :3].sum(axis=1)
        initial = voigt[[[0, 5, 4], [5, 1, 3], [4, 3, 2]]]

    def warmth(x):
        return 20.0 + 3.0 * x[0] - x[1] + 7.0 * x[2]

    basis = Basis(skfem_mesh(space), ELEMENTS[order], intorder=4)

    @LinearForm
    def work(v, w):
        return np.einsum("ijm,ijmq,mq->mq", initial, v.grad, 1e-5 * warmth(w.x))

    expected = work.assemble(basis).reshape(-1, 3).T
    assert close(thermal_force(space, stiffness, 1e-5, warmth), expected)
    uniform = thermal_force(space, stiffness, 1e-5, 20.0)
    assert close(thermal_force(space, stiffness, 1e-5, np.full(space.element_count, 20.0)), uniform)
    assert close(thermal_force(space, stiffness, 1e-5, lambda x: 20.0 + 0 * x[0]), uniform)


def test_wrong_shapes_are_refused():
    space = tet_space(MESH)
    with pytest.raises(ValueError, match=r"traction has shape \(2,\)"):
        traction_force(space, TOP, (1.0, 2.0))
    with pytest.raises(ValueError, match="traction returned shape"):
        traction_force(space, TOP, lambda x: x[0])
    with pytest.raises(ValueError, match="expected one value"):
        thermal_force(space, IsotropicStiffness(E=np.ones(48), nu=0.3), 1.0, np.ones(3))
    with pytest.raises(SolverError, match="given for 3 elements, but the space has 48"):
        thermal_force(space, IsotropicStiffness(E=np.ones(3), nu=0.3), 1.0, 1.0)
