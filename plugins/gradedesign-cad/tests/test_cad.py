"""Solids of CadQuery, build123d and the kernel alone as parts, with named faces as regions."""

import io
import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

import gradedesign_cad
from gradedesign import PartError, load_case, load_part
from gradedesign.design.check.draft_case import draft_case
from gradedesign.program.host.registry import build_registry
from gradedesign_cad import write_part
from gradedesign_cad.solid_file import Solid, read_solid, write_solid

ROOT = Path(__file__).parents[3]
REGISTRY = build_registry(plugins=[gradedesign_cad])

#: Plate of 60 x 30 x 10 mm from the origin to the upper right, two holes of 8 mm, and their places.
HOLES = ((10.0, 15.0), (50.0, 15.0))
VOLUME = 60.0 * 30.0 * 10.0 - 2.0 * np.pi * 4.0**2 * 10.0

CASE = """
[case]
name = "plate"
[part]
file = "plate.solid"
mesh_size = "5 mm"
[region.bolts]
name = "bolts"
count = 2
[region.same]
cylinder = {diameter = "8 mm", axis = "z"}
count = 2
[region.seat]
name = "seat"
[region.left]
name = "left"
[material]
name = "Ti-6Al-4V"
[[load_case]]
name = "push"
fix = [{region = "bolts"}]
load = [{region = "left", force = ["100 N", "0 N", "0 N"]}]
[limits]
safety_factor = 2
[lattice]
cell = "gyroid-sheet"
size = "10 mm"
"""


def of_kernel():
    """The plate and its faces by OpenCASCADE itself."""
    pytest.importorskip("OCP", reason="no OpenCASCADE is installed")
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
    from OCP.TopAbs import TopAbs_FACE

    from gradedesign_cad._kernel import _parts, _surface

    body = BRepPrimAPI_MakeBox(60.0, 30.0, 10.0).Shape()
    for x, y in HOLES:
        axes = gp_Ax2(gp_Pnt(x, y, -1.0), gp_Dir(0.0, 0.0, 1.0))
        body = BRepAlgoAPI_Cut(body, BRepPrimAPI_MakeCylinder(axes, 4.0, 20.0).Shape()).Shape()
    faces = list(_parts(body, TopAbs_FACE))
    return body, {
        "bolts": [f for f in faces if _surface(f)["kind"] == "cylinder"],
        "seat": [f for f in faces if places(f)[0][2] == pytest.approx(10.0)],
        "left": [f for f in faces if places(f)[1][0] == pytest.approx(0.0)],
    }


