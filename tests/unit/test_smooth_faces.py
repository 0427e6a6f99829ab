"""Smooth faces of solids whose faces are known by construction."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import manifold3d
import numpy as np
import pytest

from gradedesign.geometry.formats.read_stl import read_stl
from gradedesign.geometry.part._face_fits import Cylinder, without_order
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.raw_triangles import in_mm
from gradedesign.geometry.part.repair import build_surface
from gradedesign.geometry.part.smooth_faces import segment_faces
from gradedesign.geometry.triangles.surface_mesh import area_vectors, enclosed_volume

SOLID, OUTLINE = manifold3d.Manifold, manifold3d.CrossSection
PARTS = Path(__file__).parents[3] / "shared" / "parts"


def surface_of(solid, rounding=np.float64):
    """Corners of a solid, rounded as an STL file would, welded again."""
    mesh = solid.to_mesh64()
    points = np.asarray(mesh.vert_properties)[:, :3].astype(rounding).astype(np.float64)
    return build_surface(points[np.asarray(mesh.tri_verts).astype(int)])[0]


def faces_of(surface):
    """Segment, and check what holds for every surface."""
    found = segment_faces(surface)
    assert len(found.label) == len(surface.faces)
    np.testing.assert_array_equal(np.unique(found.label), np.arange(len(found.faces)))
    area = np.linalg.norm(area_vectors(surface), axis=1).sum()
    assert sum(f.area for f in found.faces) == pytest.approx(area, rel=1e-12)
    return found


def kinds(found) -> dict[str, int]:
    return dict(Counter(face.kind for face in found.faces))


def cylinders(found):
    return [face for face in found.faces if face.kind == "cylinder"]


def test_box():
    found = faces_of(box_surface((10.0, 20.0, 30.0)))
    assert kinds(found) == {"plane": 6}
    normals = {tuple(np.round(f.normal).astype(int)): f for f in found.faces}
    assert len(normals) == 6
    top = normals[0, 0, 1]
    assert top.area == pytest.approx(200.0)
    np.testing.assert_allclose(top.centroid, [5.0, 10.0, 30.0])
    assert top.axis is top.diameter is top.concave is None


@pytest.mark.parametrize("sides", [12, 16, 64, 360])
@pytest.mark.parametrize("rounding", [np.float64, np.float32])
def test_box_with_a_facetted_hole(sides, rounding):
    hole = SOLID.cylinder(30, 4, 4, sides).translate([20, 20, -5])
    found = faces_of(surface_of(SOLID.cube([40, 40, 10]) - hole, rounding))
    assert kinds(found) == {"plane": 6, "cylinder": 1}
    (hole_face,) = cylinders(found)
    assert hole_face.concave
    assert hole_face.diameter == pytest.approx(8.0, rel=1e-5)
    np.testing.assert_allclose(hole_face.axis, [0, 0, 1], atol=1e-6)
    np.testing.assert_allclose(hole_face.point, [20, 20, 5], atol=1e-4)
    # Perimeter of a regular polygon in a circle of radius 4, times the height.
    assert hole_face.area == pytest.approx(10 * sides * 8 * np.sin(np.pi / sides), rel=1e-5)


def test_too_coarse_a_hole_is_planes():
    hole = SOLID.cylinder(30, 4, 4, 8).translate([20, 20, -5])
    assert kinds(faces_of(surface_of(SOLID.cube([40, 40, 10]) - hole))) == {"plane": 14}


def test_tilted_cylinder():
    tilted = SOLID.cylinder(30, 4, 4, 48).rotate([25, 40, 10]).translate([100, -50, 7])
    found = faces_of(surface_of(tilted, np.float32))
    assert kinds(found) == {"plane": 2, "cylinder": 1}
    (wall,) = cylinders(found)
    assert wall.concave is False
    assert wall.normal is None
    assert wall.diameter == pytest.approx(8.0, rel=1e-4)
    ends = [f for f in found.faces if f.kind == "plane"]
    line = ends[1].centroid - ends[0].centroid
    assert abs(line @ wall.axis) == pytest.approx(30.0, rel=1e-5)
    np.testing.assert_allclose(wall.point, (ends[0].centroid + ends[1].centroid) / 2, atol=1e-3)


@pytest.mark.parametrize("half_length", [0.3, 2.0, 8.0])
@pytest.mark.parametrize("segments", [16, 32, 100])
def test_slot_has_two_half_cylinders_and_two_planes(half_length, segments):
    ends = [OUTLINE.circle(3, segments).translate([s * half_length, 0]) for s in (-1, 1)]
    slot = SOLID.extrude(OUTLINE.batch_hull(ends), 30).translate([0, 0, -15])
    found = faces_of(surface_of(SOLID.cube([40, 40, 10], True) - slot))
    assert kinds(found) == {"plane": 8, "cylinder": 2}
    for face in cylinders(found):
        assert face.concave
        assert face.diameter == pytest.approx(6.0, rel=1e-6)
        assert abs(face.point[0]) == pytest.approx(half_length, rel=1e-6)
    straight = [f for f in found.faces if f.kind == "plane" and abs(f.centroid[1]) < 4]
    assert sorted(f.area for f in straight)[:2] == pytest.approx([20 * half_length] * 2)


@pytest.mark.parametrize("steps", [4, 9, 40])
def test_bracket_with_a_fillet(steps):
    turn = np.linspace(0, np.pi / 2, steps)
    arc = np.stack([10 - 5 * np.sin(turn), 10 - 5 * np.cos(turn)], axis=1)
    outline = np.concatenate([[[0, 0], [40, 0], [40, 5]], arc, [[5, 40], [0, 40]]])
    found = faces_of(surface_of(SOLID.extrude(OUTLINE([outline]), 20)))
    assert kinds(found) == {"plane": 8, "cylinder": 1}
    (fillet,) = cylinders(found)
    assert fillet.concave
    assert fillet.diameter == pytest.approx(10.0, rel=1e-6)
    np.testing.assert_allclose(fillet.point, [10, 10, 10], atol=1e-6)
    np.testing.assert_allclose(fillet.normal, np.sqrt([0.5, 0.5, 0]), atol=1e-9)
    walls = [f.area for f in found.faces if f.kind == "plane" and f.area == pytest.approx(600.0)]
    assert len(walls) == 2  # 20 mm x (40 - 10) mm


def test_rounded_box_parts_planes_edges_and_corners():
    balls = [
        SOLID.sphere(2, 32).translate([x, y, z])
        for x in (-10, 10)
        for y in (-6, 6)
        for z in (-4, 4)
    ]
    found = faces_of(surface_of(SOLID.batch_hull(balls)))
    assert kinds(found) == {"plane": 6, "cylinder": 12, "other": 8}
    planes = sorted(f.area for f in found.faces if f.kind == "plane")
    assert planes == pytest.approx([96, 96, 160, 160, 240, 240], rel=1e-9)
    assert all(f.diameter == pytest.approx(4.0, rel=1e-6) for f in cylinders(found))


@pytest.mark.parametrize("radii", [None, (8, 3)], ids=["sphere", "cone"])
def test_other_curved_faces_stay_whole(radii):
    solid = SOLID.sphere(10, 48) if radii is None else SOLID.cylinder(10, *radii, 48)
    found = faces_of(surface_of(solid))
    assert kinds(found) == ({"other": 1} if radii is None else {"cone": 1, "plane": 2})


def test_planes_at_a_shallow_angle_are_two_faces():
    rise = 10 * np.tan(np.radians(10))
    roof = OUTLINE([np.array([[0, 0], [20, 0], [20, 5], [10, 5 + rise], [0, 5]])])
    assert kinds(faces_of(surface_of(SOLID.extrude(roof, 20)))) == {"plane": 7}


def test_coaxial_steps_are_two_cylinders():
    stepped = SOLID.cylinder(10, 8, 8, 64) + SOLID.cylinder(20, 5, 5, 64)
    found = faces_of(surface_of(stepped))
    assert sorted(f.diameter for f in cylinders(found)) == pytest.approx([10.0, 16.0])


def read_inches(name: str):
    path = PARTS / name
    if not path.is_file():
        pytest.skip(f"{path} is not there")
    return build_surface(in_mm(read_stl(path), "inch", name).corners, source=name)


def test_machined_block():
    """Counted in the picture and in parts/README.md: volume 11.628 in^3, 3476 triangles."""
    surface, report = read_inches("featuretype.STL")
    assert report.facets_kept == 3476
    assert enclosed_volume(surface) / 25.4**3 == pytest.approx(11.628, abs=5e-4)
    found = faces_of(surface)
    sizes = Counter(round(f.diameter, 2) for f in cylinders(found) if f.normal is None)
    # Eight screws with counterbore (0.266 and 0.4375 in) and one cross bore (0.3894 in).
    assert sizes == {6.76: 8, 11.11: 8, 9.89: 1}
    shoulders = [
        f for f in found.faces if f.kind == "plane" and f.area == pytest.approx(60.8, abs=0.1)
    ]
    assert len(shoulders) == 8


def test_angle_block():
    """Volume 1.1455 in^3 and 704 triangles in parts/README.md."""
    surface, report = read_inches("angle_block.STL")
    assert report.facets_kept == 704
    assert enclosed_volume(surface) / 25.4**3 == pytest.approx(1.1455, abs=5e-5)
    found = faces_of(surface)
    assert kinds(found) == {"plane": 19, "cylinder": 7}
    holes = sorted(round(f.diameter / 25.4, 4) for f in cylinders(found) if f.normal is None)
    assert holes == pytest.approx([0.15625, 0.266], abs=1e-3)


#: Centres of four holes of 9 mm diameter through a plate of 60 x 40 x 10 mm.
BOLTS = np.array([(x, y) for x in (12.0, 48.0) for y in (10.0, 30.0)])


def plate_of_slivers(segments, splits, nearest, rng):
    """A plate with four holes whose walls are split at random, each new corner on its circle.

    The closer to an end an edge is split, down to a share ``nearest``, the thinner the slivers.
    """
    body = SOLID.cube((60, 40, 10))
    for x, y in BOLTS:
        body -= SOLID.cylinder(30, 4.5, 4.5, segments, True).translate((x, y, 5))
    mesh = body.to_mesh64()
    points = [tuple(p) for p in np.asarray(mesh.vert_properties)[:, :3]]
    facets = [tuple(t) for t in np.asarray(mesh.tri_verts).tolist()]

    def hole(corner):
        off = np.hypot(*(np.array(points[corner][:2]) - BOLTS).T) - 4.5
        return int(np.abs(off).argmin()) if np.abs(off).min() < 1e-3 else None

    walls = [k for k, t in enumerate(facets) if hole(t[0]) == hole(t[1]) == hole(t[2]) is not None]
    for _ in range(splits):
        facet = facets[walls[rng.integers(len(walls))]]
        side = int(rng.integers(3))
        a, b = facet[side - 1], facet[side]
        share = nearest + (1.0 - 2.0 * nearest) * rng.random()
        new = (1.0 - share) * np.array(points[a]) + share * np.array(points[b])
        centre = BOLTS[hole(a)]
        outward = new[:2] - centre
        new[:2] = centre + 4.5 * outward / np.hypot(*outward)
        points.append(tuple(new))
        for k in [k for k, t in enumerate(facets) if a in t and b in t]:
            last = len(points) - 1
            if k in walls:
                walls.append(len(facets))
            facets.append(tuple(last if c == a else c for c in facets[k]))
            facets[k] = tuple(last if c == b else c for c in facets[k])
    corners = np.array(points, dtype=np.float32).astype(np.float64)[np.array(facets)]
    return build_surface(corners)[0]


@pytest.mark.parametrize(
    ("segments", "splits", "nearest"),
    [(12, 150, 0.3), (16, 300, 0.02), (40, 400, 0.02), (64, 300, 0.2)],
)
def test_holes_are_found_on_slivers(segments, splits, nearest):
    """Facets of 40 segments turn by 9 degrees, slivers between their corners by any angle."""
    surface = plate_of_slivers(segments, splits, nearest, np.random.default_rng(20261123))
    found = faces_of(surface)
    holes = [face for face in cylinders(found) if abs(face.diameter - 9.0) < 0.01]
    assert len(holes) == 4
    assert all(face.concave for face in holes)
    centres = sorted(tuple(np.round(face.point, 2)) for face in holes)
    np.testing.assert_allclose(centres, [(*c, 5.0) for c in BOLTS], atol=1e-9)
    # The wall of a cylinder, less what the chords of its facets cut off, plus what slivers fold.
    assert [f.area for f in holes] == pytest.approx([np.pi * 9.0 * 10.0] * 4, rel=0.015)
    assert kinds(found)["plane"] >= 6


def test_corners_at_the_rims_alone_show_no_order():
    """Facets that run from rim to rim, as most files have them, leave nothing to judge between."""
    turn = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
    ring = np.stack([5 * np.cos(turn), 5 * np.sin(turn), 0 * turn], axis=1)
    up = np.array([0.0, 0.0, 4.0])
    rims = np.concatenate([ring - up, ring + up])
    whole = Cylinder(
        axis=np.array([0.0, 0.0, 1.0]), point=np.zeros(3), radius=5.2, deviation=0.2, concave=True
    )
    assert not without_order(rims, whole)
