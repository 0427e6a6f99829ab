"""3MF parts: unit, components, transforms, names and colours; damage and abuse refused by name."""

import zipfile

import numpy as np
import pytest

from gradedesign.errors import PartError
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.repair import build_surface
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points, enclosed_volume
from gradedesign_formats import _threemf_package
from gradedesign_formats.read_3mf import read_3mf

BOX = box_surface((1.0, 2.0, 3.0))
CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
SLICE = "http://schemas.microsoft.com/3dmanufacturing/slice/2015/07"
ROOT = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
RELS = (
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    f'<Relationship Type="{ROOT}" '
    'Target="/3D/3dmodel.model" Id="rel0"/></Relationships>'
)


def mesh(surface=BOX, marks=""):
    vertices = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in surface.vertices)
    triangles = "".join(
        f'<triangle v1="{a}" v2="{b}" v3="{c}" {marks if k < 2 else ""}/>'
        for k, (a, b, c) in enumerate(surface.faces)
    )
    return f"<mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>"


def model(resources, items='<item objectid="1"/>', attributes='unit="inch"', before=""):
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>{before}<model xmlns="{CORE}" {attributes}>'
        f"<resources>{resources}</resources><build>{items}</build></model>"
    )


def written(folder, text, rels=RELS, compression=zipfile.ZIP_DEFLATED):
    path = folder / "part.3mf"
    with zipfile.ZipFile(path, "w", compression) as archive:
        archive.writestr("_rels/.rels", rels)
        archive.writestr("3D/3dmodel.model", text)
    return path


def box(attributes="", marks=""):
    return f'<object id="1" {attributes}>{mesh(marks=marks)}</object>'


def test_unit_name_and_colours_come_along(tmp_path):
    colors = '<basematerials id="7"><base name="a" displaycolor="#CAD1EEFF"/>'
    colors += '<base name="b" displaycolor="#FF0000"/></basematerials>'
    body = box('name="lug &amp; pin" pid="7" pindex="0"', 'pid="7" p1="1"')
    raw = read_3mf(written(tmp_path, model(colors + body)))
    assert raw.unit == "inch"
    np.testing.assert_array_equal(raw.corners, corner_points(BOX))
    assert dict(raw.faces.names) == {0: "lug & pin", 1: "lug & pin"}
    assert dict(raw.faces.colors) == {0: "#ff0000", 1: "#cad1ee"}
    assert raw.faces.label.tolist() == [0, 0] + [1] * 10


@pytest.mark.parametrize(
    ("unit", "ours", "factor"),
    [("micron", "mm", 1e-3), ("foot", "inch", 12.0), ("meter", "m", 1.0), (None, "mm", 1.0)],
)
def test_every_unit_is_read(tmp_path, unit, ours, factor):
    text = model(box(), attributes="" if unit is None else f'unit="{unit}"')
    raw = read_3mf(written(tmp_path, text))
    assert raw.unit == ours
    assert raw.faces is None
    np.testing.assert_allclose(raw.corners, factor * corner_points(BOX))


def test_components_are_placed_turned_and_mirrored(tmp_path):
    """Row vectors: the axes of an inner object come first, the shift of the outer last."""
    quarter = "0 1 0 -1 0 0 0 0 1 10 0 0"  # x to y, y to -x, then 10 along x
    mirror = "-1 0 0 0 1 0 0 0 1 0 0 0"
    inner = (
        f'<object id="2" name="pair"><components><component objectid="1" transform="{quarter}"/>'
    )
    inner += '<component objectid="1" transform="2 0 0 0 2 0 0 0 2 0 0 0"/></components></object>'
    text = model(box() + inner, f'<item objectid="2" transform="{mirror}"/>')
    raw = read_3mf(written(tmp_path, text))
    first, second = raw.corners[:12].reshape(-1, 3), raw.corners[12:].reshape(-1, 3)
    np.testing.assert_allclose([first.min(axis=0), first.max(axis=0)], [[-10, 0, 0], [-8, 1, 3]])
    np.testing.assert_allclose([second.min(axis=0), second.max(axis=0)], [[-2, 0, 0], [0, 4, 6]])
    surface, report = build_surface(raw.corners, bodies="all")
    assert report.facets_flipped == report.shells_inverted == 0
    assert enclosed_volume(surface) == pytest.approx(6.0 + 48.0)
    assert dict(raw.faces.names) == {0: "pair", 1: "pair"}


