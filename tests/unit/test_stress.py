"""Stress against scikit-fem, von Mises, averages and percentiles against slow oracles."""

import numpy as np
import pytest
from skfem import Basis, ElementTetP1, ElementTetP2, ElementVector

from gradedesign.errors import SolverError
from gradedesign.geometry.tets.tet_mesh import TetMesh, signed_volumes
from gradedesign.mechanics.fe.element_points import barycentric, element_points
from gradedesign.mechanics.fe.space import skfem_mesh, tet_space
from gradedesign.mechanics.fe.stiffness import AnisotropicStiffness, IsotropicStiffness
from gradedesign.mechanics.fe.stress import (
    element_stress,
    element_von_mises,
    nodal_average,
    von_mises,
    weighted_percentile,
)

VOIGT = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])
MESH = TetMesh(  # two tets that share a face, none of it regular
    points=np.array([[0.0, 2, 0.3, 0.1, 1.5], [0, 0.2, 1.8, 0.4, 1.6], [0, -0.1, 0.2, 1.3, 1.9]]),
    tets=np.array([[0, 4], [1, 2], [2, 1], [3, 3]]),
)


def stiffness(kind, rng):
    if kind == "isotropic":
        return IsotropicStiffness(E=rng.uniform(1e3, 2e3, 2), nu=0.28)
    root = rng.normal(size=(6, 6, 2))
    return AnisotropicStiffness(C=np.einsum("ikm,jkm->ijm", root, root))


def matrices(stiff):
    """Full matrices by Hooke's law, written out."""
    if isinstance(stiff, AnisotropicStiffness):
        return stiff.C
    C = np.zeros((6, 6, stiff.E.size))
    for m, E in enumerate(stiff.E):
        S = np.diag([1 / E] * 3 + [2 * (1 + stiff.nu) / E] * 3)
        S[:3, :3] -= stiff.nu / E * (1 - np.eye(3))
        C[:, :, m] = np.linalg.inv(S)
    return C


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("kind", ["isotropic", "full"])
@pytest.mark.parametrize("at", ["gauss", "vertices"])
def test_stress_is_scikit_fems(order, kind, at):
    rng = np.random.default_rng(13)
    space = tet_space(MESH, order)
    u = rng.normal(size=space.nodes.shape)
    stiff = stiffness(kind, rng)
    free = rng.normal(size=(2, 4))
    element = ElementVector(ElementTetP1() if order == 1 else ElementTetP2())
    quadrature = (barycentric(at)[:, 1:].T, np.full(4, 1 / 24))
    gradient = Basis(skfem_mesh(space), element, quadrature=quadrature).interpolate(u.T.ravel())
    strain = (
        0.5 * (gradient.grad + gradient.grad.swapaxes(0, 1)) - free * np.eye(3)[..., None, None]
    )
    engineering = np.array(
        [*(strain[i, i] for i in range(3)), *(2 * strain[p] for p in [(1, 2), (0, 2), (0, 1)])]
    )
    expected = np.einsum("ijm,jmq->imq", matrices(stiff), engineering)[VOIGT]
    found = element_stress(space, stiff, u, thermal_strain=free, at=at)
    assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()
    lean = element_von_mises(space, stiff, u, thermal_strain=free, at=at)
    deviator = expected - np.trace(expected) / 3 * np.eye(3)[..., None, None]
    mises = np.sqrt(1.5 * (deviator**2).sum(axis=(0, 1)))
    assert np.abs(lean - mises).max() < 1e-12 * mises.max()
    assert np.abs(von_mises(found) - mises).max() < 1e-12 * mises.max()


def test_gauss_points_integrate_quadratics_exactly():
    # Oracle: the mean of x^2 over a tet, (sum of squares + sum of products) / 10.
    space = tet_space(MESH)
    x = MESH.points[0][MESH.tets]
    exact = (0.5 * x.sum(axis=0) ** 2 + 0.5 * (x**2).sum(axis=0)) / 10
    assert (element_points(space)[0] ** 2).mean(axis=1) == pytest.approx(exact, rel=1e-13)
    corners = element_points(space, "vertices")
    assert np.array_equal(corners, MESH.points[:, MESH.tets].swapaxes(1, 2))


