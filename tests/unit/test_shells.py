"""Shells thinner than the grid: the printed surface between the part's faces and the skin's."""

import numpy as np
import pytest
import trimesh

from gradedesign.lattice.domain import DesignDomain
from gradedesign.lattice.lattice import LatticeDesign
from gradedesign.lattice.skin import Skin
from gradedesign.lattice.trim import trimmed_surface
from gradedesign.mesh.crossings import TOUCHING, crossing_triangles
from gradedesign.mesh.surface_mesh import SurfaceMesh, corner_points
from gradedesign.part.box import box_surface
from gradedesign.part.signed_distance import surface_distance

#: Nothing is solid but the skin.
NOTHING = {
    "shape": lambda u: np.ones(u.shape[1:]) + 0.1 * u[0],
    "level_of": lambda rho: rho * 0,
    "cell_map": lambda p: np.asarray(p) / 4.0,
    "cell_size": 4.0,
    "density": 0.3,
}


def turned(surface):
    """Off the axes of the grid."""
    matrix = trimesh.transformations.euler_matrix(0.3, 0.5, 0.7)[:3, :3]
    return SurfaceMesh(vertices=surface.vertices @ matrix.T, faces=surface.faces)


def ball():
    mesh = trimesh.creation.icosphere(subdivisions=5, radius=12.0)
    return SurfaceMesh(vertices=mesh.vertices, faces=mesh.faces)


def shell(part, thickness):
    domain = DesignDomain(
        distance=surface_distance(part),
        lower=part.vertices.min(axis=0),
        upper=part.vertices.max(axis=0),
        skins=(Skin(thickness=thickness),),
    )
    return LatticeDesign(domain=domain, **NOTHING)


def inner_depths(part, thickness, step=1.0):
    """Depths below the part's surface all over the inner face of its shell, mm."""
    design = shell(part, thickness)
    distance = design.domain.distance
    corners = corner_points(trimmed_surface(design, part, step))
    share = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 1, 1], [1, 0, 1], [1, 1, 1]])
    share = share / share.sum(axis=1, keepdims=True)
    depths = -distance(np.einsum("pc,tcd->dtp", share, corners))
    inner = (depths > 0.01).all(axis=1)
    assert inner.sum() > 1000
    return depths[inner]


@pytest.mark.parametrize("thickness", [0.3, 2.5])
def test_a_shell_of_a_fraction_of_the_grid_has_its_thickness(thickness):
    """On a grid of 1 mm, within 0.1 mm everywhere."""
    depths = inner_depths(ball(), thickness)
    assert np.abs(depths - thickness).max() <= 0.1


@pytest.mark.parametrize("thickness", [0.3, 2.5])
def test_inner_edges_of_a_shell_have_its_thickness(thickness):
    """On a grid of 1 mm within 0.1 mm, of a box off the grid's axes: 0.54 mm by contouring alone.

    Inside a convex part the exact offset has sharp edges, so that every depth is the thickness.
    """
    box = turned(box_surface((21.0, 17.0, 19.0)))
    depths = inner_depths(box, thickness)
    assert np.abs(depths - thickness).max() <= 0.1


def test_no_triangles_cross_at_inner_edges_of_a_shell():
    box = turned(box_surface((21.0, 17.0, 19.0)))
    surface = trimmed_surface(shell(box, 0.3), box, 1.0)
    assert len(crossing_triangles(surface.vertices, surface.faces, TOUCHING)) == 0
