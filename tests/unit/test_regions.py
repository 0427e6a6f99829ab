"""Selecting faces of a plate with four bolt holes, whose faces are known by construction."""

from __future__ import annotations

from types import SimpleNamespace

import manifold3d
import numpy as np
import pytest

from gradedesign.errors import CaseError
from gradedesign.geometry.part._clip import clip_to_box
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.regions import select_regions
from gradedesign.geometry.part.regions_schema import RegionSpec
from gradedesign.geometry.part.repair import build_surface
from gradedesign.geometry.part.smooth_faces import segment_faces


def mm(*values):
    return [f"{v} mm" for v in values]


def box(lower, upper):
    return {"lower": mm(*lower), "upper": mm(*upper)}


@pytest.fixture(scope="module")
def plate():
    """60 x 40 x 10 mm, holes of 8 mm along z at (10|50, 10|30), one of 6 mm along y."""
    solid = manifold3d.Manifold.cube([60, 40, 10])
    for x in (10, 50):
        for y in (10, 30):
            solid -= manifold3d.Manifold.cylinder(30, 4, 4, 32).translate([x, y, -10])
    solid -= manifold3d.Manifold.cylinder(60, 3, 3, 32).rotate([-90, 0, 0]).translate([30, -10, 5])
    mesh = solid.to_mesh64()
    points = np.asarray(mesh.vert_properties)[:, :3]
    surface, _ = build_surface(points[np.asarray(mesh.tri_verts).astype(int)])
    return SimpleNamespace(surface=surface, faces=segment_faces(surface))


def select(part, **specs):
    models = {name: RegionSpec.model_validate(value) for name, value in specs.items()}
    return select_regions(part.surface, part.faces, models)


def refused(part, **specs) -> str:
    with pytest.raises(CaseError) as caught:
        select(part, **specs)
    assert caught.value.exit_code == 2
    assert "region." in str(caught.value)
    return str(caught.value)


SMALL_HOLE = np.pi * 9  # mm^2, less the facets
LARGE_HOLE = np.pi * 16

SELECTIONS = {
    "plane min": ({"plane": "x = min"}, 1, 400.0, (0, 20, 5)),
    "plane max": ({"plane": "x = max"}, 1, 400.0, (60, 20, 5)),
    "plane at": ({"plane": "y = 40 mm"}, 1, 600.0 - SMALL_HOLE, (30, 40, 5)),
    "plane by normal": (
        {"plane": {"point": mm(7, 8, 10), "normal": [0, 0, -2]}},
        1,
        2400.0 - 4 * LARGE_HOLE,
        (30, 20, 10),
    ),
    "holes": (
        {"cylinder": {"diameter": "8 mm", "axis": "z"}, "count": 4},
        4,
        4 * 80 * np.pi,
        (30, 20, 5),
    ),
    "diameter within 2 %": ({"cylinder": {"diameter": "8.1 mm"}}, 4, 4 * 80 * np.pi, (30, 20, 5)),
    "every cylinder": ({"cylinder": {}}, 5, 4 * 80 * np.pi + 240 * np.pi, None),
    "axis": ({"cylinder": {"axis": "y"}}, 1, 240 * np.pi, (30, 20, 5)),
    "point on axis": (
        {"cylinder": {"diameter": "8 mm", "point": mm(50, 10, 99)}},
        1,
        80 * np.pi,
        (50, 10, 5),
    ),
    "facing": ({"facing": "+z"}, 1, 2400.0 - 4 * LARGE_HOLE, (30, 20, 10)),
    "facing down": ({"facing": "-z"}, 1, 2400.0 - 4 * LARGE_HOLE, (30, 20, 0)),
    "inside": (
        {"cylinder": {}, "inside": box((0, 0, 0), (20, 40, 10))},
        2,
        160 * np.pi,
        (10, 20, 5),
    ),
    "box holds whole faces": (
        {"box": box((-1, -1, -1), (20, 20, 11))},
        1,
        80 * np.pi,
        (10, 10, 5),
    ),
    "nearest": ({"cylinder": {}, "nearest": mm(48, 28, 12)}, 1, 80 * np.pi, (50, 30, 5)),
    "nearest of all": ({"nearest": mm(-5, 20, 5)}, 1, 400.0, (0, 20, 5)),
    "area": ({"plane": "x = min", "area": "390 mm^2"}, 1, 400.0, (0, 20, 5)),
    "clip": (
        {"plane": "x = max", "box": box((50, 10, 0), (70, 20, 4)), "clip": True},
        1,
        40.0,
        (60, 15, 2),
    ),
    "clip around a corner": (
        {"box": box((55, -1, -1), (70, 41, 5)), "clip": True},
        4,
        40 * 5 + 40 * 5 + 2 * 5 * 5,
        None,
    ),
}


