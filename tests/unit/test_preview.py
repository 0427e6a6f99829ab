"""`gradedesign preview`: its data, the selectors it hands out, mistakes, and the server."""

import base64
import json
import re
import threading
import tomllib
import urllib.error
import urllib.request
import zlib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from small_parts import SHORT_BAR

from gradedesign.errors import CaseError
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.face_selectors import face_selectors
from gradedesign.geometry.part.face_words import described_faces
from gradedesign.geometry.part.regions import select_regions
from gradedesign.geometry.part.regions_schema import RegionSpec
from gradedesign.geometry.part.smooth_faces import segment_faces
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.program.commands import serve_page
from gradedesign.program.pictures.packed import packed, packed_corners, packed_mesh, quantised
from gradedesign.program.pictures.page import scene_page

CASES = Path(__file__).parents[2] / "cases"


def unpacked(data):
    """Rows of packed whole numbers, read as the page reads them: bytes, planes, running sums."""
    size = data["bits"] // 8
    planes = np.frombuffer(zlib.decompress(base64.b64decode(data["data"])), dtype=np.uint8)
    planes = planes.reshape(data["columns"], size, data["rows"]).astype(np.uint64)
    differences = sum(planes[:, k] << np.uint64(8 * k) for k in range(size))
    return (np.cumsum(differences, axis=1) % np.uint64(2 ** data["bits"])).astype(np.int64).T


def values(data):
    return np.array(data["lower"]) + np.array(data["step"]) * unpacked(data)


def page_data(path):
    text = path.read_text(encoding="utf-8")
    return json.loads(re.search(r'<script type="application/json">(.*?)</script>', text)[1])


@pytest.mark.parametrize("bits", [8, 16, 32])
def test_whole_numbers_come_back(bits):
    drawn = np.random.default_rng(29).integers(0, 2**bits, (257, 3))
    drawn[:2] = [[0, 2**bits - 1, 0], [2**bits - 1, 0, 0]]  # the largest differences
    data = json.loads(json.dumps(packed(drawn, bits)))
    assert np.array_equal(unpacked(data), drawn)


def test_values_come_back_within_half_a_step():
    drawn = np.random.default_rng(31).normal(size=(400, 3)) * [1e-3, 1.0, 1e4]
    drawn[:, 1] = 7.0
    data = quantised(drawn)
    # Half of a 65,535th of the range, and rounding of floating point beside it.
    allowed = 0.5 * np.ptp(drawn, axis=0) / 65535 * (1 + 1e-9) + 1e-12
    assert (np.abs(values(data) - drawn) <= allowed).all()
    assert np.abs(values(data) - drawn).max() > 1e-3  # 4e4 / 65535 / 2: it is not exact
    assert unpacked(quantised(np.zeros((0, 3)))).shape == (0, 3)


def test_a_mesh_comes_back_with_its_triangles():
    sphere = trimesh.creation.icosphere(subdivisions=3, radius=20.0)
    surface = SurfaceMesh(vertices=np.array(sphere.vertices), faces=np.array(sphere.faces))
    data = packed_mesh(surface)
    assert np.array_equal(unpacked(data["triangles"]), surface.faces)
    assert np.abs(values(data["vertices"]) - surface.vertices).max() <= 20.0 / 65535 * (1 + 1e-9)
    again = packed_corners(surface.vertices[surface.faces])
    corners = values(again["vertices"])[unpacked(again["triangles"])]
    assert len(values(again["vertices"])) == len(surface.vertices)
    assert np.abs(corners - surface.vertices[surface.faces]).max() <= 20.0 / 65535 * (1 + 1e-9)


def drilled_plate():
    """A plate with two holes of 6 mm, a slanted edge, a countersink and a round boss."""
    plate = trimesh.creation.box(extents=(60.0, 30.0, 8.0))
    cutters = [
        trimesh.creation.cylinder(radius=3.0, height=20.0, sections=48).apply_translation([x, 0, 0])
        for x in (-20.0, 0.0)
    ]
    cone = trimesh.creation.cone(radius=6.0, height=6.0, sections=48)
    cone.apply_transform(trimesh.transformations.rotation_matrix(np.pi, [1, 0, 0]))
    cutters.append(cone.apply_translation([18.0, 0.0, 4.0]))
    wedge = trimesh.creation.box(extents=(20.0, 60.0, 20.0))
    wedge.apply_transform(trimesh.transformations.rotation_matrix(np.radians(35.0), [0, 1, 0]))
    cutters.append(wedge.apply_translation([38.0, 0.0, 10.0]))
    body = trimesh.boolean.difference([plate, *cutters], engine="manifold")
    boss = trimesh.creation.cylinder(radius=4.0, height=6.0, sections=48)
    body = trimesh.boolean.union([body, boss.apply_translation([-20.0, 10.0, 5.0])])
    return SurfaceMesh(vertices=np.array(body.vertices), faces=np.array(body.faces))


