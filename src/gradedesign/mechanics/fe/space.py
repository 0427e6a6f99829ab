"""Nodes and elements of a linear or quadratic finite element space on tetrahedra.

Quadratic elements are straight-sided: the node of an edge is its midpoint. Nodes are the vertices
of the mesh followed by the edges, and both numberings are scikit-fem's own, so that the degree of
freedom ``3 * node + component`` is the same in both.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray, lock
from gradedesign.errors import MeshError
from gradedesign.geometry.tets.tet_mesh import TetMesh, signed_volumes
from gradedesign.mechanics.fe._space_kernels import LOCAL_EDGES, number_edges

if TYPE_CHECKING:
    from skfem import MeshTet

#: Element tables are 32-bit: they halve the memory traffic of assembly.
_ElementArray = NDArray[np.int32]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TetSpace:
    """A linear (order 1) or quadratic (order 2) space of displacements."""

    mesh: TetMesh
    order: int  #: 1 or 2.
    #: ``(3, n)``, mm. Vertices of the mesh, then for order 2 the midpoints of its edges.
    nodes: FloatArray
    #: ``(4 or 10, m)`` int32. Nodes of every tet: vertices, then edges 01, 12, 02, 03, 13, 23.
    elements: _ElementArray

    def __post_init__(self) -> None:
        if self.order not in (1, 2):
            raise ValueError(f"order is {self.order}, expected 1 (linear) or 2 (quadratic)")
        rows = 4 if self.order == 1 else 10
        lock(self, nodes=(3, None))
        lock(self, dtype=np.int32, elements=(rows, self.mesh.tets.shape[1]))

    @property
    def node_count(self) -> int:
        """Number of nodes."""
        return self.nodes.shape[1]

    @property
    def dof_count(self) -> int:
        """Number of displacement components, three per node."""
        return 3 * self.nodes.shape[1]

    @property
    def element_count(self) -> int:
        """Number of tetrahedra."""
        return self.elements.shape[1]


def tet_space(mesh: TetMesh, order: int = 2) -> TetSpace:
    """Build the space of a mesh.

    Raises `MeshError` if the mesh is empty, holds a tet without positive volume, or a vertex of no
    tet.

    ``order``: 1 for linear, 2 for quadratic displacements. Linear ones are 20-50 % too stiff in
    bending and serve for comparison only.
    """
    _require_usable(mesh)
    tets = mesh.tets.astype(np.int32)
    if order == 1:
        return TetSpace(mesh=mesh, order=1, nodes=mesh.points, elements=tets)
    n = mesh.points.shape[1]
    edge_of, ends = number_edges(tets, n)
    if n + ends.shape[1] > np.iinfo(np.int32).max // 3:
        raise MeshError(f"{n + ends.shape[1]} nodes are more than 32-bit numbering allows")
    midpoints = 0.5 * (mesh.points[:, ends[0]] + mesh.points[:, ends[1]])
    return TetSpace(
        mesh=mesh,
        order=order,
        nodes=np.concatenate([mesh.points, midpoints], axis=1),
        elements=np.concatenate([tets, edge_of + np.int32(n)]),
    )


def vertex_space(space: TetSpace) -> TetSpace:
    """Linear space on the same mesh, whose nodes are the first nodes of `space`."""
    if space.order == 1:
        return space
    return TetSpace(mesh=space.mesh, order=1, nodes=space.mesh.points, elements=space.elements[:4])


def edge_ends(space: TetSpace) -> _ElementArray:
    """Vertices at the two ends of every edge node of a quadratic space, ``(2, n_edges)``."""
    n = space.mesh.points.shape[1]
    ends = np.zeros((2, space.node_count - n), np.int32)
    if space.order == 2:
        for k, (i, j) in enumerate(LOCAL_EDGES):
            edge = space.elements[4 + k] - n
            ends[0, edge] = space.elements[i]
            ends[1, edge] = space.elements[j]
    return ends


def skfem_mesh(space: TetSpace) -> MeshTet:
    """scikit-fem's mesh of the same vertices and tets, with the same numbering.

    A scikit-fem basis of ``ElementVector(ElementTetP1())`` or ``ElementVector(ElementTetP2())`` on
    it has degree of freedom ``3 * node + component`` for the nodes of `space`.
    """
    from skfem import MeshTet

    return MeshTet(
        np.array(space.mesh.points), np.array(space.mesh.tets), sort_t=False, validate=False
    )


def _require_usable(mesh: TetMesh) -> None:
    """Refuse a mesh on which stiffness would be singular or meaningless."""
    count = mesh.tets.shape[1]
    if count == 0:
        raise MeshError("the mesh has no tetrahedra; expected at least one")
    volume = signed_volumes(mesh)
    bad = np.flatnonzero(~(volume > 0.0))
    if bad.size:
        raise MeshError(
            f"{bad.size} of {count} tets have no positive volume, the first is tet {bad[0]} with "
            f"{volume[bad[0]]:.3g} mm^3; remesh with another size"
        )
    used = np.zeros(mesh.points.shape[1], dtype=bool)
    used[mesh.tets.ravel()] = True
    if not used.all():
        raise MeshError(
            f"{np.count_nonzero(~used)} of {used.size} vertices belong to no tet; remove them "
            f"from the mesh first"
        )