def test_supports_are_left_out_with_a_word(tmp_path):
    support = box('type="support"').replace('id="1"', 'id="3"')
    text = model(box() + support, '<item objectid="1"/><item objectid="3"/>')
    raw = read_3mf(written(tmp_path, text))
    assert len(raw.corners) == 12
    assert raw.warnings == ("part.3mf: bodies left out: 'object 3' (object of type support)",)


#: A plate of 60 x 40 x 20 mm whose top is cut in two faces at x = 25 mm, the first two triangles.
PLATE = SurfaceMesh(
    vertices=[
        (0, 0, 0), (60, 0, 0), (60, 40, 0), (0, 40, 0), (0, 0, 20), (25, 0, 20), (60, 0, 20),
        (60, 40, 20), (25, 40, 20), (0, 40, 20),
    ],
    faces=[
        (4, 5, 8), (4, 8, 9), (5, 6, 7), (5, 7, 8), (0, 2, 1), (0, 3, 2), (0, 1, 6), (0, 6, 5),
        (0, 5, 4), (1, 2, 7), (1, 7, 6), (2, 3, 9), (2, 9, 8), (2, 8, 7), (3, 0, 4), (3, 4, 9),
    ],
)  # fmt: skip


def test_colours_on_one_plane_survive_a_negative_volume(tmp_path):
    colors = '<basematerials id="7"><base name="a" displaycolor="#FF0000"/>'
    colors += '<base name="b" displaycolor="#00FF00"/></basematerials>'
    green = 'pid="7" p1="1"'
    plate = f'<object id="1" pid="7" pindex="0">{mesh(PLATE, green)}</object>'
    cutter = box_surface((10.0, 10.0, 20.0))
    moved = cutter.vertices + np.array([20.0, 10.0, 0.0])
    cutter = SurfaceMesh(vertices=moved, faces=cutter.faces)
    slot = f'<object id="2">{mesh(cutter)}</object>'
    both = '<component objectid="1"/><component objectid="2"/>'
    text = model(
        f'{colors}{plate}{slot}<object id="3"><components>{both}</components></object>',
        '<item objectid="3"/>',
        attributes="",
    )
    path = written(tmp_path, text)
    with zipfile.ZipFile(path, "a") as archive:
        parts = '<part id="1" subtype="normal_part"/><part id="2" subtype="negative_part"/>'
        config = f'<config><object id="3">{parts}</object></config>'
        archive.writestr("Metadata/model_settings.config", config)
    raw = read_3mf(path)
    a, b, c = np.moveaxis(raw.corners, 1, 0)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    found = np.bincount(raw.faces.label, area)
    assert dict(raw.faces.colors) == {0: "#00ff00", 1: "#ff0000"}
    # 25 x 40 mm of green less 5 x 10; 8800 mm^2 in all less 1000 and 5 x 10 and, below, 10 x 10;
    # four walls of 10 x 20.
    np.testing.assert_allclose(found, [950.0, 8800.0 - 1000.0 - 50.0 - 100.0, 800.0], rtol=1e-6)


