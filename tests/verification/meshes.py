"""Structured tetrahedral meshes, straight or mapped on curved shapes, for the benchmarks.

Every mesh starts as a grid of boxes in parameters (u, v, w) of the unit cube; each box is cut in
six tetrahedra round its main diagonal (Kuhn), and a map moves the vertices. Vertices on a curved
boundary lie on the true curve; edges are straight.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import permutations

import numpy as np

from gradedesign.geometry.tets.tet_mesh import TetMesh, boundary_facets
from gradedesign.mechanics.fe.element_points import ScalarField
from gradedesign.mechanics.fe.facets import facet_areas, facet_nodes
from gradedesign.mechanics.fe.loads import traction_force
from gradedesign.mechanics.fe.solution import LoadVector, Solution
from gradedesign.mechanics.fe.solve import solve_elastic
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.fe.stiffness import IsotropicStiffness
from gradedesign.mechanics.fe.stress import element_stress, nodal_average

Map = Callable[[np.ndarray], np.ndarray]


def mapped_mesh(cells: tuple[int, int, int], mapping: Map, *, flip=(False, False, False)):
    """Mesh of the unit cube moved by a map (3, n) -> (3, n).

    ``flip`` mirrors the cutting diagonals along an axis.
    """
    nx, ny, nz = cells
    index = np.arange((nx + 1) * (ny + 1) * (nz + 1)).reshape(nx + 1, ny + 1, nz + 1)
    first = index[:-1, :-1, :-1].ravel()
    strides = np.array([(ny + 1) * (nz + 1), nz + 1, 1])
    tets = []
    for order in permutations(range(3)):
        path = np.cumsum([0, *(strides[axis] for axis in order)])
        tets.append(first + path[:, None])
    tets = np.concatenate(tets, axis=1)
    grid = np.meshgrid(*(np.linspace(0, 1, n + 1) for n in cells), indexing="ij")
    unit = np.array([g.ravel() for g in grid])
    for axis in range(3):
        if flip[axis]:
            unit[axis] = 1 - unit[axis]
    points = np.asarray(mapping(unit), dtype=np.float64)
    a, b, c, d = (points[:, t] for t in tets)
    negative = np.einsum("ij,ij->j", b - a, np.cross(c - a, d - a, axis=0)) < 0
    tets[2:, negative] = tets[3:1:-1, negative]
    return TetMesh(points=points, tets=tets)


def quarter_ring(radial, around, *, inner=100.0, outer=200.0, length=10.0):
    """A quarter of a thick ring about the z axis, finer towards the inside."""

    def ring(u):
        radius = inner * (outer / inner) ** u[0]
        angle = 0.5 * np.pi * u[1]
        points = np.array([radius * np.cos(angle), radius * np.sin(angle), length * u[2]])
        points[0, u[1] == 1] = 0.0
        return points

    return mapped_mesh((radial, around, 1), ring)


def box_mesh(size, cells, *, origin=(0.0, 0.0, 0.0)) -> TetMesh:
    """A straight box, mm."""
    size, origin = np.asarray(size, float), np.asarray(origin, float)
    return mapped_mesh(cells, lambda u: origin[:, None] + size[:, None] * u)


def facets_where(mesh: TetMesh, condition: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Boundary facets (k, 3) whose three corners (3, k) all meet a condition."""
    facets, _ = boundary_facets(mesh)
    corners = mesh.points[:, facets]
    chosen = condition(corners).all(axis=1)
    return facets[chosen]


def face(mesh: TetMesh, axis: int, value: float, tolerance: float = 1e-9) -> np.ndarray:
    """Boundary facets in the plane ``x[axis] = value``."""
    return facets_where(mesh, lambda p: np.abs(p[axis] - value) < tolerance)


def nodes_of(space: TetSpace, facets: np.ndarray) -> np.ndarray:
    """Nodes of facets, edge middles included."""
    return np.unique(facet_nodes(space, facets))


def vertex_at(mesh: TetMesh, point) -> int:
    """The vertex at a point; the mesh must have one there."""
    distance = np.linalg.norm(mesh.points - np.asarray(point, float)[:, None], axis=0)
    assert distance.min() < 1e-9 * max(1.0, np.abs(mesh.points).max())
    return int(distance.argmin())


def stress_at_vertex(
    space: TetSpace,
    stiffness: IsotropicStiffness,
    displacement: np.ndarray,
    point,
    thermal_strain: ScalarField = 0.0,
) -> np.ndarray:
    """Average of the element corner stresses at a vertex, (3, 3), MPa."""
    stress = element_stress(
        space, stiffness, displacement, thermal_strain=thermal_strain, at="vertices"
    )
    return nodal_average(space, stress)[:, :, vertex_at(space.mesh, point)]


def uniform(space: TetSpace, E: float, nu: float) -> IsotropicStiffness:
    """The same material everywhere."""
    return IsotropicStiffness(E=np.full(space.element_count, E), nu=nu)


def solve_one(space, stiffness, supports, force, **options) -> Solution:
    """The solution of a single load."""
    (solution,) = solve_elastic(
        space, stiffness, [LoadVector(name="load", supports=supports, force=force)], **options
    )
    return solution


def mean_on(space: TetSpace, facets: np.ndarray, displacement: np.ndarray) -> np.ndarray:
    """Mean displacement of facets by area, (3,): their work on a unit uniform traction."""
    weights = traction_force(space, facets, (1.0, 1.0, 1.0)) / facet_areas(space, facets).sum()
    return (weights * displacement).sum(axis=1)
