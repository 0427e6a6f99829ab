"""STEP and IGES parts: exact faces, names, colours, units; closed triangles; damage named."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("OCP", reason="cadquery-ocp-novtk is not installed")

from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakeSphere,
)
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from OCP.IGESCAFControl import IGESCAFControl_Writer
from OCP.Interface import Interface_Static
from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_AsIs
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_FACE
from OCP.TopExp import TopExp_Explorer
from OCP.XCAFDoc import XCAFDoc_ColorGen, XCAFDoc_ColorSurf, XCAFDoc_DocumentTool

from gradedesign import PartError
from gradedesign.geometry.formats.read_stl import read_stl
from gradedesign.geometry.part.exact_faces import exact_faces
from gradedesign.geometry.part.file_faces import carried
from gradedesign.geometry.part.raw_triangles import in_mm
from gradedesign.geometry.part.regions import select_regions
from gradedesign.geometry.part.regions_schema import RegionSpec
from gradedesign.geometry.part.repair import build_surface
from gradedesign.geometry.part.smooth_faces import segment_faces
from gradedesign.geometry.triangles.surface_mesh import enclosed_volume
from gradedesign_formats.read_3mf import read_3mf
from gradedesign_step.cad_reader import read_iges, read_step

#: Centres of the holes of 6 mm diameter in the plate of 40 x 30 x 10 mm.
HOLES = ((8.0, 8.0), (32.0, 22.0))


def plate():
    body = BRepPrimAPI_MakeBox(40.0, 30.0, 10.0).Shape()
    for x, y in HOLES:
        axes = gp_Ax2(gp_Pnt(x, y, -1.0), gp_Dir(0.0, 0.0, 1.0))
        body = BRepAlgoAPI_Cut(body, BRepPrimAPI_MakeCylinder(axes, 3.0, 20.0).Shape()).Shape()
    return body


def document(shape, named=()):
    """A document with one shape, light blue; some of its faces named and red."""
    result = TDocStd_Document(TCollection_ExtendedString("test"))
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(result.Main())
    colors = XCAFDoc_DocumentTool.ColorTool_s(result.Main())
    label = shapes.AddShape(shape, False)
    TDataStd_Name.Set_s(label, TCollection_ExtendedString("plate"))
    blue = Quantity_Color(0.2, 0.4, 0.8, Quantity_TOC_sRGB)
    colors.SetColor(label, blue, XCAFDoc_ColorGen)
    explorer, number = TopExp_Explorer(shape, TopAbs_FACE), 0
    while explorer.More():
        number += 1
        if number in named:
            face = shapes.AddSubShape(label, explorer.Current())
            TDataStd_Name.Set_s(face, TCollection_ExtendedString(f"seat {number}"))
            red = Quantity_Color(1.0, 0.0, 0.0, Quantity_TOC_sRGB)
            colors.SetColor(face, red, XCAFDoc_ColorSurf)
        explorer.Next()
    return result


def step(path, shape, named=(), unit="MM"):
    writer = STEPCAFControl_Writer()
    Interface_Static.SetIVal_s("write.stepcaf.subshapes.name", 1)
    Interface_Static.SetCVal_s("write.step.unit", unit)
    assert writer.Transfer(document(shape, named), STEPControl_AsIs)
    writer.Write(str(path))
    return path


def found_in(raw, **specs):
    """Surface, smooth faces and regions as reading a case finds them."""
    raw = in_mm(raw, raw.unit, "test")
    surface, report = build_surface(raw.corners, bodies="all")
    file_faces = carried(raw.faces, raw.corners, surface, tolerance=10 * report.weld_tolerance)
    faces = exact_faces(surface, file_faces)
    models = {name: RegionSpec.model_validate(spec) for name, spec in specs.items()}
    return surface, faces, select_regions(surface, faces, models, file_faces)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    return step(tmp_path_factory.mktemp("cad") / "plate.step", plate(), (1, 7), "INCH")


def test_unit_names_colours_and_exact_cylinders(written):
    raw = read_step(written)
    assert raw.unit == "inch"
    assert set(raw.faces.names.values()) == {"seat 1", "seat 7"}
    assert sorted(set(raw.faces.colors.values())) == ["#3366cc", "#ff0000"]
    assert raw.faces.numbers == tuple(range(1, 9))
    surface, faces, regions = found_in(
        raw,
        holes={"cylinder": {"diameter": ["5.9 mm", "6.1 mm"], "axis": "z"}, "count": 2},
        one={"cylinder": {}, "name": "seat 7"},
        seat={"name": "seat 1"},
        red={"color": "#ff0000"},
    )
    # Triangles stay within the chord tolerance, 1e-4 of the diagonal of 51 mm, of the circles.
    assert raw.chord_tolerance == pytest.approx(1e-4 * np.sqrt(40**2 + 30**2 + 10**2), rel=1e-6)
    exact = 40 * 30 * 10 - 2 * np.pi * 9 * 10
    assert enclosed_volume(surface) == pytest.approx(exact, rel=1e-4)
    walls = [face for face in faces.faces if face.kind == "cylinder"]
    assert [face.diameter for face in walls] == pytest.approx([6.0, 6.0], rel=1e-9)
    assert all(face.concave for face in walls)
    centres = sorted(tuple(np.round(face.point, 6)) for face in walls)
    np.testing.assert_allclose(centres, [(*centre, 5.0) for centre in HOLES], atol=1e-6)
    assert regions["holes"].area == pytest.approx(2 * np.pi * 6 * 10, rel=1e-2)
    assert regions["one"].area == pytest.approx(np.pi * 6 * 10, rel=1e-2)
    assert regions["red"].area == pytest.approx(regions["seat"].area + regions["one"].area)


def test_the_stated_chord_tolerance_sets_the_triangles(written):
    coarse, fine = read_step(written, 0.2), read_step(written, 0.001)
    assert len(fine.corners) > 2 * len(coarse.corners)
    for raw, tolerance in ((coarse, 0.2), (fine, 0.001)):
        assert raw.chord_tolerance == tolerance
        wall = in_mm(raw, "inch", "test").corners[raw.faces.label == 7]
        middle = (wall + np.roll(wall, 1, axis=1)) / 2.0
        centre = min(HOLES, key=lambda c: np.hypot(*(wall[0, 0, :2] - c)))
        off = 3.0 - np.hypot(*(middle[..., :2] - centre).transpose(2, 0, 1))
        assert -1e-6 < off.min() <= off.max() <= tolerance


def test_loose_faces_of_iges_are_sewn_and_close(tmp_path):
    writer = IGESCAFControl_Writer()
    writer.Transfer(document(plate(), (7,)))
    writer.ComputeModel()
    writer.Write(str(tmp_path / "plate.igs"))
    raw = read_iges(tmp_path / "plate.igs")
    assert raw.unit == "mm"
    assert raw.warnings == ("8 loose faces sewn within 0.01 mm",)
    assert set(raw.faces.names.values()) == {"seat 7"}
    surface, faces, _ = found_in(raw)
    assert enclosed_volume(surface) == pytest.approx(12000 - 180 * np.pi, rel=1e-3)
    assert sorted(f.diameter for f in faces.faces if f.diameter) == pytest.approx([6, 6], rel=1e-6)


def ball(up):
    """A ball of 10 mm radius, its poles along a direction, with a bore 4 mm off its centre."""
    axes = gp_Ax2(gp_Pnt(4.0, 0.0, -20.0), gp_Dir(0.0, 0.0, 1.0))
    bore = BRepPrimAPI_MakeCylinder(axes, 3.0, 40.0).Shape()
    sphere = BRepPrimAPI_MakeSphere(gp_Ax2(gp_Pnt(0.0, 0.0, 0.0), gp_Dir(*up)), 10.0).Shape()
    return BRepAlgoAPI_Cut(sphere, bore).Shape()


def test_poles_seams_and_curved_cuts_close(tmp_path):
    raw = read_step(step(tmp_path / "ball.stp", ball((1.0, 0.0, 0.0))), 0.01)
    surface, faces, _ = found_in(raw)
    kinds = [face.kind for face in faces.faces]
    assert kinds.count("cylinder") == 1
    # 4000 / 3 pi less the bore: twice the height of the ball over a disc of rings around (4, 0).
    radius, angle = np.meshgrid((np.arange(400) + 0.5) * 0.0075, np.arange(400) * np.pi / 200)
    x, y = 4.0 + radius * np.cos(angle), radius * np.sin(angle)
    bored = (2.0 * np.sqrt(100.0 - x**2 - y**2) * radius).sum() * 0.0075 * np.pi / 200
    assert enclosed_volume(surface) == pytest.approx(4000 / 3 * np.pi - bored, rel=3e-3)


def test_a_faulty_solid_is_refused_though_its_triangles_close(tmp_path):
    """The bore on the ball's seam comes back inside out: what is left is the core, 503 mm^3."""
    with pytest.raises(PartError, match="1 of its 1 solids have faults in their faces or edges"):
        read_step(step(tmp_path / "ball.stp", ball((0.0, 0.0, 1.0))))