ITSELF = '<object id="1"><components><component objectid="1"/></components></object>'
ELSEWHERE = '<object id="1"><components><component objectid="2" p:path="/a"/></components></object>'
DOUBLING = "".join(
    f'<object id="{k}"><components><component objectid="{k + 1}"/><component objectid="{k + 1}"/>'
    f"</components></object>"
    for k in range(1, 25)
) + box().replace('id="1"', 'id="25"')
BOMB = '<!DOCTYPE a [<!ENTITY b "c">]>'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (model(box(), attributes=f'xmlns:s="{SLICE}" requiredextensions="s"'),
         "needs the slice extension of 3MF, which is not read; export the part as plain 3MF"),
        (model(ELSEWHERE, attributes=f'xmlns:p="{PRODUCTION}"'), "has no relation"),
        (model(box(), attributes='xmlns:q="urn:q" requiredextensions="q"'), "needs the q ext"),
        (model(box(), attributes='unit="furlong"'), "its unit is 'furlong'; expected one of"),
        (model(ITSELF), "or contain themselves"),
        (model(DOUBLING), "more than 100000 meshes"),
        (model(box(), before=BOMB), "declares a document type, which 3MF forbids"),
        (model(box(), '<item objectid="4"/>'), "object 4 is missing"),
        (model(box().replace('v1="0"', 'v1="8"')), "uses vertex 8, 8 are there"),
        (model(box().replace('v1="0"', 'v1="-1"')), "found '-1' where an index should be"),
        (model(box().replace('x="1.0"', 'x="nan"')), "found 'nan' where a number should be"),
        (model(box().replace('x="1.0"', 'x="1_0"')), "found '1_0' where a number"),
        (model(box().replace('x="1.0" ', "")), "an element lacks its x"),
        (model('<object id="1"></object>'), "object 1 of type model has no triangles"),
        (model('<object id="1" name="cap" type="surface"></object>'),
         "no solid is left beside 'cap' (object of type surface)"),
        (model('<object id="1" name="cap" type="surface"></object>', ""),
         "names none of the 1 objects in it (object 1 'cap' of type surface)"),
        (model(box() + box()), "object 1 is there twice"),
        (model(box(), '<item objectid="1" transform="1 0 0 0 1 0 0 0 0 0 0 0"/>'), "nothing"),
        (model(box(), ""), "nothing is to be built: its <build> names none of the 1 objects"),
        (model("", ""), "no triangles in the file"),
        (model(box())[:-40], "is damaged in line 1"),
        ("<model/>", "its model is not of 3MF's core specification"),
        (model(box('pid="7" pindex="4"').join(('<basematerials id="7"></basematerials>', ""))),
         "colour 4 of group 7 is missing"),
        (model(box()).replace("<build>", "<!--" + " " * 2_000_000 + "--><build>"), "unpacks to"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(tmp_path, text, words):
    with pytest.raises(PartError, match=r"part\.3mf") as refused:
        read_3mf(written(tmp_path, text))
    assert words in str(refused.value)


def test_packages_without_one_model_are_refused(tmp_path):
    with pytest.raises(PartError, match="names 0 models"):
        read_3mf(written(tmp_path, model(box()), rels="<a/>"))
    path = written(tmp_path, model(box()), rels=RELS.replace("/3D/", "/../../3D/"))
    with pytest.raises(PartError, match=r"_rels/\.rels leads out of the package \('/\.\./"):
        read_3mf(path)


def test_all_models_together_keep_to_the_limit_of_memory(tmp_path, monkeypatch):
    part = model(box(), "", attributes=f'unit="inch" xmlns:p="{PRODUCTION}"')
    inner = "".join(f'<component objectid="1" p:path="/{k}.model"/>' for k in range(6))
    path = written(
        tmp_path,
        model(
            f'<object id="1"><components>{inner}</components></object>',
            attributes=f'unit="inch" xmlns:p="{PRODUCTION}"',
        ),
    )
    with zipfile.ZipFile(path, "a") as archive:
        rows = "".join(
            f'<Relationship Target="/{k}.model" Id="r{k}" Type="{ROOT}"/>' for k in range(6)
        )
        uri = "http://schemas.openxmlformats.org/package/2006/relationships"
        archive.writestr("3D/_rels/3dmodel.model.rels", f'<a xmlns="{uri}">{rows}</a>')
        for k in range(6):
            archive.writestr(f"{k}.model", part)
    assert len(read_3mf(path).corners) == 6 * 12
    monkeypatch.setattr(_threemf_package, "MOST_BYTES", 5 * len(part))
    with pytest.raises(PartError, match=r"[34]\.model unpacks to more than .* for all parts"):
        read_3mf(path)


def test_every_cut_and_flipped_byte_is_read_or_refused_by_name(tmp_path):
    data = written(tmp_path, model(box())).read_bytes()
    rng = np.random.default_rng(20261123)
    path = tmp_path / "part.3mf"
    changed = [data[: int(k)] for k in rng.integers(0, len(data), 60)]
    for at in rng.integers(0, len(data), 200).tolist():
        changed.append(data[:at] + bytes([data[at] ^ int(rng.integers(1, 256))]) + data[at + 1 :])
    refused = 0
    for text in changed:
        path.write_bytes(text)
        try:
            raw = read_3mf(path)
        except PartError:
            refused += 1
        else:
            np.testing.assert_array_equal(raw.corners, corner_points(BOX))
    assert refused > 150
