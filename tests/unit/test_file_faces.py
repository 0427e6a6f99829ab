"""Faces, names and colours of a part's file, through repair to the regions of a case."""

import numpy as np
import pytest
from pydantic import ValidationError

from gradedesign.errors import CaseError, PartError
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.exact_faces import exact_faces
from gradedesign.geometry.part.exact_surface import ExactSurface
from gradedesign.geometry.part.file_faces import NO_FACE, FileFaces, carried
from gradedesign.geometry.part.raw_triangles import in_mm, raw_triangles
from gradedesign.geometry.part.regions import select_regions
from gradedesign.geometry.part.regions_schema import RegionSpec
from gradedesign.geometry.part.repair import build_surface
from gradedesign.geometry.part.smooth_faces import segment_faces
from gradedesign.geometry.triangles.surface_mesh import corner_points

BOX = corner_points(box_surface((10.0, 20.0, 30.0)))
#: Number 10 x axis + side, as 0 for x = 0, 1 for x = 10, 10 for y = 0.
SIDES = np.array(
    [10 * axis + int(t[0, axis] > 0) for t in BOX for axis in range(3) if np.ptp(t[:, axis]) == 0.0]
)


def faces_of_box(label=SIDES, **changes):
    names = {0: "root", 1: "tip", 20: "skirt", 21: "skirt"}
    return FileFaces(label=label, names=names, colors={1: "#ff0000", 10: "#ff0000"}, **changes)


def regions(corners=BOX, faces=None, repair="safe", **specs):
    faces = faces_of_box() if faces is None else faces
    surface, report = build_surface(corners, repair=repair, bodies="all")
    kept = carried(faces, corners, surface, tolerance=10 * report.weld_tolerance)
    models = {name: RegionSpec.model_validate(spec) for name, spec in specs.items()}
    return select_regions(surface, segment_faces(surface), models, kept)


def test_a_region_is_found_by_number_name_and_colour():
    found = regions(
        numbers={"face": [0, 10]},
        name={"name": "skirt"},
        color={"color": "#FF0000"},
        both={"color": "#ff0000", "name": "tip"},
        kind={"color": "#ff0000", "plane": "y = min"},
    )
    areas = {name: region.area for name, region in found.items()}
    # Sides of the box of 10 x 20 x 30 mm: 600 across x, 300 across y, 200 across z.
    expected = {"numbers": 900, "name": 400, "color": 900, "both": 600, "kind": 300}
    assert areas == pytest.approx(expected)


def test_a_mark_takes_some_of_a_smooth_face_and_combines():
    label = SIDES.copy()
    half = np.flatnonzero(label == 1)[0]
    label[half] = 99
    found = regions(
        faces=FileFaces(label=label),
        half={"face": [99]},
        rest={"plane": "x = max", "not": ["half"]},
        both={"any": ["half", "rest"]},
        none_of_them={"plane": "x = min", "not": ["half"]},
        again={"all": ["both", "half"]},
    )
    areas = [found[name].area for name in ("half", "rest", "both", "none_of_them", "again")]
    assert areas == pytest.approx([300, 300, 600, 600, 300])


def test_marks_survive_welding_flips_shuffling_and_uniting():
    rng = np.random.default_rng(20261122)
    order = rng.permutation(len(BOX))
    turned = BOX[order] + rng.uniform(-1e-7, 1e-7, (len(BOX), 3, 3))
    turned[::3] = turned[::3, ::-1]
    corners = np.concatenate([turned, turned[:2]])
    label = np.concatenate([SIDES[order], SIDES[order][:2]])
    found = regions(corners, faces_of_box(label), name={"name": "skirt"})
    assert found["name"].area == pytest.approx(400.0, rel=1e-5)
    # A second box pierces x = max: what is left of that face keeps its number, the other its own.
    other = BOX * [2, 0.25, 0.25] + [5, 5, 10]
    both = np.concatenate([BOX, other])
    marks = FileFaces(label=np.concatenate([SIDES, SIDES + 100]))
    found = regions(both, marks, old={"face": [1]}, new={"face": [101]}, side={"face": [110]})
    assert found["old"].area == pytest.approx(600.0 - 5.0 * 7.5)
    assert found["new"].area == pytest.approx(5.0 * 7.5)
    assert found["side"].area == pytest.approx(15.0 * 7.5)  # 25 mm from x = 5, 5 of them inside


def test_a_filled_hole_has_no_face():
    outer = BOX[0]
    inner = 0.05 * outer + 0.95 * outer.mean(axis=0)
    frame = [[outer[k - 1], outer[k], inner[k]] for k in range(3)]
    frame += [[outer[k - 1], inner[k], inner[k - 1]] for k in range(3)]
    corners = np.concatenate([BOX[1:], np.array(frame)])
    label = np.concatenate([SIDES[1:], np.full(6, SIDES[0])])
    surface, report = build_surface(corners, repair="auto")
    assert report.holes_filled == 1
    kept = carried(FileFaces(label=label), corners, surface, tolerance=10 * report.weld_tolerance)
    assert np.count_nonzero(kept.label == NO_FACE) == len(surface.faces) - len(corners)
    assert kept.numbers == (0, 1, 10, 11, 20, 21)


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ({"face": [7]}, "region.a: the file has no face 7; it has 0, 1, 10, 11, 20, 21"),
        ({"name": "skrit"}, 'did you mean "skirt"? names in the file: root, skirt, tip'),
        ({"color": "#00ff00"}, "colors in the file: #ff0000"),
        ({"name": "skirt", "color": "#ff0000"}, "has name and color at once"),
        ({"name": "tip", "plane": "x = min"}, "no smooth face fits every key"),
    ],
)
def test_what_the_file_has_is_listed(spec, words):
    with pytest.raises(CaseError) as told:
        regions(a=spec)
    assert words in str(told.value)


