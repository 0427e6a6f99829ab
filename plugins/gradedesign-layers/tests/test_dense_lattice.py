"""Layers of strut lattices with a net-skin: those of the field evaluated point by point."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from plain_cells import plain_cells

from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cells import single
from gradedesign.geometry.formats.printed_lattice import MeasuredField, PrintedLattice
from gradedesign.geometry.lattice.components.net_skin import NetSkin
from gradedesign.geometry.lattice.components.skin import Skin
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import LatticeDesign, lattice_field
from gradedesign.geometry.maps.cell_map import turned_axes, uniform_map
from gradedesign.geometry.part.signed_distance import surface_distance
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.program.host.registry import build_registry
from gradedesign_layers.dense_lattice import dense_lattice, strut_lattice
from gradedesign_layers.layers import _slice_at


def knot():
    """Trefoil knot of about 14 x 13 x 5 mm."""
    t, turn = np.linspace(0, 2 * np.pi, 61)[:-1], np.linspace(0, 2 * np.pi, 13)[:-1]
    centre = np.array(
        [np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)]
    )
    along = np.roll(centre, -1, axis=1) - np.roll(centre, 1, axis=1)
    side = np.cross(along.T, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side, axis=1)[:, None]
    up = np.cross(side, along.T)
    up /= np.linalg.norm(up, axis=1)[:, None]
    rim = side[:, None] * np.cos(turn)[:, None] + up[:, None] * np.sin(turn)[:, None]
    points = 2.3 * (centre.T[:, None] + 0.5 * rim)
    n, m = points.shape[:2]
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    a, b = i * m + j, (i + 1) % n * m + j
    c, d = (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
    faces = np.concatenate([np.stack(f, -1).reshape(-1, 3) for f in ((a, b, c), (a, c, d))])
    mesh = trimesh.Trimesh(points.reshape(-1, 3), faces)
    mesh.fix_normals()
    return SurfaceMesh(vertices=np.array(mesh.vertices), faces=np.array(mesh.faces, dtype=np.int64))


def design_of(cell, *, rotation=None, net=True, **parameters):
    family = build_registry().cell_families[cell]
    calibrated = calibrate(family, parameters)
    surface = knot()
    distance = surface_distance(surface)
    nets = (NetSkin(thickness=0.3, reach=2.0, outward=distance.outward),) if net else ()
    design = LatticeDesign(
        domain=DesignDomain(
            distance=distance,
            lower=surface.vertices.min(axis=0),
            upper=surface.vertices.max(axis=0),
            components=nets,
        ),
        cells=single(calibrated),
        cell_map=uniform_map(2.0, (0.3, 0.1, 0.7), rotation),
        cell_size=2.0,
        density=0.2,
    )
    return surface, design


KINDS = [
    ("sc", {}),
    ("f2bcc", {}),
    ("bcc", {"node_ratio": 1.6, "rotation": turned_axes([20.0, 10.0, 5.0])}),
    ("sc", {"net": False}),
]


@pytest.mark.parametrize(("cell", "stated"), KINDS)
def test_layers_are_those_of_the_field_point_by_point(cell, stated):
    _, design = design_of(cell, **stated)
    nothing = SurfaceMesh(vertices=np.zeros((0, 3)), faces=np.zeros((0, 3), dtype=np.int64))
    bounds = np.stack([design.domain.lower, design.domain.upper])
    fast = PrintedLattice(
        surface=nothing,
        name="knot",
        design=design,
        bodies=10_000,
        measured=MeasuredField(bounds=bounds, volume=1.0),
    )
    slow = replace(fast, design=None, field=lattice_field(design))
    layers, meant = (_slice_at(lattice, 0.5, 0.12) for lattice in (fast, slow))
    assert strut_lattice(design, 0.12) is not None
    assert len(layers.layers) == len(meant.layers) > 5
    for one, other in zip(layers.layers, meant.layers, strict=True):
        np.testing.assert_array_equal(one.first, other.first)
        np.testing.assert_array_equal(one.ends, other.ends)
        # Where the nearest face changes, the net ends in a step: values there may be larger than a
        # step of the samples, where they are not exact. 10 % move a line by 0.025 steps at most.
        near = np.abs(other.beside) < 0.12
        np.testing.assert_allclose(one.beside[near], other.beside[near], atol=1e-6)
        np.testing.assert_allclose(one.beside[~near], other.beside[~near], rtol=0.1)
        assert near.any()


def test_other_lattices_take_the_general_way():
    _, design = design_of("sc")
    skinned = replace(design.domain, components=(Skin(thickness=0.3),))
    assert strut_lattice(replace(design, domain=skinned), 0.1) is None
    no_struts = plain_cells(design.cells.shape, 0.1, 0.1)
    assert strut_lattice(replace(design, cells=no_struts), 0.1) is None
    field = dense_lattice(replace(design, domain=skinned), 0.3)
    points = np.random.default_rng(3).uniform(-6, 6, (3, 2000))
    exact = lattice_field(replace(design, domain=skinned))(points)
    assert ((field(points) < 0) == (exact < 0)).all()
    assert (field.part(points)[design.domain.distance(points) < 0] < 0).all()