@pytest.mark.parametrize(("spec", "count", "area", "centroid"), SELECTIONS.values(), ids=SELECTIONS)
def test_selection(plate, spec, count, area, centroid):
    region = select(plate, pick=spec)["pick"]
    assert region.name == "pick"
    assert len(region.faces) == count
    assert region.area == pytest.approx(area, rel=0.01)  # 32 facets lose 0.6 % of a circle
    if centroid is not None:
        np.testing.assert_allclose(region.centroid, centroid, atol=0.02)
    np.testing.assert_array_equal(
        np.unique(plate.faces.label[region.triangles]), np.sort(region.faces)
    )
    assert len(region.corners) == len(region.triangles)


def test_unclipped_corners_are_those_of_the_triangles(plate):
    region = select(plate, pick={"cylinder": {}})["pick"]
    faces = plate.surface.faces[region.triangles]
    np.testing.assert_array_equal(region.corners, plate.surface.vertices[faces])


def test_combinations(plate):
    found = select(
        plate,
        rest={"not": ["ends", "holes"]},
        left={"plane": "x = min"},
        right={"plane": "x = max"},
        ends={"any": ["left", "right"]},
        holes={"cylinder": {"axis": "z"}},
        left_holes={"all": "holes", "inside": box((0, 0, 0), (30, 40, 10))},
        other={"all": "holes", "not": "left_holes"},
    )
    assert next(iter(found)) == "rest"
    assert set(found["ends"].faces) == {*found["left"].faces, *found["right"].faces}
    assert len(found["left_holes"].faces) == len(found["other"].faces) == 2
    assert not set(found["left_holes"].faces) & set(found["other"].faces)
    together = [set(found[n].faces) for n in ("rest", "ends", "holes")]
    assert set.union(*together) == set(range(len(plate.faces.faces)))
    assert sum(map(len, together)) == len(plate.faces.faces)


def test_clipped_region_can_be_narrowed_but_not_excluded(plate):
    pad = {"box": box((50, 0, 0), (70, 40, 4)), "clip": True}
    narrowed = select(plate, pad=pad, end={"all": "pad", "plane": "x = max"})["end"]
    assert narrowed.area == pytest.approx(160.0)
    assert "cut by a box" in refused(plate, pad=pad, rest={"not": "pad"})
    assert "cut by a box" in refused(
        plate, pad=pad, e={"plane": "x = max"}, u={"any": ["pad", "e"]}
    )


def test_row_51_nothing_matches(plate):
    message = refused(plate, tip={"plane": "z = 999 mm"})
    for words in (
        "region.tip",
        'plane "z = 999 mm": 0 faces',
        "x 0 to 60, y 0 to 40, z 0 to 10 mm",
        "11 faces",
    ):
        assert words in message
    assert message.count("\n") == 5  # five candidates
    first = message.splitlines()[1]
    assert "centroid (30, 20, 10) mm, normal (0, 0, 1)" in first


def test_row_51_nearest_diameters_are_named(plate):
    message = refused(plate, bolts={"cylinder": {"diameter": "9 mm", "axis": "z"}})
    assert "hole, diameter 8 mm, axis (0, 0, 1)" in message.splitlines()[1]


def test_row_51_contradicting_keys_are_told_apart(plate):
    message = refused(plate, tip={"plane": "z = max", "facing": "+x"})
    assert 'plane "z = max": 1 faces; facing +x within 15 deg: 1 faces' in message


def test_row_52_whole_surface(plate):
    everything = {"box": box((-1, -1, -1), (99, 99, 99))}
    assert "selects the whole surface, all 11 faces" in refused(plate, all_of_it=everything)
    assert "whole surface" in refused(plate, all_of_it={**everything, "clip": True})


def test_assertions(plate):
    message = refused(plate, bolts={"cylinder": {"diameter": "8 mm"}, "count": 6})
    assert "region.bolts.count: found 6, but the other keys fit 4 faces" in message
    assert message.count("diameter 8 mm") == 4
    message = refused(plate, end={"plane": "x = min", "area": "430 mm^2"})
    assert "region.end.area: found 430 mm^2, within 5 %, but" in message
    assert "400 mm^2" in message


