"""Supports: every node of a facet is held, and contradictions are refused."""

import numpy as np
import pytest

from gradedesign.errors import CaseError, SolverError
from gradedesign.geometry.tets.tet_mesh import TetMesh, boundary_facets
from gradedesign.mechanics.fe.facets import facet_nodes, facet_owners
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.supports import Supports, supports_at, supports_on


def cube(n=2):
    """A cube of n^3 boxes of six tets, vertices moved off the grid inside."""
    grid = np.array(np.meshgrid(*[np.arange(n + 1.0)] * 3, indexing="ij")).reshape(3, -1)
    strides = np.array([(n + 1) ** 2, n + 1, 1])
    first = np.arange((n + 1) ** 3).reshape([n + 1] * 3)[:-1, :-1, :-1].ravel()
    tets = []
    for order in [(0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (1, 0, 2), (2, 1, 0)]:
        path = np.cumsum([0, *strides[list(order)]])
        t = first + path[:, None]
        tets.append(t if order in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] else t[[0, 1, 3, 2]])
    inside = ((grid > 0) & (grid < n)).all(axis=0)
    grid[:, inside] += np.random.default_rng(7).uniform(-0.2, 0.2, (3, inside.sum()))
    return TetMesh(points=grid, tets=np.concatenate(tets, axis=1))


def on_plane(mesh, axis, value):
    facets, _ = boundary_facets(mesh)
    return facets[(mesh.points[axis][facets] == value).all(axis=1)]


@pytest.mark.parametrize("order", [1, 2])
def test_every_node_in_the_plane_is_held(order):
    # Oracle: the coordinates of all nodes, which know nothing of facets.
    space = tet_space(cube(), order)
    held = supports_on(space, [(on_plane(space.mesh, 0, 0.0), (0.0, None, 0.3))])
    plane = space.nodes[0] == 0.0
    assert np.array_equal(held.fixed, np.array([plane, np.zeros_like(plane), plane]))
    assert np.array_equal(held.value, np.array([0.0 * plane, 0.0 * plane, 0.3 * plane]))


def test_facet_nodes_are_corners_then_edge_middles():
    space = tet_space(cube())
    facets, _ = boundary_facets(space.mesh)
    shuffled = np.take_along_axis(
        facets, np.random.default_rng(3).permuted(np.tile([0, 1, 2], (len(facets), 1)), axis=1), 1
    )
    nodes = facet_nodes(space, shuffled)
    assert np.array_equal(np.sort(nodes[:3], axis=0), np.sort(facets, axis=1).T)
    a, b, c, ab, bc, ca = (space.nodes[:, n] for n in nodes)
    for middle, p, q in [(ab, a, b), (bc, b, c), (ca, c, a)]:
        assert np.array_equal(middle, 0.5 * (p + q))
    # Counter-clockwise from outside: the normal points away from the centre of the cube.
    normal = np.cross(b - a, c - a, axis=0)
    assert (np.einsum("ij,ij->j", normal, a - 1.0) > 0).all()


def test_owners_are_those_of_the_boundary():
    mesh = cube()
    facets, owners = boundary_facets(mesh)
    found, sides, sharing = facet_owners(tet_space(mesh), facets)
    assert np.array_equal(found, owners)
    assert (sharing == 1).all()
    opposite = mesh.tets[sides, owners]
    assert not (facets == opposite[:, None]).any()


def test_overlap_with_equal_values_is_fine():
    space = tet_space(cube())
    pair = [(on_plane(space.mesh, axis, 0.0), (0.0, 0.1 + 0.2, None)) for axis in (0, 1)]
    pair[1] = (pair[1][0], (None, 0.3, None))  # equal to rounding
    assert supports_on(space, pair).fixed[1].sum() > supports_on(space, pair[:1]).fixed[1].sum()


def test_contradiction_names_the_place():
    space = tet_space(cube())
    with pytest.raises(CaseError, match=r"y displacement of 5 common nodes.*0 mm and 0\.1 mm at"):
        supports_on(
            space,
            [
                (on_plane(space.mesh, 0, 0.0), (0.0, 0.0, 0.0)),
                (on_plane(space.mesh, 2, 2.0), (None, 0.1, None)),
            ],
        )


def test_nodes_can_be_held_directly():
    space = tet_space(cube())
    held = supports_at(space, [([3, 40], (None, None, -1.0)), ([3], (0.5, None, -1.0))])
    assert np.argwhere(held.fixed).tolist() == [[0, 3], [2, 3], [2, 40]]
    assert held.value[:, 3].tolist() == [0.5, 0.0, -1.0]


def test_facets_of_another_mesh_are_refused():
    space = tet_space(cube())
    with pytest.raises(SolverError, match="no face of any tetrahedron"):
        supports_on(space, [(np.array([[0, 1, 26]]), (0.0, 0.0, 0.0))])
    with pytest.raises(SolverError, match="no facet was given"):
        supports_on(space, [(np.zeros((0, 3), int), (0.0, 0.0, 0.0))])
    with pytest.raises(ValueError, match="refer to vertices 0 to 27, the mesh has 27"):
        supports_on(space, [(np.array([[0, 1, 27]]), (0.0, 0.0, 0.0))])


def test_a_value_without_a_support_is_refused():
    with pytest.raises(ValueError, match="not fixed"):
        Supports(fixed=np.zeros((3, 2), bool), value=np.ones((3, 2)))
