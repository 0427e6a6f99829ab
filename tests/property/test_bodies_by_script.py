"""More than a hundred files of several bodies: each is read right, or refused as what it is."""

from __future__ import annotations

import numpy as np
import pytest
from body_variants import variants
from damaged_shapes import binary

from gradedesign.errors import PartError
from gradedesign.geometry.formats.read_stl import read_stl
from gradedesign.geometry.part.raw_triangles import in_mm
from gradedesign.geometry.part.repair import build_surface
from gradedesign.geometry.part.signed_distance import surface_distance
from gradedesign.geometry.triangles.surface_mesh import area_vectors, enclosed_volume

VARIANTS = {name: (bodies, corners) for name, bodies, corners in variants(41)}
#: Corners are within 180 mm of the origin: single precision moves each by at most 2^-24 of that in
#: every direction, joining by three times as far as faces come apart by it: 1e-4 mm together. So
#: much times the surface is 2e-5 of the volume, and times all edges 1e-4 of an area.
VOLUME, AREA = 2e-5, 1e-4


@pytest.fixture(params=VARIANTS)
def variant(request, tmp_path):
    bodies, corners = VARIANTS[request.param]
    path = tmp_path / "bodies.stl"
    path.write_bytes(binary(corners))
    return bodies, in_mm(read_stl(path), "mm", path.name).corners


def area_of(surface) -> float:
    return float(np.linalg.norm(area_vectors(surface), axis=1).sum())


def test_there_are_enough():
    assert len(VARIANTS) > 100


def test_bodies_are_read_right_or_refused(variant):
    bodies, corners = variant
    if bodies.solids > 1:
        with pytest.raises(PartError, match=f"bodies.stl: .*{bodies.solids} separate solids") as no:
            build_surface(corners, source="bodies.stl")
        assert (f"{bodies.solids} solids touch along" in str(no.value)) == (bodies.common > 0)
    else:
        surface, report = build_surface(corners, source="bodies.stl")
        assert enclosed_volume(surface) == pytest.approx(bodies.volume, rel=VOLUME)
        assert area_of(surface) == pytest.approx(bodies.area, rel=AREA)
        assert (report.bodies, report.common_area) == (1, 0.0)


def test_bodies_that_touch_are_joined(variant):
    bodies, corners = variant
    if bodies.joined > 1:
        with pytest.raises(PartError, match=f"{bodies.joined} separate solids"):
            build_surface(corners, bodies="join", source="bodies.stl")
        return
    surface, report = build_surface(corners, bodies="join", source="bodies.stl")
    assert enclosed_volume(surface) == pytest.approx(bodies.volume, rel=VOLUME)
    # What is left of the common faces would be in the surface, twice.
    assert area_of(surface) == pytest.approx(bodies.area, rel=AREA)
    assert report.common_area == pytest.approx(bodies.common, rel=AREA)
    assert report.bodies_joined == (bodies.solids if bodies.common else bodies.itself)
    said = [w for w in report.warnings if "were joined along" in w]
    assert len(said) == (bodies.common > 0)
    surface_distance(surface)


def test_bodies_that_touch_stay_apart(variant):
    bodies, corners = variant
    surface, report = build_surface(corners, bodies="all", source="bodies.stl")
    assert report.bodies == bodies.solids
    assert enclosed_volume(surface) == pytest.approx(bodies.volume, rel=VOLUME)
    assert area_of(surface) == pytest.approx(bodies.area + 2 * bodies.common, rel=AREA)
    assert report.common_area == pytest.approx(bodies.common, rel=AREA)
    distance = surface_distance(surface)
    # 0.01 mm inside every facet there is solid: also where the next body's facet is as near.
    across = area_vectors(surface)
    area = np.linalg.norm(across, axis=1)
    wide = area > 0.01
    middle = surface.vertices[surface.faces[wide]].mean(axis=1)
    inside = middle - 0.01 * across[wide] / area[wide, None]
    assert (distance(inside.T) < 0.0).all()