@pytest.mark.parametrize("surface", [drilled_plate(), box_surface((9.0, 5.0, 2.0))])
def test_every_selector_finds_the_faces_that_it_says(surface):
    faces = segment_faces(surface)
    found = face_selectors(surface, faces)
    assert set(found) == set(range(len(faces.faces)))
    for number, selectors in found.items():
        assert selectors[0].faces == (number,)
        for selector in selectors:
            assert number in selector.faces
            spec = {"pasted": RegionSpec.model_validate(tomllib.loads(selector.text))}
            assert select_regions(surface, faces, spec)["pasted"].faces == selector.faces


def test_faces_are_said_as_an_engineer_says_them():
    surface = drilled_plate()
    words = described_faces(surface, segment_faces(surface))
    kinds = [face.kind for face in words]
    assert kinds.count("hole, 6 mm") == 2
    assert kinds.count("boss or rounding, 8 mm") == 1
    assert sum(kind.startswith("countersink") for kind in kinds) == 1
    hole = words[kinds.index("hole, 6 mm")]
    assert dict(hole.facts)["axis"] == "z"
    # 48 facets lie inside the circle: 2 pi 3 8 mm^2 less 0.07 %.
    assert hole.area == pytest.approx(2 * np.pi * 3 * 8, rel=2e-3)
    assert [found for found, _ in hole.regions] == ["this face", "2 faces like it"]
    slanted = [dict(f.facts)["normal"] for f in words if f.kind == "flat face"]
    assert any(normal == "(0.574, 0, 0.819)" for normal in slanted)  # sin and cos of 35 degrees


def test_a_selector_from_the_page_is_what_check_finds(cli, tmp_path):
    """The whole way: page, paste, check."""
    page = tmp_path / "page.html"
    assert cli("preview", CASES / "bracket", "-o", page).code == 0
    faces = page_data(page)["faces"]
    wanted = {}
    for face in faces:
        if face["kind"] in ("hole, 16 mm", "flat face", "boss or rounding, 24 mm"):
            for _, text in face["regions"]:
                wanted.setdefault(re.match(r"\[region\.(\w+)\]", text)[1], (text, face["area"]))
    assert len(wanted) > 10
    case = (CASES / "bracket" / "case.toml").read_text(encoding="utf-8")
    text = "".join(f"{lines}\n" for lines, _ in wanted.values())
    (tmp_path / "case.toml").write_text(case.replace("[material]", f"{text}[material]"))
    (tmp_path / "bracket.stl").write_bytes((CASES / "bracket" / "bracket.stl").read_bytes())
    ended = cli("check", tmp_path, "--json", "--no-picture")
    assert ended.code == 0, ended.err
    found = {region["name"]: region for region in json.loads(ended.out)["regions"]}
    for name, (_, area) in wanted.items():
        count = found[name]["faces"]
        assert (count == 1) == name.startswith("face_")
        if count == 1:
            assert found[name]["area_mm2"] == pytest.approx(area, rel=1e-9)


@pytest.fixture(scope="module")
def bracket(tmp_path_factory):
    """The page of the bracket: its text and its data."""
    from gradedesign.program.commands.preview import case_preview
    from gradedesign.program.host.registry import build_registry

    shown = case_preview(CASES / "bracket", build_registry(), allow_outside=False)
    path = tmp_path_factory.mktemp("page") / "page.html"
    path.write_text(shown.page(), encoding="utf-8")
    return path.read_text(encoding="utf-8"), page_data(path)


