"""Pictures exist, show what they should, and never end a run."""

from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from composed_domains import design_domain
from matplotlib.image import imread

from gradedesign.arrays import read_only
from gradedesign.design.case.read_case import load_case
from gradedesign.design.resolve.fitting_part import part_of
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.signed_distance import region_distance
from gradedesign.geometry.tets.tet_mesh import (
    TetMesh,
    boundary_facets,
    boundary_surface,
    signed_volumes,
)
from gradedesign.geometry.triangles.surface_mesh import (
    SurfaceMesh,
    area_vectors,
    corner_points,
    enclosed_volume,
)
from gradedesign.mechanics.explicit.support_zones import SupportZone
from gradedesign.program.pictures import draw, pictures
from gradedesign.program.pictures import without_octant as octants
from gradedesign.program.pictures._depth_kernels import front_triangles
from gradedesign.program.pictures.action_mark import SHORTEST, ActionMark
from gradedesign.program.pictures.label_places import label_box
from gradedesign.program.pictures.marks import action_marks, loads_note, region_marks, warming_note
from gradedesign.program.pictures.pictures import (
    RegionMark,
    picture_deformed,
    picture_density,
    picture_lattice,
    picture_loads,
    picture_stress,
    round_factor,
)
from gradedesign.program.pictures.scene import (
    SIZE,
    VIEW,
    ColourBar,
    Layer,
    Lines,
    Scene,
    frame_of,
    hatch,
    legend_box,
    sharp_edges,
    thinned,
)

CASES = Path(__file__).parents[2] / "cases"
BALL = extract_surface(lambda p: np.sqrt((p**2).sum(axis=0)) - 1.0, [-2] * 3, [2] * 3, 0.1)


def kuhn_box(size):
    """Six tetrahedra in a box."""
    points = size * np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]).T
    pairs = ((1, 3), (3, 2), (2, 6), (6, 4), (4, 5), (5, 1))
    tets = np.array([[0, a, b, 7] for a, b in pairs]).T
    flipped = signed_volumes(TetMesh(points=points, tets=tets)) < 0
    tets[2:, flipped] = tets[[3, 2]][:, flipped]
    return TetMesh(points=points, tets=tets)


BOX = kuhn_box(np.array([[4.0], [1], [1]]))


@pytest.fixture
def drawn(tmp_path):
    """A path, and the number of warnings expected from drawing there."""
    return tmp_path / "picture.png", 0


def image(path):
    picture = imread(BytesIO(path.read_bytes()))[:, :, :3]
    assert picture.shape == (900, 1200, 3)
    return picture


def share(picture, match):
    return float(np.mean(match(*np.moveaxis(picture, 2, 0))))


def red(r, g, b):
    return (r > 0.5) & (g < 0.35) & (b < 0.35)


def blue(r, g, b):
    return (b > r + 0.12) & (b > g + 0.05)


def magenta(r, g, b):
    return (r > 0.5) & (g < 0.3) & (b > 0.4)


def ends():
    surface, _ = boundary_surface(BOX)
    corners = corner_points(surface)
    return surface, *(corners[(corners[:, :, 0] == x).all(axis=1)] for x in (0, 4))


def force(corners, vector, case="pull", kind="force", text="5 kN"):
    return ActionMark(load_case=case, kind=kind, text=text, vector=vector, corners=corners)


def test_loads_show_supports_and_arrows(drawn):
    path, warnings = drawn
    surface, root, tip = ends()
    support = RegionMark(name="root", role="support", corners=root)
    assert len(picture_loads(path, surface, [support])) == warnings
    bare = image(path)
    assert share(bare, red) < 1e-4
    assert share(bare, blue) > 5e-3
    picture_loads(path, surface, [support], [force(tip, [0, 0, -1])])
    assert share(image(path), red) > 1e-3


@pytest.fixture
def scene(monkeypatch, tmp_path):
    """What a picture of the loading would draw."""
    found = []
    monkeypatch.setattr(pictures, "_draw", lambda _, scene: found.append(scene) or ())

    def call(regions, actions, **options):
        picture_loads(tmp_path / "loads.png", boundary_surface(BOX)[0], regions, actions, **options)
        return found[-1]

    return call