def places(face):
    """Least and largest coordinates of a face, mm."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(face, box, False, False)
    lower, upper = box.CornerMin(), box.CornerMax()
    return [(p.X(), p.Y(), p.Z()) for p in (lower, upper)]


def of_cadquery():
    """The plate as CadQuery makes it, with selectors."""
    cq = pytest.importorskip("cadquery", reason="needs gradedesign-cad[cadquery]")
    plate = cq.Workplane().box(60, 30, 10, centered=False).faces(">Z").workplane(origin=(0, 0, 10))
    plate = plate.pushPoints(HOLES).hole(8)
    return plate, {
        "bolts": plate.faces("%CYLINDER"), "seat": plate.faces(">Z"), "left": plate.faces("<X"),
    }  # fmt: skip


def of_build123d():
    """The plate as build123d makes it, by its builder."""
    bd = pytest.importorskip("build123d", reason="needs gradedesign-cad[build123d]")
    with bd.BuildPart() as plate:
        bd.Box(60, 30, 10, align=(bd.Align.MIN,) * 3)
        with bd.Locations(*((x, y, 10.0) for x, y in HOLES)):
            bd.Hole(4)
    return plate, {
        "bolts": plate.faces().filter_by(bd.GeomType.CYLINDER),
        "seat": plate.faces().sort_by(bd.Axis.Z)[-1],
        "left": plate.faces().sort_by(bd.Axis.X)[0],
    }


MAKERS = pytest.mark.parametrize("make", [of_kernel, of_cadquery, of_build123d])


@MAKERS
def test_named_faces_of_a_solid_are_regions_of_a_case(make, tmp_path):
    solid, faces = make()
    assert write_part(solid, tmp_path / "plate.solid", faces=faces) == tmp_path / "plate.solid"
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    part = load_part(tmp_path, registry=REGISTRY)
    # Chords of 12 degrees enclose up to 0.2 % less than a bore, which is 5.6 % of the plate.
    assert part.volume == pytest.approx(VOLUME, rel=2e-4)
    assert part.report.changes == {}
    area = {name: region.area for name, region in part.regions.items()}
    assert area["bolts"] == pytest.approx(2 * np.pi * 8.0 * 10.0, rel=2e-3)
    assert area["seat"] == pytest.approx(60.0 * 30.0 - 2 * np.pi * 16.0, rel=2e-4)
    assert area["left"] == pytest.approx(300.0, rel=1e-9)
    for name in ("bolts", "same"):
        assert len(part.regions[name].faces) == 2
    # As the kernel has them, not fitted to facets.
    bores = [s for s in part.file_faces.surfaces.values() if s.kind == "cylinder"]
    assert [s.diameter for s in bores] == pytest.approx([8.0, 8.0], rel=1e-12)
    assert sorted(tuple(np.round(s.point[:2], 9)) for s in bores) == list(HOLES)
    assert load_case(tmp_path, registry=REGISTRY).name == "plate"


@MAKERS
def test_the_same_solid_gives_the_same_file_and_stays_as_it_is(make, tmp_path):
    solid, faces = make()
    first = write_part(solid, tmp_path / "a.solid", faces=faces, chord_tolerance=0.1).read_bytes()
    fine = write_part(solid, tmp_path / "b.solid", faces=faces).read_bytes()
    assert len(fine) > len(first)
    again = write_part(solid, tmp_path / "a.solid", faces=faces, chord_tolerance=0.1)
    assert again.read_bytes() == first
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.solid", "b.solid"]
    assert read_solid(again).chord_tolerance == 0.1


@MAKERS
def test_what_is_no_solid_or_no_face_of_it_is_refused(make, tmp_path):
    solid, faces = make()
    _, others = make()
    path = tmp_path / "plate.solid"
    for given, named, words in (
        (solid, {"seat": others["seat"]}, 'faces["seat"]: one of its 1 faces is none of the solid'),
        (solid, {"seat": []}, 'faces["seat"]: no face'),
        (solid, {" ": faces["seat"]}, "the name ' '"),
        (solid, {"seat": faces["seat"], "top": faces["seat"]}, 'is "seat" already'),
        (faces["bolts"], {}, "no solid in"),
        ("plate", {}, "no solid in str"),
        (3.0, {}, "no solid in float"),
    ):
        with pytest.raises(PartError) as refused:
            write_part(given, path, faces=named)
        assert words in str(refused.value)
    with pytest.raises(PartError, match=r"name it plate\.solid"):
        write_part(solid, tmp_path / "plate.step")
    with pytest.raises(PartError, match="expected more than 0"):
        write_part(solid, path, chord_tolerance=0.0)
    with pytest.raises(PartError, match="cannot be written"):
        write_part(solid, tmp_path / "missing" / "plate.solid")
    assert list(tmp_path.iterdir()) == []


def test_whatever_holds_the_solid_of_cadquery_is_taken(tmp_path):
    plate, faces = of_cadquery()
    import cadquery as cq

    first = write_part(plate, tmp_path / "a.solid", faces=faces).read_bytes()
    for held in (plate.val(), [plate.val()], cq.Assembly().add(plate), plate.val().wrapped):
        assert write_part(held, tmp_path / "b.solid", faces=faces).read_bytes() == first


def test_whatever_holds_the_solid_of_build123d_is_taken(tmp_path):
    plate, faces = of_build123d()
    first = write_part(plate, tmp_path / "a.solid", faces=faces).read_bytes()
    for held in (plate.part, plate.part.solids(), plate.part.solid(), plate.part.wrapped):
        assert write_part(held, tmp_path / "b.solid", faces=faces).read_bytes() == first


@pytest.mark.slow
@pytest.mark.parametrize("page", ["plugins/gradedesign-cad/README.md", "docs/parts.md"])
def test_the_example_runs(page, tmp_path):
    """As it is printed, with a case that ends after the solid part."""
    pytest.importorskip("cadquery", reason="needs gradedesign-cad[cadquery]")
    blocks = re.findall(r"^```python\n(.*?)^```$", (ROOT / page).read_text(encoding="utf-8"),
                        flags=re.DOTALL | re.MULTILINE)  # fmt: skip
    (example,) = (block for block in blocks if "import cadquery" in block)
    (tmp_path / "plate").mkdir()
    case = CASE.replace('[region.left]\nname = "left"\n', "").replace('"left"', '"seat"')
    case += '[run]\nstop_after = "solid"\n[output]\nformats = ["stl"]\n'
    (tmp_path / "plate" / "case.toml").write_text(case, encoding="utf-8")
    code = example + "print(result.status, result.solid_mass_g)\n"
    ended = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=300,
        check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    status, mass = ended.stdout.split()[-2:]
    # Ti-6Al-4V of 4.41 g/cm^3; tetrahedra follow the bores, 5.6 % of the plate, within 2 %.
    assert (status, float(mass)) == ("partial", pytest.approx(4.41e-3 * VOLUME, rel=1e-3))


def test_a_placed_and_mirrored_solid_is_written_where_it_stands(tmp_path):
    body, _ = of_kernel()
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
    from OCP.TopLoc import TopLoc_Location

    move, mirror = gp_Trsf(), gp_Trsf()
    move.SetTranslation(gp_Vec(5.0, -3.0, 2.0))
    mirror.SetMirror(gp_Ax2(gp_Pnt(0.0, 0.0, 0.0), gp_Dir(1.0, 0.0, 0.0)))
    for place, lower in ((move, (5.0, -3.0, 2.0)), (mirror, (-60.0, 0.0, 0.0))):
        placed = body.Moved(TopLoc_Location(place), False)
        raw = read_solid(write_part(placed, tmp_path / "plate.solid"))
        corners = raw.corners.reshape(-1, 3)
        np.testing.assert_allclose(corners.min(axis=0), lower, atol=1e-9)
        np.testing.assert_allclose(np.ptp(corners, axis=0), (60.0, 30.0, 10.0), atol=1e-9)
        a, b, c = np.moveaxis(raw.corners, 1, 0)
        assert (a * np.cross(b, c)).sum() / 6.0 == pytest.approx(VOLUME, rel=2e-4)


def test_a_case_is_begun_with_the_named_faces(tmp_path):
    solid, faces = of_kernel()
    draft = draft_case(write_part(solid, tmp_path / "plate.solid", faces=faces), REGISTRY)
    assert {"bolts", "seat", "left"} <= set(draft.regions)
    assert draft.lines["bolts"].startswith('name = "bolts"\n')
    assert draft.part.units == "mm"


def tetrahedron():
    """A file without a kernel: a corner of a cube."""
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    return Solid(
        corners=points[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]],
        label=np.array([1, 2, 3, 4]),
        names={4: "slope"},
        surfaces={k: {"kind": "plane"} for k in (1, 2, 3, 4)},
        chord_tolerance=0.01,
    )


def test_a_file_is_read_back_as_it_was_written(tmp_path):
    solid = tetrahedron()
    write_solid(tmp_path / "a.solid", solid)
    raw = read_solid(tmp_path / "a.solid")
    np.testing.assert_array_equal(raw.corners, solid.corners)
    np.testing.assert_array_equal(raw.faces.label, solid.label)
    assert (raw.unit, raw.chord_tolerance, dict(raw.faces.names)) == ("mm", 0.01, {4: "slope"})


def archive(**changed):
    """Bytes of a file with some of its arrays replaced; None leaves one out."""
    solid = tetrahedron()
    about = {"version": 1, "names": {}, "surfaces": {}, "chord_tolerance": 0.1}
    arrays = {"corners": solid.corners, "label": solid.label, "about": about, **changed}
    if isinstance(arrays["about"], dict):
        text = json.dumps(arrays["about"]).encode()
        arrays["about"] = np.frombuffer(text, dtype=np.uint8)
    data = io.BytesIO()
    np.savez(data, **{name: array for name, array in arrays.items() if array is not None})
    return data.getvalue()


def bomb():
    """An archive that says to hold 4 GB."""
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("corners.npy", b"0")
    content = bytearray(data.getvalue())
    at = content.index(b"PK\x01\x02") + 24  # size once unpacked, in the directory
    content[at : at + 4] = (4_000_000_000).to_bytes(4, "little")
    return bytes(content)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "damaged"),
        (b"solid plate\n", "damaged"),
        (archive()[:-40], "damaged"),
        (archive(label=None), "damaged"),
        (archive(label=np.array([1, 2])), "triangles"),
        (archive(corners=np.full((4, 3, 3), np.nan)), "NaN"),
        (archive(corners=np.zeros((0, 3, 3)), label=np.zeros(0, int)), "no triangles"),
        (archive(corners=np.zeros(5)), "damaged"),
        (archive(corners=np.array([{}], dtype=object)), "damaged"),
        (archive(about={"version": 2}), "version 2, expected 1"),
        (archive(about={"version": 1}), "damaged"),
        (archive(about=np.zeros(3, np.uint8)), "damaged"),
        (bomb(), "4000000000 bytes once unpacked"),
    ],
)
def test_damaged_files_are_refused_by_name(content, words, tmp_path):
    (tmp_path / "plate.solid").write_bytes(content)
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    with pytest.raises(PartError) as refused:
        load_part(tmp_path, registry=REGISTRY)
    assert "plate.solid" in str(refused.value)
    assert words in str(refused.value)
