"""Distances in a band of a surface: equal to the exact ones, and bounds beyond."""

import numpy as np
import pytest
import trimesh

from gradedesign.errors import LatticeError
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.signed_distance import surface_distance
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign_layers.surface_band import surface_band


def ring():
    """A torus of few triangles, with sharp edges."""
    mesh = trimesh.creation.torus(4.0, 1.5, major_sections=17, minor_sections=7)
    return SurfaceMesh(vertices=np.array(mesh.vertices), faces=np.array(mesh.faces, dtype=np.int64))


@pytest.mark.parametrize("surface", [ring(), box_surface((4.0, 3.0, 2.0))], ids=["ring", "box"])
@pytest.mark.parametrize(("inner", "outer", "edge"), [(0.6, 0.2, 0.15), (0.1, 0.5, 0.4)])
def test_band_is_exact_inside_and_a_bound_beyond(surface, inner, outer, edge):
    exact = surface_distance(surface)
    band = surface_band(exact, edge, inner=inner, outer=outer)
    low, high = surface.vertices.min(axis=0) - 1.0, surface.vertices.max(axis=0) + 1.0
    random = np.random.default_rng(913)
    points = random.uniform(low[:, None], high[:, None], (3, 20_000))
    points[:, :500] = surface.vertices[random.integers(0, len(surface.vertices), 500)].T
    meant, found = exact(points), band(points)
    near = (meant >= -inner) & (meant <= outer)
    assert 1000 < near.sum() < 15_000
    np.testing.assert_allclose(found[near], meant[near], atol=1e-12)
    away = ~near
    assert ((found[away] < 0) == (meant[away] < 0)).all()
    assert (np.abs(found[away]) <= np.abs(meant[away]) + 1e-9).all()
    assert (found[away & (meant > 0)] > outer).all()
    assert (found[away & (meant < 0)] < -inner).all()


def test_band_without_width_is_refused():
    exact = surface_distance(box_surface((1.0, 1.0, 1.0)))
    with pytest.raises(LatticeError, match="expected all above 0 mm"):
        surface_band(exact, 0.1, inner=0.0, outer=0.1)