def test_arrows_are_as_long_as_forces_are_large(scene):
    """As in cases/bracket: 1300 N and 500 N on the same region, and a far smaller one."""
    _, root, tip = ends()
    drawn = scene(
        [RegionMark(name="lug", role="load", corners=tip)],
        [
            force(tip, [500.0, 0, 1200], "pull", text="1300 N"),
            force(tip, [0, 500.0, 0], "side", text="500 N"),
            force(root, [0, 0, 1.0], "touch", text="1 N"),
        ],
    )
    pull, side, touch = (np.linalg.norm(a.tip - a.tail) for a in drawn.arrows)
    assert side / pull == pytest.approx(500 / 1300)
    assert touch / pull == pytest.approx(SHORTEST)
    assert f"{SHORTEST:.0%} of the longest at least" in drawn.caption
    assert len({a.colour for a in drawn.arrows}) == 3


def test_arrows_of_one_kind_only_are_compared(scene):
    _, _, tip = ends()
    drawn = scene([], [force(tip, [0, 0, 9.0]), force(tip, [0, 0, 1e5], kind="acceleration")])
    first, second = (np.linalg.norm(a.tip - a.tail) for a in drawn.arrows)
    assert first == pytest.approx(second)


def test_equal_forces_of_two_load_cases_do_not_cover_each_other(scene):
    _, _, tip = ends()
    drawn = scene([], [force(tip, [0, 0, -1.0], "a"), force(tip, [0, 0, -2.0], "b")])
    one, other = drawn.arrows
    assert np.linalg.norm(np.cross(one.tail - other.tail, [0, 0, 1])) > 0.1


def test_the_legend_names_what_is_drawn_and_nothing_else(scene):
    _, root, tip = ends()
    support = RegionMark(name="root", role="support", corners=root)
    bare = scene([support], [])
    assert [e.text for e in bare.legend] == ["supports"]
    kept = RegionMark(name="tip", role="passive", corners=tip)
    full = scene([support, kept], [force(tip, [1.0, 0, 0], "pull")], note="warmed")
    assert [e.text for e in full.legend] == ["supports", "passive solid", "pull"]
    assert full.caption == "warmed"  # one arrow has no other to be compared with
    empty = RegionMark(name="none", role="passive", corners=tip[:0])
    assert [e.text for e in scene([support, empty], []).legend] == ["supports"]


def test_a_moment_turns_right_handed_about_its_axis(scene):
    _, _, tip = ends()
    drawn = scene([], [force(tip, [7.0, 0, 0], kind="moment")])
    (arc,) = [lines for lines in drawn.lines if lines.radius > 0]
    centre = np.array([4, 0.5, 0.5])
    first, then = (arc.segments[n, 0] - centre for n in (0, 3))
    assert np.cross(first, then)[0] > 0
    np.testing.assert_allclose(arc.segments[:, :, 0], 4.0, atol=1e-9)


def test_a_remote_force_stands_at_its_point_on_a_bar_from_the_region(scene):
    _, _, tip = ends()
    at = np.array([6.0, 0.5, 3.0])
    drawn = scene([], [replace(force(tip, [0, 0, -1.0]), at=at)])
    (arrow,) = drawn.arrows
    np.testing.assert_allclose(arrow.tail, at)
    assert arrow.tip[2] < at[2]
    (bar,) = [lines for lines in drawn.lines if lines.radius > 0]
    np.testing.assert_allclose(bar.segments, [[[4.0, 0.5, 0.5], at]], atol=1e-9)


def test_pressure_points_at_the_region(scene):
    _, _, tip = ends()
    drawn = scene([], [force(tip, [2.0, 0, 0], kind="pressure")])
    for arrow in drawn.arrows:
        assert arrow.tip[0] == pytest.approx(4.0)
        assert arrow.tail[0] > 4.0


