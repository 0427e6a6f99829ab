"""Numbering of finite element spaces, against scikit-fem and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from skfem import Basis, ElementTetP1, ElementTetP2, ElementVector, MeshTet

from gradedesign.errors import MeshError
from gradedesign.geometry.tets.tet_mesh import TetMesh
from gradedesign.mechanics.fe.space import edge_ends, skfem_mesh, tet_space, vertex_space


def scrambled_box(shape: tuple[int, int, int], seed: int = 7) -> TetMesh:
    """A unit box of tets with vertices and tets in random order."""
    box = MeshTet.init_tensor(*[np.linspace(0.0, 1.0, n + 1) for n in shape])
    rng = np.random.default_rng(seed)
    order = rng.permutation(box.p.shape[1])
    points = np.zeros_like(box.p)
    points[:, order] = box.p
    tets = order[box.t][:, rng.permutation(box.t.shape[1])]
    edges = points[:, tets[1:]] - points[:, tets[:1]]
    negative = np.linalg.det(edges.transpose(2, 0, 1)) < 0
    tets[:2, negative] = tets[1::-1, negative]
    return TetMesh(points=points, tets=tets)


@pytest.mark.parametrize(("order", "element"), [(1, ElementTetP1()), (2, ElementTetP2())])
def test_numbering_is_that_of_scikit_fem(order, element):
    space = tet_space(scrambled_box((3, 2, 4)), order)
    basis = Basis(skfem_mesh(space), ElementVector(element))
    for component in range(3):
        np.testing.assert_array_equal(
            basis.element_dofs[component::3], 3 * space.elements + component
        )
        np.testing.assert_allclose(basis.doflocs[:, component::3], space.nodes, rtol=0, atol=1e-15)
    assert space.dof_count == basis.N
    assert space.element_count == 3 * 2 * 4 * 6


def test_every_edge_node_is_the_midpoint_of_its_ends():
    space = tet_space(scrambled_box((2, 2, 2)), 2)
    ends = edge_ends(space)
    assert ends.shape[1] == np.unique(ends[0] * 1000 + ends[1]).size
    n = space.mesh.points.shape[1]
    np.testing.assert_allclose(
        space.nodes[:, n:], space.nodes[:, ends].mean(axis=1), rtol=0, atol=1e-15
    )


def test_vertex_space_keeps_the_first_nodes():
    space = tet_space(scrambled_box((2, 1, 1)), 2)
    linear = vertex_space(space)
    assert linear.order == 1
    np.testing.assert_array_equal(linear.nodes, space.nodes[:, : linear.node_count])
    assert vertex_space(linear) is linear
    assert edge_ends(linear).shape == (2, 0)


def test_arrays_are_locked():
    space = tet_space(scrambled_box((1, 1, 1)), 2)
    with pytest.raises(ValueError, match="read-only"):
        space.nodes[0, 0] = 1.0


CORNERS = np.array([[0.0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def test_unusable_meshes_are_refused():
    with pytest.raises(MeshError, match="no tetrahedra"):
        tet_space(TetMesh(points=CORNERS, tets=np.zeros((4, 0), dtype=int)))
    with pytest.raises(MeshError, match=r"1 of 1 tets have no positive volume.*-0\.167 mm\^3"):
        tet_space(TetMesh(points=CORNERS, tets=[[0], [2], [1], [3]]))
    lonely = np.concatenate([CORNERS, [[9.0], [9.0], [9.0]]], axis=1)
    with pytest.raises(MeshError, match="1 of 5 vertices belong to no tet"):
        tet_space(TetMesh(points=lonely, tets=[[0], [1], [2], [3]]))
    with pytest.raises(ValueError, match="order is 3"):
        tet_space(TetMesh(points=CORNERS, tets=[[0], [1], [2], [3]]), 3)
