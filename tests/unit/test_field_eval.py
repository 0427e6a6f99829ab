"""Interpolation of nodal fields at arbitrary points."""

import numpy as np
import pytest

from gradedesign.geometry.tets.tet_mesh import TetMesh
from gradedesign.mechanics.fe.element_points import interpolate
from gradedesign.mechanics.fe.space import tet_space

MESH = TetMesh(  # two tets that share a face
    points=np.array([[0.0, 2, 0.3, 0.1, 1.5], [0, 0.2, 1.8, 0.4, 1.6], [0, -0.1, 0.2, 1.3, 1.9]]),
    tets=np.array([[0, 4], [1, 2], [2, 1], [3, 3]]),
)


def polynomial(x, degree):
    """A vector field of a given degree."""
    if degree == 1:
        return np.array([1 + x[0] - 2 * x[1], 3 * x[2], x[0] + x[1] + x[2]])
    return np.array([x[0] ** 2 - x[1] * x[2], 1 + x[0] * x[1], 2 * x[2] ** 2 - x[0]])


def random_places(count):
    rng = np.random.default_rng(29)
    return rng.integers(0, 2, count), rng.dirichlet(np.ones(4), count).T


@pytest.mark.parametrize("order", [1, 2])
def test_polynomials_of_the_order_are_exact(order):
    space = tet_space(MESH, order)
    tets, barycentric = random_places(50)
    points = np.einsum("dkn,kn->dn", MESH.points[:, MESH.tets[:, tets]], barycentric)
    found = interpolate(space, polynomial(space.nodes, order), tets, barycentric)
    assert np.abs(found - polynomial(points, order)).max() < 1e-13


def test_nodes_return_their_values():
    space = tet_space(MESH)
    field = np.random.default_rng(31).normal(size=space.node_count)
    middle = 0.5 * (np.eye(4)[:, [0]] + np.eye(4)[:, [3]])  # local edge 03 is the fourth
    assert interpolate(space, field, np.array([1]), middle)[0] == field[space.elements[7, 1]]


def test_wrong_shapes_are_refused():
    space = tet_space(MESH)
    tets, barycentric = random_places(5)
    with pytest.raises(ValueError, match="the field has 5 nodes, the space 14"):
        interpolate(space, np.zeros((3, 5)), tets, barycentric)
    with pytest.raises(ValueError, match=r"expected \(4, 5\)"):
        interpolate(space, np.zeros(space.node_count), tets, barycentric[:3])