def test_what_is_no_part_is_named(tmp_path, written):
    path = tmp_path / "bad.step"
    text = written.read_bytes()
    for content, words in (
        (b"", "not a STEP file"),
        (b"solid x\nendsolid x\n", "not a STEP file"),
        (b"ISO-10303-21;\nHEADER;\n", "bad.step: "),
        (text[: len(text) // 2], "bad.step: "),
    ):
        path.write_bytes(content)
        with pytest.raises(PartError) as refused:
            read_step(path)
        assert words in str(refused.value)
    face = TopExp_Explorer(plate(), TopAbs_FACE).Current()
    with pytest.raises(PartError, match=r"no solid in the file: 1 faces of it close none"):
        read_step(step(path, face))
    with pytest.raises(PartError, match="cannot be read"):
        read_step(tmp_path / "absent.step")


CASE = """\
[case]
name = "featuretype"
[part]
file = "{file}"
{unit}mesh_size = "6 mm"
[region.floor]
plane = "z = min"
[region.top]
plane = "z = max"
[material]
name = "Ti-6Al-4V"
[[load_case]]
name = "press"
fix = [{{region = "floor"}}]
load = [{{region = "top", force = ["0 N", "0 N", "-20 kN"]}}]
[limits]
displacement = [{{region = "top", magnitude = "0.01 mm"}}]
[lattice]
cell = "gyroid-sheet"
size = "20 mm"
density = [0.3, 0.6]
"""
FORMS = {"STEP": "", "3MF": "", "STL": 'units = "inch"\n'}
#: Volume of the STL file's triangles, as its README states it, in^3.
VOLUME_INCH = 11.628


def real_cases(folder):
    """Cases of the machined block in three formats, from the folder that the environment names."""
    source = os.environ.get("GRADEDESIGN_REAL_PARTS")
    if source is None or not (Path(source) / "featuretype.STEP").is_file():
        pytest.skip("GRADEDESIGN_REAL_PARTS names no folder with featuretype.STEP, .3MF and .STL")
    for form, unit in FORMS.items():
        (folder / form).mkdir()
        file = f"featuretype.{form}"
        (folder / form / file).write_bytes((Path(source) / file).read_bytes())
        text = CASE.format(file=file, unit=unit)
        (folder / form / "case.toml").write_text(text, encoding="utf-8")
    return {form: folder / form for form in FORMS}


def result_of(command, case, output):
    """What a command prints about a case; it must end well."""
    ended = subprocess.run(
        [sys.executable, "-m", "gradedesign", command, str(case), *output],
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


@pytest.mark.slow
def test_one_block_in_three_formats_has_one_volume(tmp_path):
    volumes = {}
    for form, case in real_cases(tmp_path).items():
        told = json.loads(result_of("check", case, ["--no-picture", "--json"]))
        assert told["part"]["units"] == "inch"
        volumes[form] = told["part"]["volume_mm3"]
    assert volumes == pytest.approx(dict.fromkeys(volumes, VOLUME_INCH * 25.4**3), rel=0.005)


@pytest.mark.slow
def test_one_block_in_three_formats_ends_alike(tmp_path):
    results = {}
    for form, case in real_cases(tmp_path).items():
        result_of("run", case, ["-o", str(tmp_path / f"out-{form}")])
        text = (tmp_path / f"out-{form}" / "result.json").read_text(encoding="utf-8")
        results[form] = json.loads(text)
    assert len({result["status"] for result in results.values()}) == 1
    masses = [result["mass_g"] for result in results.values()]
    assert masses == pytest.approx([masses[0]] * 3, rel=0.005)


PARTS = Path(__file__).parents[4] / "shared" / "parts"


@pytest.mark.skipif(not PARTS.is_dir(), reason="the parts are not beside this checkout")
def test_one_part_in_three_formats_has_the_same_volume_and_regions():
    # 11.628 in^3 of the same CAD program; its 3MF leaves out facets without area.
    found = {}
    for name, read in (("STL", read_stl), ("3MF", read_3mf), ("STEP", read_step)):
        raw = in_mm(read(PARTS / f"featuretype.{name}"), "inch", name)
        surface, report = build_surface(raw.corners)
        specs = {"base": {"plane": "y = min"}, "bolts": {"cylinder": {"diameter": "6.756 mm"}}}
        models = {key: RegionSpec.model_validate(spec) for key, spec in specs.items()}
        if name == "STEP":
            file_faces = carried(
                raw.faces, raw.corners, surface, tolerance=10 * report.weld_tolerance
            )
            faces = exact_faces(surface, file_faces)
        else:
            file_faces, faces = None, segment_faces(surface)
        regions = select_regions(surface, faces, models, file_faces)
        assert len(regions["bolts"].faces) == 8
        areas = [regions[key].area for key in specs]
        found[name] = [enclosed_volume(surface), *areas]
    for name in ("3MF", "STEP"):
        np.testing.assert_allclose(found[name][:2], found["STL"][:2], rtol=1e-3)
        # The facets of the 3MF are coarser: chords are shorter than their arcs.
        np.testing.assert_allclose(found[name][2], found["STL"][2], rtol=1e-2)
    assert found["STL"][0] == pytest.approx(11.628 * 25.4**3, rel=1e-3)
