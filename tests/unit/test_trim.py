"""The trimmed surface has the part's own faces and the exact volume."""

import numpy as np
import pytest

from gradedesign.lattice.domain import DesignDomain, PassiveRegion
from gradedesign.lattice.lattice import LatticeDesign
from gradedesign.lattice.skin import Skin
from gradedesign.lattice.trim import trimmed_surface
from gradedesign.mesh.surface_mesh import (
    area_vectors,
    enclosed_volume,
    open_edge_count,
)
from gradedesign.part.box import box_surface
from gradedesign.part.signed_distance import surface_distance

SIZE = (12.0, 8.0, 8.0)


def _design(**changes) -> LatticeDesign:
    """Flat sheets of half a cell normal to y, so that every volume is known."""
    values = {
        "shape": lambda u: np.abs(np.mod(u[1], 1.0) - 0.5),
        "level_of": lambda rho: np.asarray(rho) / 2,
        "cell_map": lambda x: x / 8.0,
        "cell_size": 8.0,
        "density": 0.5,
    }
    domain = DesignDomain(
        distance=surface_distance(box_surface(SIZE)), lower=(0.0, 0.0, 0.0), upper=SIZE, **changes
    )
    return LatticeDesign(domain=domain, **values)


def test_a_plate_is_cut_exactly():
    """One plate 4 mm thick through the box: 12 x 4 x 8 mm^3, by geometry."""
    surface = trimmed_surface(_design(), box_surface(SIZE), 0.5)
    assert open_edge_count(surface) == 0
    assert enclosed_volume(surface) == pytest.approx(12 * 4 * 8, rel=1e-4)
    assert np.ptp(surface.vertices, axis=0) == pytest.approx([12.0, 4.0, 8.0], abs=1e-3)


def test_faces_on_the_part_are_flat():
    """The two cut faces at x = 0 and x = 12 mm have 4 x 8 mm^2 each."""
    surface = trimmed_surface(_design(), box_surface(SIZE), 0.5)
    normals = area_vectors(surface)
    assert normals[normals[:, 0] > 0, 0].sum() == pytest.approx(32.0, rel=1e-3)


def test_skin_and_passive_regions_keep_their_depth():
    """A skin of 1 mm leaves a void of 10 x (6 - 4) x 6 mm^3 beside the plate."""
    surface = trimmed_surface(_design(skins=(Skin(thickness=1.0),)), box_surface(SIZE), 0.25)
    assert enclosed_volume(surface) == pytest.approx(12 * 8 * 8 - 10 * 2 * 6, rel=3e-3)
    kept = PassiveRegion(distance=lambda x: np.abs(x[0]), margin=2.0)
    surface = trimmed_surface(_design(passive=(kept,)), box_surface(SIZE), 0.25)
    assert enclosed_volume(surface) == pytest.approx(2 * 64 + 10 * 32, rel=3e-3)