def test_labels_do_not_overlap_and_stay_in_the_picture(scene):
    _, root, tip = ends()
    regions = [
        RegionMark(name=f"a rather long name {n}", role="load", corners=tip) for n in range(6)
    ]
    actions = [force(tip, [0, 0, 1.0], f"case {n}", text=f"{n}000 N") for n in range(4)]
    drawn = scene([*regions, RegionMark(name="root", role="support", corners=root)], actions)
    frame = frame_of(drawn)
    boxes = [label_box(label, frame) for label in drawn.labels]
    assert len(boxes) == 11
    for n, one in enumerate(boxes):
        assert one[0, 0] >= 0
        assert one[0, 1] <= SIZE[0]
        for other in boxes[:n]:
            apart = (one[:, 0] >= other[:, 1] - 1e-6) | (other[:, 0] >= one[:, 1] - 1e-6)
            assert apart.any()


def test_labels_leave_the_legend_free(scene):
    """The label of a remote force whose arrow ends below the legend of six load cases."""
    _, _, tip = ends()
    names = [f"braking on one side, {n}" for n in range(6)]
    actions = [force(tip, [0, 0, -1.0], name) for name in names]
    remote = replace(force(tip, [0, 0, 1.0], names[0], text="5 kN remote"), at=[6.0, 2.0, 6.0])
    drawn = scene([], [*actions, remote])
    (left, right), (bottom, top) = legend_box(drawn.legend)
    assert len(drawn.legend) == 6
    for box in (label_box(label, frame_of(drawn)) for label in drawn.labels):
        assert box[0, 0] >= right or box[0, 1] <= left or box[1, 0] >= top or box[1, 1] <= bottom


def test_marks_of_a_case_are_what_it_asks_for(tmp_path):
    """Force, moment, pressure, acceleration and displacement each have a mark."""
    text = (CASES / "mini" / "case.toml").read_text(encoding="utf-8")
    more = """[[load_case]]
name = "more"
fix = [{region = "root", displacement = ["0.1 mm", "0 mm", "0 mm"]}]
load = [{region = "tip", moment = ["0 N*m", "0 N*m", "20 N*m"], pressure = "2 MPa"}]
acceleration = ["0 m/s^2", "0 m/s^2", "-30 m/s^2"]
temperature_change = "20 K"

[limits]"""
    (tmp_path / "case.toml").write_text(text.replace("[limits]", more), encoding="utf-8")
    case = load_case(tmp_path)
    part = part_of(case, {})
    found = [(m.load_case, m.kind, m.text) for m in action_marks(case.load_case, part)]
    assert found == [
        ("shear", "force", "400 N"),
        ("more", "pressure", "2 MPa"),
        ("more", "moment", "20 N m"),
        ("more", "displacement", "0.1 mm"),
        ("more", "acceleration", "30 m/s^2"),
    ]
    assert warming_note(case.load_case) == "change of temperature: more +20 K"
    zone = SupportZone(
        region="root",
        corners=part.regions["root"].corners,
        distance=region_distance(part.regions["root"].corners),
        radius=3.0,
        disturbed=3.0,
    )
    assert loads_note(case.load_case, [zone], 0.125).endswith(
        "more +20 K; stress not judged within 3 mm of root, 12.5% of the part"
    )
    *marks, drawn = region_marks(case.load_case, part, design_domain(case, part), [zone])
    assert (drawn.name, drawn.role) == ("stress not judged, 3 mm", "unjudged")
    # A slab of 3 of the 24 mm, drawn a little below the faces.
    high = drawn.corners.reshape(-1, 3).max(axis=0)
    np.testing.assert_allclose(high, [3.0, 12.0, 12.0], atol=0.15)
    assert [(m.name, m.role) for m in marks] == [
        ("root, passive solid", "support"),
        ("tip, passive solid", "load"),
    ]