def test_the_page_holds_the_case(bracket):
    text, data = bracket
    assert "<title>bracket</title>" in text
    assert "768.5 g if solid in Ti-6Al-4V" in text
    assert "The MIT License" in text  # of three.js, which stands in the page
    assert 'src="data:image/png;base64,' in text  # the still picture
    assert not re.search(r'(src|href)="(?!data:)', text)  # nothing from elsewhere
    assert len(text) < 1.2e6
    roles = {region["name"]: region["role"] for region in data["regions"]}
    assert roles["bolts, passive solid"] == "supports"
    assert roles["lug_hole, passive solid"] == "loaded"
    pull, side = data["cases"]
    assert pull["actions"][0]["text"] == "1300 N"  # 500 and 1200
    assert dict(pull["facts"])["support bolts"] == "held in x, y, z"
    assert [view["id"] for view in data["views"]] == ["case", "cells"]
    assert data["views"][0]["note"] == "Arrows of one kind: length by size."
    labels = unpacked(data["part"]["labels"])[:, 0]
    assert set(labels) == set(range(len(data["faces"])))
    assert side["colour"] != pull["colour"]


def test_the_resultant_turns_nothing_about_its_line_of_action(bracket):
    """The moment about any point of the line is along the force: of the pull none is left."""
    _, data = bracket
    for case, force, moment in zip(
        data["cases"],
        np.array([[500.0, 0, 1200], [0, 500, 0]]),
        # About the bolts' centre (78, 23, 11): (12 - 78, 23 - 23, 80 - 11) x F, in N mm.
        np.array([[0, 69 * 500.0 + 66 * 1200, 0], [-69 * 500.0, 0, -66 * 500.0]]),
        strict=True,
    ):
        low, high = np.array(case["line"])
        along = (high - low) / np.linalg.norm(high - low)
        assert along == pytest.approx(force / np.linalg.norm(force), abs=1e-6)
        left = moment - np.cross(low - [78.0, 23.0, 11.0], force)
        # The faceted bore's centroid lies within 1e-3 mm of its axis.
        assert np.abs(np.cross(left, force) / (force @ force)).max() < 2e-3


def test_cells_and_what_stays_solid_fill_the_part(bracket):
    _, data = bracket
    cells = data["volumes"]["cells"]
    labels = unpacked(cells["values"])[:, 0]
    nx, ny, nz = cells["shape"]
    grid = labels.reshape(nz, ny, nx).transpose(2, 1, 0)

    def at(*point):
        index = np.rint((np.array(point) - cells["lower"]) / cells["step"]).astype(int)
        return cells["palette"][str(grid[tuple(index)])]

    solid = next(each["colour"] for each in cells["legend"] if each["text"] == "passive solid")
    assert at(12, 23, 87) == solid  # the lug, within 7.5 mm of its hole
    assert at(50, 12, 11) == solid  # within 4.5 mm of a bolt's hole
    # Cells of 22 mm from (1, 1, 1): neighbours along z beside the wall.
    assert at(12, 12, 34) != at(12, 12, 56) != solid
    assert at(12, 12, 34) == at(12, 34, 56)


@pytest.mark.parametrize(
    ("old", "new", "says", "line", "regions"),
    [
        ('"9 mm"', '"9 mmm"', "case.toml:11", 11, {"lug_hole"}),
        ('name = "Ti-6Al-4V"', 'name = "?"', "case.toml:", 18, {"bolts", "lug_hole"}),
        ('fix = [{region = "bolts"}]', 'fix = [{region = "bolts", components = "z"}]',
         "leave rigid motions free: free to translate along x", 29, {"bolts", "lug_hole"}),
        ('diameter = "12 mm"', 'diameter = "13 mm"', "nearest candidates", 13, {"bolts"}),
        ("[lattice]", "[lattice", "not valid TOML", 40, None),
        ('file = "bracket.stl"', 'file = "no.stl"', "no.stl", 6, None),
    ],
)  # fmt: skip
def test_a_mistake_is_told_with_its_line_and_what_can_be_shown(
    cli, tmp_path, old, new, says, line, regions
):
    text = (CASES / "bracket" / "case.toml").read_text(encoding="utf-8")
    assert old in text
    (tmp_path / "case.toml").write_text(text.replace(old, new), encoding="utf-8")
    (tmp_path / "bracket.stl").write_bytes((CASES / "bracket" / "bracket.stl").read_bytes())
    page = tmp_path / "page.html"
    ended = cli("preview", tmp_path, "-o", page)
    assert ended.code == 0
    assert says in re.sub(r"\s+", " ", ended.out)
    html = page.read_text(encoding="utf-8")
    alert = re.search(r'<div class="problem" role="alert">(.*?)</div>', html, re.DOTALL)[1]
    assert says in alert
    assert re.search(rf"<mark>\s*{line}  ", alert)
    assert ("Some of the case is left to state." in alert) == ('"?"' in new)
    data = page_data(page)
    if "no.stl" in new or new == "[lattice":
        assert "part" not in data
    else:
        assert len(data["faces"]) == 33
    if regions is not None:
        assert {each["name"] for each in data["regions"]} == regions
    if "13 mm" in new:
        assert [12.0, 23.0, 80.0] in data["places"]  # the hole that it may have meant


