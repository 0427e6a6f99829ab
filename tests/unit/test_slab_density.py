"""Densities of slabs: volumes below planes against closed forms, and a lattice with known ones."""

import manifold3d
import numpy as np
import pytest
from plain_cells import plain_cells

from gradedesign.geometry.lattice.components.skin import Skin
from gradedesign.geometry.lattice.density_grid import DensityGrid
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import LatticeDesign, lattice_field
from gradedesign.geometry.lattice.slab_density import slab_density, slab_edges, total, volumes_below
from gradedesign.geometry.lattice.trim import trimmed_surface
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh


def test_volumes_below_planes_of_a_tilted_tetrahedron_and_a_box():
    # A right corner of edge 2: below z = h there remains 8/6 - (2 - h)^3/6.
    corners = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2.0]]) + np.array([5.0, -7.0, 3.0])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    tet = SurfaceMesh(vertices=corners, faces=faces)
    h = np.array([-1.0, 0.0, 0.3, 1.0, 1.9, 2.0, 5.0])
    inside = np.clip(h, 0, 2)
    for axis in range(3):
        found = volumes_below(tet, axis, h + [5.0, -7.0, 3.0][axis])
        np.testing.assert_allclose(found, (8 - (2 - inside) ** 3) / 6, atol=1e-12)
    box = box_surface((4.0, 5.0, 6.0))
    np.testing.assert_allclose(volumes_below(box, 1, np.array([0.0, 2.0, 5.0])), [0, 48, 120])


def test_volumes_below_planes_equal_a_boolean_cut():
    ball = manifold3d.Manifold.sphere(10.0, 40).translate([100.0, 0, 0])
    mesh = ball.to_mesh64()
    surface = SurfaceMesh(vertices=mesh.vert_properties[:, :3], faces=mesh.tri_verts.astype(int))
    for plane in (93.7, 100.0, 108.2):
        below = ball.trim_by_plane([-1.0, 0, 0], -plane).volume()
        assert volumes_below(surface, 0, np.array([plane]))[0] == pytest.approx(below, rel=1e-9)


def test_a_thin_last_slab_joins_the_one_before():
    np.testing.assert_allclose(slab_edges(1.0, 30.0, 10.0), [1, 11, 21, 30])
    np.testing.assert_allclose(slab_edges(0.0, 24.0, 10.0), [0, 10, 24])
    np.testing.assert_allclose(slab_edges(0.0, 3.0, 10.0), [0, 3])


def slabs_design(density, **more):
    """Plates across z: |z - 1/2| <= rho / 2 in cells of 10 mm, so t(rho) = rho / 2."""
    half = np.array([20.0, 5.0, 5.0])

    def part(p):
        return (np.abs(p - half.reshape(3, *[1] * (p.ndim - 1))).T - half).T.max(axis=0)

    return LatticeDesign(
        domain=DesignDomain(distance=part, lower=[0, 0, 0], upper=[40, 10, 10], **more),
        cells=plain_cells(lambda u: np.abs(u[2] - np.floor(u[2]) - 0.5), 0.0, 0.5),
        cell_map=lambda p: p / 10.0,
        cell_size=10.0,
        density=density,
    )


def test_target_field_and_surface_agree_on_a_ramp():
    x = np.linspace(-10, 50, 7)
    values = np.broadcast_to((0.2 + 0.01 * x)[:, None, None], (7, 4, 4))
    design = slabs_design(DensityGrid(origin=[-10, -10, -10], spacing=10.0, values=values))
    part = box_surface((40.0, 10.0, 10.0))
    surface = trimmed_surface(design, part, 0.5)
    slabs = slab_density(design, lattice_field(design), surface, part, axis=0, thickness=10.0)
    expected = [0.25, 0.35, 0.45, 0.55]
    np.testing.assert_allclose(slabs.target, expected, atol=1e-4)
    np.testing.assert_allclose(slabs.field, expected, atol=1e-3)
    np.testing.assert_allclose(slabs.surface, expected, atol=1e-3)
    assert total(slabs, "surface") == pytest.approx(0.4, abs=1e-3)


def test_skin_counts_as_solid_in_the_target():
    design = slabs_design(0.5, components=(Skin(thickness=1.0),))
    part = box_surface((40.0, 10.0, 10.0))
    surface = trimmed_surface(design, part, 0.5)
    slabs = slab_density(design, lattice_field(design), surface, part, axis=2, thickness=10.0)
    core = 38 * 8 * 8 / 4000
    assert slabs.target[0] == pytest.approx(1 - 0.5 * core, abs=1e-3)
    # The plate of 5 mm inside, the skin of 1 mm around it.
    assert slabs.field[0] == pytest.approx(1 - 38 * 8 * 3 / 4000, abs=1e-3)
    # Inner edges of the skin are cut by half a grid step.
    assert slabs.surface[0] == pytest.approx(1 - 38 * 8 * 3 / 4000, abs=4e-3)