def test_captions_claim_only_what_is_seen(monkeypatch, tmp_path):
    captions = []
    monkeypatch.setattr(pictures, "_draw", lambda _, s: captions.append(s.caption) or ())
    picture_density(tmp_path / "a.png", BOX, np.linspace(0.1, 0.6, 6))
    assert "cut away" not in captions[-1]  # no tetrahedron of six lies in the nearest eighth
    values = 50.0 * (1 + BALL.vertices[:, 2])
    picture_stress(tmp_path / "a.png", BALL, values, limit=120.0)
    assert "magenta" not in captions[-1]
    assert "nowhere above it" in captions[-1]


def test_density_uses_the_colours_of_its_bar(drawn):
    path, warnings = drawn
    rho = np.linspace(0.1, 0.6, 6)
    assert len(picture_density(path, BOX, rho)) == warnings
    picture = image(path)
    assert share(picture, lambda r, g, b: np.ptp([r, g, b], axis=0) > 0.2) > 0.02


def test_lattice_fills_the_picture(drawn):
    path, warnings = drawn
    assert len(picture_lattice(path, BALL)) == warnings
    picture = image(path)
    filled = share(picture, blue)
    assert 0.1 < filled < 0.6
    assert (picture[:40, -40:] == 1).all()  # white background


def test_a_lattice_below_a_skin_is_opened(drawn, monkeypatch):
    """A hollow ball shows its inside where an eighth of it is cut away."""
    path, warnings = drawn
    hollow = extract_surface(
        lambda p: np.abs(np.sqrt((p**2).sum(axis=0)) - 0.9) - 0.1, [-2] * 3, [2] * 3, 0.1
    )
    scenes = []
    kept = pictures._draw
    monkeypatch.setattr(pictures, "_draw", lambda p, s: scenes.append(s) or kept(p, s))
    picture_lattice(path, hollow)
    closed = image(path)
    assert len(picture_lattice(path, hollow, opened=True)) == warnings
    assert np.abs(image(path) - closed).max() > 0.1
    whole, cut = (
        SurfaceMesh(vertices=s.layers[0].vertices, faces=s.layers[0].faces) for s in scenes
    )
    # The eighth of x > 0, y < 0, z > 0.
    assert enclosed_volume(cut) == pytest.approx(7 / 8 * enclosed_volume(whole), rel=1e-3)
    assert not ((cut.vertices * [1, -1, 1]) > 1e-9).all(axis=1).any()
    assert scenes[1].caption.endswith("the corner towards the viewer cut away")


def test_a_very_large_surface_is_cut_without_closing_its_sections(monkeypatch):
    """A box of twelve triangles: the three faces at the corner lose a quarter each."""
    box = box_surface((2.0, 3.0, 4.0))
    monkeypatch.setattr(octants, "CAPPED", 10)
    vertices, faces, capped = octants.without_octant(box, np.array([1.0, -1, 1]), subject="box")
    assert not capped
    cut = SurfaceMesh(vertices=vertices, faces=faces)
    area = np.linalg.norm(area_vectors(cut), axis=1).sum()
    assert area == pytest.approx(52.0 - 26.0 / 4)
    inside = (np.array([1, -1, 1]) * (vertices[faces].mean(axis=1) - [1.0, 1.5, 2.0])) > 0
    assert not inside.all(axis=1).any()


def test_a_surface_that_cannot_be_cut_is_drawn_whole(tmp_path):
    open_ball = SurfaceMesh(vertices=BALL.vertices, faces=BALL.faces[1:])
    warnings = picture_lattice(tmp_path / "a.png", open_ball, opened=True)
    assert "a.png: drawn without a cut: " in warnings[0]
    assert (tmp_path / "a.png").is_file()


def test_stress_above_the_limit_is_magenta(drawn):
    path, warnings = drawn
    values = 50.0 * (1 + BALL.vertices[:, 2])
    assert len(picture_stress(path, BALL, values, limit=80.0)) == warnings
    assert share(image(path), magenta) > 5e-3
    picture_stress(path, BALL, values, limit=120.0)
    assert share(image(path), magenta) < 1e-3