def test_box_that_cuts_nothing_out(plate):
    pad = {"plane": "x = max", "box": box((50, 10, 20), (70, 20, 24)), "clip": True}
    assert "0 faces" in refused(plate, pad=pad)
    in_hole = {"plane": "z = max", "box": box((9, 9, 9), (11, 11, 11)), "clip": True}
    assert "cuts nothing" in refused(plate, pad=in_hole)


def test_circles_and_unknown_names(plate):
    assert "circle: a -> b" in refused(plate, a={"any": "b"}, b={"all": "a"})
    assert "'c'" in refused(plate, a={"any": "c"})


def test_box_flush_with_the_part_but_for_rounding():
    surface = box_surface((10.000001, 20.0, 30.0))
    part = SimpleNamespace(surface=surface, faces=segment_faces(surface))
    pad = {"box": box((5, 0, 0), (10, 20, 15)), "clip": True, "facing": "+x"}
    assert select(part, pad=pad)["pad"].area == pytest.approx(300.0)


def test_clipping_keeps_direction_and_area():
    rng = np.random.default_rng(12)
    corners = rng.uniform(-1, 1, (200, 3, 3))
    lower, upper = np.array([-0.5, -0.4, -0.3]), np.array([0.3, 0.6, 0.5])
    pieces, source = clip_to_box(corners, lower, upper)
    assert pieces.reshape(-1, 3).min(axis=0) == pytest.approx(lower)
    assert pieces.reshape(-1, 3).max(axis=0) == pytest.approx(upper)

    def vectors(c):
        return np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]) / 2

    whole, part = vectors(corners), vectors(pieces)
    assert ((whole[source] * part).sum(axis=1) >= 0).all()
    # Area by sampling each triangle: the share of 4000 points that lie in the box.
    u = np.sort(rng.uniform(size=(4000, 2)), axis=1)
    weights = np.stack([u[:, 0], u[:, 1] - u[:, 0], 1 - u[:, 1]], axis=1)
    points = np.einsum("sk,mkd->msd", weights, corners)
    share = ((points > lower) & (points < upper)).all(axis=2).mean(axis=1)
    clipped = np.bincount(source, np.linalg.norm(part, axis=1), minlength=200)
    np.testing.assert_allclose(clipped / np.linalg.norm(whole, axis=1), share, atol=0.04)


def test_a_region_knows_the_bore_that_it_is_the_wall_of(plate):
    hole = {"cylinder": {"diameter": "8 mm"}}
    found = select(
        plate,
        one=hole | {"nearest": mm(50, 30, 5)},
        four=hole,
        across={"cylinder": {"diameter": "6 mm"}},
        end={"plane": "x = min"},
        mixed={"any": ["one", "end"]},
    )
    bore = found["one"].bore
    np.testing.assert_allclose(np.abs(bore.axis), [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(bore.point[:2], [50, 30], atol=1e-6)
    np.testing.assert_allclose(np.abs(found["across"].bore.axis), [0, 1, 0], atol=1e-9)
    assert found["four"].bore is found["end"].bore is found["mixed"].bore is None


def test_lugs_share_their_bore_and_a_boss_is_none():
    solid = manifold3d.Manifold.cube([20, 20, 20])
    solid -= manifold3d.Manifold.cube([20, 8, 14]).translate([0, 6, 6])
    solid -= manifold3d.Manifold.cylinder(60, 3, 3, 32).rotate([-90, 0, 0]).translate([10, -10, 14])
    solid += manifold3d.Manifold.cylinder(9, 2, 2, 32).translate([10, 10, -8])
    mesh = solid.to_mesh64()
    points = np.asarray(mesh.vert_properties)[:, :3]
    surface, _ = build_surface(points[np.asarray(mesh.tri_verts).astype(int)])
    fork = SimpleNamespace(surface=surface, faces=segment_faces(surface))
    found = select(
        fork,
        lugs={"cylinder": {"diameter": "6 mm"}, "count": 2},
        boss={"cylinder": {"diameter": "4 mm"}, "count": 1},
    )
    np.testing.assert_allclose(found["lugs"].bore.point[[0, 2]], [10, 14], atol=1e-6)
    assert found["boss"].bore is None