def test_free_expansion_has_no_stress():
    space = tet_space(MESH)
    stiff = IsotropicStiffness(E=np.array([1e5, 3e5]), nu=0.3)
    u = 0.002 * space.nodes
    stress = element_stress(space, stiff, u, thermal_strain=0.002)
    assert np.abs(stress).max() < 1e-10
    # Half the expansion held back: -E alpha dT / (1 - 2 nu) in all directions.
    stress = element_stress(space, stiff, 0 * u, thermal_strain=np.array([0.001, 0.002]))
    expected = -np.array([1e5 * 0.001, 3e5 * 0.002]) / 0.4
    for i in range(3):
        assert stress[i, i, :, 0] == pytest.approx(expected, rel=1e-12)


def test_von_mises_of_known_states():
    # Uniaxial s gives s, pure shear t gives sqrt(3) t, pressure gives 0 (definition).
    shear = np.zeros((3, 3))
    shear[0, 2] = shear[2, 0] = 7.0
    assert von_mises(np.diag([0.0, -5.0, 0.0])) == pytest.approx(5.0)
    assert von_mises(shear) == pytest.approx(7.0 * 3**0.5)
    assert von_mises(4.0 * np.eye(3)) == 0.0


def test_von_mises_does_not_see_rotation():
    rng = np.random.default_rng(17)
    stress = rng.normal(size=(3, 3))
    stress += stress.T
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    assert von_mises(turn @ stress @ turn.T) == pytest.approx(von_mises(stress), rel=1e-13)


def test_nodal_average_is_the_slow_one():
    space = tet_space(MESH)
    values = np.random.default_rng(19).normal(size=(3, 2, 4))
    volume = signed_volumes(MESH)
    expected = np.zeros((3, 5))
    for v in range(5):
        total = 0.0
        for m in range(2):
            for k in range(4):
                if MESH.tets[k, m] == v:
                    expected[:, v] += volume[m] * values[:, m, k]
                    total += volume[m]
        expected[:, v] /= total
    assert nodal_average(space, values) == pytest.approx(expected, rel=1e-14)


def slow_percentile(values, weights, percentile):
    """The definition, word by word."""
    total = sum(weights)
    for v in sorted(v for v, w in zip(values, weights, strict=True) if w > 0):
        if (
            sum(w for x, w in zip(values, weights, strict=True) if x <= v)
            >= percentile / 100 * total
        ):
            return v
    raise AssertionError


def test_percentile_follows_its_definition():
    rng = np.random.default_rng(23)
    for _ in range(40):
        values = rng.integers(0, 9, 12).astype(float)
        weights = rng.integers(0, 5, 12).astype(float) + (np.arange(12) == 3)
        for percentile in (0.1, 25.0, 50.0, 99.5, 100.0):
            found = weighted_percentile(values, weights, percentile)
            assert found == slow_percentile(values, weights, percentile)


def test_percentile_does_not_count_samples_but_volume():
    values, weights = np.array([10.0, 50.0, 90.0]), np.array([0.98, 0.016, 0.004])
    assert weighted_percentile(values, weights, 99.5) == 50.0
    # A thousand slivers of the same total volume change nothing.
    many = np.concatenate([values[:2], np.full(1000, 90.0)])
    split = np.concatenate([weights[:2], np.full(1000, 4e-6)])
    assert weighted_percentile(many, split, 99.5) == 50.0
    assert weighted_percentile(many, split, 99.7) == 90.0


def test_percentile_is_not_pushed_up_by_rounding():
    assert weighted_percentile(np.arange(10.0), np.full(10, 0.1), 30.0) == 2.0


@pytest.mark.parametrize(
    ("values", "weights", "percentile"),
    [
        ([1.0], [1.0], 0.0),
        ([1.0], [1.0], 100.1),
        ([1.0, np.nan], [1.0, 1.0], 50.0),
        ([1.0, 2.0], [1.0, -1e-9], 50.0),
        ([1.0], [0.0], 50.0),
        ([1.0, 2.0], [1.0], 50.0),
    ],
)
def test_meaningless_percentiles_are_refused(values, weights, percentile):
    with pytest.raises(ValueError):
        weighted_percentile(values, weights, percentile)


def test_fields_of_another_space_are_refused():
    space = tet_space(MESH)
    stiff = IsotropicStiffness(E=np.ones(2), nu=0.3)
    with pytest.raises(SolverError, match="displacement has shape"):
        element_stress(space, stiff, np.zeros((3, 5)))
    with pytest.raises(SolverError, match="given for 3 elements"):
        element_stress(space, IsotropicStiffness(E=np.ones(3), nu=0.3), space.nodes)
    with pytest.raises(ValueError, match="expected 'gauss' or 'vertices'"):
        element_stress(space, stiff, space.nodes, at="centre")
