"""Shells thinner than the grid: the printed surface between the part's faces and the skin's."""

import numpy as np
import pytest
import trimesh
from plain_cells import plain_cells

from gradedesign.geometry.lattice.components.skin import Skin
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.geometry.lattice.trim import trimmed_surface
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.signed_distance import surface_distance
from gradedesign.geometry.triangles.crossings import TOUCHING, crossing_triangles
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points

#: Nothing is solid but the skin.
NOTHING = {
    "cells": plain_cells(lambda u: np.ones(u.shape[1:]) + 0.1 * u[0]),
    "cell_map": lambda p: np.asarray(p) / 4.0,
    "cell_size": 4.0,
    "density": 0.3,
}


def turned(surface, angles=(0.3, 0.5, 0.7)):
    """Off the axes of the grid."""
    matrix = trimesh.transformations.euler_matrix(*angles)[:3, :3]
    return SurfaceMesh(vertices=surface.vertices @ matrix.T, faces=surface.faces)


def ball():
    mesh = trimesh.creation.icosphere(subdivisions=5, radius=12.0)
    return SurfaceMesh(vertices=mesh.vertices, faces=mesh.faces)


def shell(part, thickness):
    domain = DesignDomain(
        distance=surface_distance(part),
        lower=part.vertices.min(axis=0),
        upper=part.vertices.max(axis=0),
        components=(Skin(thickness=thickness),),
    )
    return LatticeDesign(domain=domain, **NOTHING)


def inner_depths(part, thickness, step=1.0):
    """Depths below the part's surface all over the inner face of its shell, mm."""
    design = shell(part, thickness)
    distance = design.domain.distance
    corners = corner_points(trimmed_surface(design, part, step))
    share = np.array([(i, j, 4 - i - j) for i in range(5) for j in range(5 - i)]) / 4
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


def angle():
    """A prism 15 mm high with one re-entrant edge."""
    outline = np.array([(0, 0), (24, 0), (24, 9), (9, 9), (9, 22), (0, 22)], dtype=float)
    vertices = np.vstack([np.column_stack([outline, np.full(6, z)]) for z in (0.0, 15.0)])
    lower = np.array([(3, 4, 5), (3, 5, 0), (3, 0, 1), (3, 1, 2)])
    i, j = np.arange(6), np.roll(np.arange(6), -1)
    sides = [np.column_stack([i, j, j + 6]), np.column_stack([i, j + 6, i + 6])]
    return SurfaceMesh(vertices=vertices, faces=np.concatenate([lower[:, ::-1], lower + 6, *sides]))


@pytest.mark.parametrize(
    ("part", "angles", "thickness"),
    [
        (box_surface((21.0, 17.0, 19.0)), (0.6, 0.6, 0.1), 0.3),
        (angle(), (0.6, 0.6, 0.1), 0.3),
        (angle(), (0.0, 0.0, 0.4), 2.5),
    ],
    ids=["three sides of a triangle on three faces", "round a re-entrant edge", "folds"],
)
def test_corners_and_re_entrant_edges_of_a_shell_have_its_thickness(part, angles, thickness):
    """Within 0.1 mm on a grid of 1 mm; 0.140, 0.112 and 0.500 mm without corners and collapses."""
    depths = inner_depths(turned(part, angles), thickness)
    assert np.abs(depths - thickness).max() <= 0.1