def test_what_is_not_judged_is_shaded(drawn):
    path, warnings = drawn
    values = np.full(len(BALL.vertices), 50.0)
    picture_stress(path, BALL, values, limit=80.0)
    plain = image(path)
    near = BALL.vertices[:, 0] > 0.3
    assert len(picture_stress(path, BALL, values, limit=80.0, unjudged=near)) == warnings
    shaded = np.abs(image(path) - plain).max(axis=2) > 0.1
    assert 0.02 < shaded.mean() < 0.3
    picture_stress(path, BALL, values, limit=80.0, unjudged=near & False)
    assert np.abs(image(path) - plain).max() == 0.0


def test_deformed_shape_differs_from_rest(drawn):
    path, warnings = drawn
    shift = np.zeros((3, len(BALL.vertices)))
    picture_deformed(path, BALL, shift)
    rest = image(path)
    shift[2] = 0.01 * BALL.vertices[:, 0]
    assert len(picture_deformed(path, BALL, shift)) == warnings
    assert np.abs(image(path) - rest).max() > 0.3


@pytest.mark.parametrize(
    ("faces", "value", "match"),
    [(BALL.faces[:0], 1.0, "there are no triangles"), (BALL.faces, np.nan, "not finite")],
)
def test_what_cannot_be_drawn_is_a_warning(tmp_path, caplog, faces, value, match):
    surface = SurfaceMesh(vertices=BALL.vertices, faces=faces)
    warnings = picture_stress(tmp_path / "a.png", surface, np.full(len(BALL.vertices), value))
    assert len(warnings) == 1
    assert match in warnings[0]
    assert warnings[0] in caplog.text
    assert not list(tmp_path.iterdir())


def test_failure_while_drawing_is_a_warning(tmp_path, monkeypatch):
    def fail(scene):
        raise RuntimeError("the painter gave up")

    monkeypatch.setattr(pictures, "draw", fail)
    assert picture_lattice(tmp_path / "a.png", BALL) == ("a.png: not drawn: the painter gave up",)


def test_boundary_surface_knows_its_points():
    surface, used = boundary_surface(BOX)
    np.testing.assert_array_equal(surface.vertices, BOX.points[:, used].T)
    assert len(surface.faces) == len(boundary_facets(BOX)[0]) == 12


@pytest.mark.parametrize(
    ("wanted", "largest", "factor"),
    [(100, 2.1, 20), (100, 1.0, 100), (100, 0.051, 1000), (1, 30, 0.02), (5, 0, 1)],
)
def test_factor_is_round(wanted, largest, factor):
    assert round_factor(wanted, largest) == pytest.approx(factor)


def test_thinning_keeps_the_shape_and_the_peak():
    values = np.zeros(len(BALL.vertices))
    values[17] = 9.0
    layer = Layer(vertices=BALL.vertices, faces=BALL.faces, values=values)
    thin = thinned(layer, 800)
    assert 200 < len(thin.faces) <= 800
    assert thin.values.max() == 9.0
    radius = np.linalg.norm(thin.vertices, axis=1)
    assert radius.min() > 0.9
    assert radius.max() < 1.01
    assert thinned(layer, 10**6) is layer


def test_thinning_keeps_the_values_of_faces():
    layer = Layer(
        vertices=BALL.vertices,
        faces=BALL.faces,
        values=BALL.vertices[BALL.faces].mean(axis=1)[:, 2],
        per_face=True,
    )
    thin = thinned(layer, 800)
    middle = thin.vertices[thin.faces].mean(axis=1)[:, 2]
    assert np.abs(middle - thin.values).max() < 0.35


def test_hatch_lies_on_parallel_planes_of_the_triangles():
    corners = np.random.default_rng(3).normal(size=(20, 3, 3))
    strokes = hatch(corners, 0.25)
    normal = np.array([1.0, 0.8, 1.3]) / np.linalg.norm([1.0, 0.8, 1.3])
    height = strokes @ normal / 0.25
    np.testing.assert_allclose(height, np.round(height), atol=1e-9)
    levels = corners @ normal / 0.25
    expected = np.floor(levels.max(axis=1)) - np.ceil(levels.min(axis=1)) + 1
    assert len(strokes) == expected.sum()