def test_one_face_needs_no_list():
    assert RegionSpec.model_validate({"face": 3}).face == (3,)
    for wrong in ([], "3", -1, [3, 3]):
        with pytest.raises(ValidationError):
            RegionSpec.model_validate({"face": wrong})


def test_a_part_without_file_faces_says_so():
    surface, _ = build_surface(BOX)
    spec = {"a": RegionSpec.model_validate({"face": [3]})}
    with pytest.raises(CaseError, match="its format tells none apart; select by plane"):
        select_regions(surface, segment_faces(surface), spec)


@pytest.mark.parametrize(
    ("faces", "words"),
    [
        ({"label": [-2]}, "number -2"),
        ({"label": [0], "names": {0: " "}}, "name ' '"),
        ({"label": [0], "colors": {0: "red"}}, "'red'; expected #rrggbb"),
    ],
)
def test_impossible_faces_are_refused(faces, words):
    with pytest.raises(ValueError, match=words):
        FileFaces(**faces)


def test_labels_of_another_file_are_refused():
    raw = raw_triangles(BOX, source="a", faces=FileFaces(label=[0, 1]))
    with pytest.raises(PartError, match="a: 2 triangles have a face, but there are 12"):
        in_mm(raw, "mm", "a")


def rod(sides=24, radius=5.0, length=20.0):
    """A rod along z in two half shells (numbers 1, 2), its ends 3 and 4; a file's faces in inch."""
    angle = np.linspace(0.0, 2.0 * np.pi, sides + 1)
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(sides + 1)], axis=1)
    ring[-1] = ring[0]
    up = np.array([0.0, 0.0, length])
    corners, label = [], []
    for k in range(sides):
        a, b = ring[k], ring[k + 1]
        corners += [[a, b, b + up], [a, b + up, a + up], [0 * up, b, a], [up, a + up, b + up]]
        label += [1 + (2 * k >= sides)] * 2 + [3, 4]
    halves = {
        1: ExactSurface(kind="cylinder", axis=(0, 0, 2), point=(0, 0, 1), diameter=10.0 / 25.4),
        2: ExactSurface(kind="cylinder", axis=(0, 0, -1), point=(0, 0, 7), diameter=10.0 / 25.4),
    }
    flat = dict.fromkeys((3, 4), ExactSurface(kind="plane"))
    return np.array(corners) / 25.4, FileFaces(label=label, surfaces=halves | flat)


def test_exact_surfaces_are_taken_over_and_halves_are_one_face():
    corners, faces = rod(sides=8)  # so coarse that a fit finds no cylinder
    raw = in_mm(raw_triangles(corners, source="rod", faces=faces, unit="inch"), "inch", "rod")
    surface, report = build_surface(raw.corners)
    assert not any(face.kind == "cylinder" for face in segment_faces(surface).faces)
    kept = carried(raw.faces, raw.corners, surface, tolerance=10 * report.weld_tolerance)
    found = exact_faces(surface, kept)
    kinds = sorted(face.kind for face in found.faces)
    assert kinds == ["cylinder", "plane", "plane"]
    (wall,) = (face for face in found.faces if face.kind == "cylinder")
    assert wall.diameter == pytest.approx(10.0)
    assert wall.concave is False
    np.testing.assert_allclose(wall.axis, (0, 0, 1))
    np.testing.assert_allclose(wall.point, (0, 0, 10), atol=1e-9)
    specs = {
        "wall": {"cylinder": {"diameter": ["9.9 mm", "10.1 mm"]}, "count": 1},
        "half": {"cylinder": {"diameter": "10 mm"}, "face": [2]},
    }
    models = {name: RegionSpec.model_validate(spec) for name, spec in specs.items()}
    chosen = select_regions(surface, found, models, kept)
    assert chosen["half"].area == pytest.approx(0.5 * chosen["wall"].area)
    missed = {"a": RegionSpec.model_validate({"cylinder": {"diameter": ["8 mm", "9.9 mm"]}})}
    with pytest.raises(CaseError, match=r"cylinder of diameter 8 to 9.9 mm"):
        select_regions(surface, found, missed, kept)


@pytest.mark.parametrize(
    ("surface", "words"),
    [
        ({"kind": "cone"}, "kind 'cone'"),
        ({"kind": "cylinder"}, "expected them of cylinders"),
        ({"kind": "cylinder", "axis": (0, 0, 0), "point": (0, 0, 0), "diameter": 1.0}, "above 0"),
    ],
)
def test_impossible_surfaces_are_refused(surface, words):
    with pytest.raises(ValueError, match=words):
        ExactSurface(**surface)


@pytest.mark.parametrize(
    ("diameter", "words"),
    [
        (["9 mm"], "the smallest and the largest"),
        (["9 mm", "8 mm"], "expected the smaller diameter first"),
        (["9 mm", "0 mm"], "above 0 mm"),
    ],
)
def test_ranges_of_diameters_are_two_in_order(diameter, words):
    with pytest.raises(ValueError, match=words):
        RegionSpec.model_validate({"cylinder": {"diameter": diameter}})