def test_without_cells_what_is_not_solid_is_open(cli, tmp_path):
    (tmp_path / "case.toml").write_text(
        SHORT_BAR
        + """
[[load_case]]
name = "shear"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-100 N"]}]
[limits]
displacement = [{region = "tip", magnitude = "0.05 mm"}]
[lattice]
phases = ["solid", "void"]
least_member = "6 mm"
"""
    )
    ended = cli("preview", tmp_path, "-o", tmp_path / "page.html")
    assert "mistake" not in ended.out
    data = page_data(tmp_path / "page.html")
    assert [view["title"] for view in data["views"]] == ["Part and loads", "Phases"]
    legend = [each["text"] for each in data["volumes"]["cells"]["legend"]]
    assert legend == ["solid or void", "passive solid"]
    facts = dict(data["cases"][0]["facts"])
    # 100 N at 16 mm; no rounding noise about the other axes.
    assert facts["moment"].startswith("(0, 1600, 0) N mm about the held regions' centre, (0, 4, 4)")


def test_texts_of_a_case_cannot_leave_their_place():
    name = "</script><script>alert('x')</script>"
    html = scene_page({"title": name, "part": {}}, None, words=[name])
    assert html.count("<script") == 3  # data, three.js and ours
    assert name not in html


def test_an_output_is_not_served_and_no_case_is_no_page(cli, tmp_path):
    ended = cli("preview", CASES / "mini", "-o", tmp_path / "a.html", "--watch")
    assert ended.code == 2
    assert "--output writes the page once" in ended.err
    assert cli("preview", tmp_path / "none", "-o", tmp_path / "a.html").code == 2


class Saved:
    """A page of a file's text, as the server has pages made."""

    made = 0

    def __init__(self, path):
        type(self).made += 1
        self.read = (path,)
        self.text = path.read_text(encoding="utf-8")

    def page(self, watch=""):
        return f"{self.text}|{watch}"


@pytest.fixture
def served(tmp_path):
    """The address of a page that is served and watched, and its file."""
    path = tmp_path / "case.toml"
    path.write_text("first", encoding="utf-8")
    Saved.made = 0
    server = serve_page._PageServer(lambda: Saved(path), 0, watch=True)
    server.refresh()
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield SimpleNamespace(url=f"http://127.0.0.1:{server.server_port}", path=path)
    server.shutdown()
    thread.join()
    server.server_close()


def got(url, **headers):
    request = urllib.request.Request(url, headers=headers)
    with urllib.request.urlopen(request, timeout=10) as answer:
        return answer.read().decode()


def test_a_saved_case_makes_the_page_again(served):
    text, _, state = got(f"{served.url}/").partition("|")
    assert text == "first"
    assert got(f"{served.url}/state") == state
    got(f"{served.url}/")
    assert Saved.made == 1  # nothing has changed
    served.path.write_text("the second", encoding="utf-8")
    assert got(f"{served.url}/state") != state
    text, _, state = got(f"{served.url}/").partition("|")
    assert text == "the second"
    assert got(f"{served.url}/state") == state


def test_the_server_answers_this_machine_alone(served):
    for path, host, code in (("/", "example.org", 403), ("/etc/passwd", None, 404)):
        headers = {} if host is None else {"Host": host}
        with pytest.raises(urllib.error.HTTPError) as told:
            got(served.url + path, **headers)
        assert told.value.code == code
        told.value.close()


def test_a_port_that_is_taken_is_told(served):
    port = int(served.url.rpartition(":")[2])
    with pytest.raises(CaseError, match=f"--port {port}: cannot be served on"):
        serve_page.serve_page(lambda: None, port=port, watch=False, on_start=print)