def test_sharp_edges_of_a_box_are_its_twelve():
    surface, _ = boundary_surface(BOX)
    edges = sharp_edges(Layer(vertices=surface.vertices, faces=surface.faces))
    length = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    np.testing.assert_array_equal(np.sort(length), [1] * 8 + [4] * 4)
    open_box = Layer(vertices=surface.vertices, faces=surface.faces[1:])
    assert len(sharp_edges(open_box)) == 12 + 1  # the diagonal is a rim now


def test_the_depth_buffer_finds_what_a_plain_one_does():
    """Two balls, one half hidden by the other: foremost triangle of every sample, one by one."""
    size, spacing = (44, 33), 0.16
    vertices = np.concatenate([BALL.vertices, 0.7 * BALL.vertices + [0.5, 1.0, 0.5]])
    faces = np.concatenate([BALL.faces, BALL.faces + len(BALL.vertices)])
    frame = frame_of(Scene(title="balls", layers=(Layer(vertices=vertices, faces=faces),)))
    axes = np.stack([frame.right, frame.up, frame.back])
    places = (vertices - frame.middle) @ axes.T
    at = places / spacing + [0.5 * (size[0] - 1), 0.5 * (size[1] - 1), 0.0]
    depth_of, owner = front_triangles(read_only(at), read_only(faces), size)
    assert set(np.unique(depth_of[owner < 0])) == {-np.inf}
    corners = places[faces]
    plain = set()
    for i in range(size[0]):
        for j in range(size[1]):
            at = spacing * (np.array([i, j]) - 0.5 * (np.array(size) - 1))
            sides = np.roll(corners[..., :2], -1, axis=1) - corners[..., :2]
            away = at - corners[..., :2]
            turns = sides[..., 0] * away[..., 1] - sides[..., 1] * away[..., 0]
            hit = np.flatnonzero((turns > 0).all(axis=1) | (turns < 0).all(axis=1))
            weights = np.roll(turns[hit], -1, axis=1)
            depth = (weights * corners[hit, :, 2]).sum(axis=1) / weights.sum(axis=1)
            plain |= {int(hit[depth.argmax()])} if len(hit) else set()
    assert len(plain) > 100
    assert set(np.unique(owner[owner >= 0]).tolist()) == plain


def test_colours_are_those_of_the_values_and_strokes_behind_a_surface_are_hidden():
    """A square seen along its normal: values rise to the right, one stroke before, one behind."""
    back = VIEW / np.linalg.norm(VIEW)
    right = np.cross([0.0, 0.0, 1.0], back) / np.linalg.norm(np.cross([0.0, 0.0, 1.0], back))
    up = np.cross(back, right)
    square = np.array([-right - up, right - up, right + up, -right + up])
    bar = ColourBar(title="value [-]", low=0.0, high=1.0, colours="gray")
    layer = Layer(
        vertices=square, faces=np.array([[0, 1, 2], [0, 2, 3]]), values=np.array([0.0, 1, 1, 0])
    )
    along = 0.8 * np.array([-right, right])
    strokes = [
        Lines(segments=(along + height * up + side * back)[None], colour=colour, width=6.0)
        for height, side, colour in ((0.5, 0.5, "red"), (-0.5, -0.5, "blue"))
    ]
    scene = Scene(title="", layers=(layer,), lines=tuple(strokes), bar=bar)
    picture = imread(BytesIO(draw.draw(scene)))[::-1, :, :3]
    frame = frame_of(scene)
    column, row = draw._pixels(np.array([[0.0, 0, 0]]), frame)[0].astype(int)
    shown = picture[row, column - 100 : column + 101, 0]
    # Facing the viewer all of it has one shade; the grey rises by 100 of its half width in pixels.
    half = draw._pixels(right[None], frame)[0, 0] - column
    assert shown[100] / shown[200] == pytest.approx(0.5 / (0.5 + 50 / half), rel=0.02)
    assert shown[0] / shown[200] == pytest.approx((0.5 - 50 / half) / (0.5 + 50 / half), rel=0.03)
    assert 1e-3 < share(picture, red) < 0.02
    assert share(picture, blue) == 0.0
