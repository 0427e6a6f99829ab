"""Thousands of altered STL and 3MF files: the volume that they hold, or an error by name.

The seeds are fixed. A sample runs with every test, all of them where ``-m slow`` asks. Cases
are altered in ``tests/unit/test_fuzz.py``.
"""

from __future__ import annotations

import io
import random
import zipfile
from xml.etree import ElementTree

import numpy as np
import pytest
from altered_files import altered_bytes
from damaged_shapes import binary, box, corners_of, cube, rod, text

from gradedesign.errors import PartError
from gradedesign.geometry.formats.read_stl import read_stl
from gradedesign.geometry.part.raw_triangles import in_mm
from gradedesign.geometry.part.repair import build_surface
from gradedesign.geometry.triangles.surface_mesh import enclosed_volume, open_edge_count
from gradedesign_formats.read_3mf import read_3mf

#: Files of one test, tests of each format, and those of them that run with every test.
ROUND, ROUNDS, ALWAYS = 50, 70, 1
#: A volume this far off is wrong.
TOLERANCE = 0.01

HOLLOW = np.concatenate([box((0, 0, 0), (10, 20, 30)), box((3, 6, 9), (8, 16, 24), reverse=True)])
DRILLED = corners_of(cube(30, 20, 6) - rod(20, 4, 24).translate((10, 9, -5)))
#: Corners and volumes, mm^3: 6000 less the void of 750; the drilled plate by the kernel's mesh.
SOLIDS = {
    "hollow": (HOLLOW, 6000.0 - 750.0),
    "drilled": (DRILLED, 3600.0 - 6.0 * 0.5 * 24 * 16 * np.sin(2 * np.pi / 24)),
}

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
RELATIONS = (
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="r" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)


def model(corners) -> bytes:
    """XML of a 3MF model with one object of two colours, placed and turned."""
    points, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    vertices = "".join(f'<vertex x="{x:.9g}" y="{y:.9g}" z="{z:.9g}"/>\n' for x, y, z in points)
    triangles = "".join(
        f'<triangle v1="{a}" v2="{b}" v3="{c}" pid="5" p1="{a % 2}"/>\n'
        for a, b, c in index.reshape(-1, 3)
    )
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<model unit="millimeter" xmlns="{CORE}">\n'
        '<resources><basematerials id="5"><base name="a" displaycolor="#FF0000"/>'
        '<base name="b" displaycolor="#00FF00"/></basematerials>\n'
        '<object id="1" type="model" name="part" pid="5" pindex="0"><mesh>\n'
        f"<vertices>{vertices}</vertices>\n<triangles>{triangles}</triangles>\n"
        '</mesh></object>\n<object id="2"><components>'
        '<component objectid="1" transform="0 1 0 -1 0 0 0 0 1 5 0 2"/></components></object>'
        '</resources>\n<build><item objectid="2"/></build></model>\n'
    ).encode()


def package(content: bytes, method: int = zipfile.ZIP_STORED) -> bytes:
    """A 3MF file around a model; stored, so that bytes of it can be altered."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as archive:
        archive.writestr("_rels/.rels", RELATIONS)
        archive.writestr("3D/3dmodel.model", content)
    return file.getvalue()


UNITS = {"micron": 1e-3, "millimeter": 1.0, "centimeter": 10.0, "inch": 25.4, "foot": 304.8}


def stated_volume(content: bytes) -> float:
    """Volume by the numbers of an altered model with one mesh, mm^3: the oracle."""
    root = ElementTree.fromstring(content)
    factor = UNITS.get(root.get("unit", "millimeter"), 1000.0) ** 3
    total, objects = 0.0, {o.get("id"): o for o in root.iter(f"{{{CORE}}}object")}

    def added(number, scale):
        nonlocal total
        found = objects[number]
        points = [[float(v.get(k)) for k in "xyz"] for v in found.iter(f"{{{CORE}}}vertex")]
        for t in found.iter(f"{{{CORE}}}triangle"):
            a, b, c = (points[int(t.get(k))] for k in ("v1", "v2", "v3"))
            total += scale * float(np.dot(a, np.cross(b, c))) / 6.0
        for part in found.iter(f"{{{CORE}}}component"):
            added(part.get("objectid"), scale * determinant(part))

    def determinant(element):
        numbers = element.get("transform", "1 0 0 0 1 0 0 0 1 0 0 0").split()
        return abs(np.linalg.det(np.array(numbers[:9], dtype=float).reshape(3, 3)))

    for item in root.iter(f"{{{CORE}}}item"):
        added(item.get("objectid"), determinant(item))
    return abs(total) * factor


def answer(path, read):
    """Volume of a file as a case reads it, or None where it is refused."""
    try:
        raw = read(path)
        raw = in_mm(raw, raw.unit or "mm", path.name)
        surface, report = build_surface(raw.corners, repair="auto", bodies="all", source=path.name)
    except PartError as error:
        assert path.name in str(error)  # noqa: PT017 - both outcomes are right
        return None
    assert report.touching_edges or open_edge_count(surface) == 0
    return enclosed_volume(surface)


def rounds():
    """Numbers of rounds; the first run with every test."""
    return [pytest.param(n, marks=[pytest.mark.slow] if n >= ALWAYS else []) for n in range(ROUNDS)]


@pytest.mark.parametrize("number", rounds())
def test_altered_stl_files(tmp_path, number):
    rng = random.Random(3000 + number)
    files = [
        (data, volume) for c, volume in SOLIDS.values() for data in (binary(c), text(c).encode())
    ]
    others = [content for content, _ in files]
    for n in range(ROUND):
        whole, volume = rng.choice(files)
        content = altered_bytes(rng, whole, others)
        path = tmp_path / "part.stl"
        path.write_bytes(content)
        try:
            found = answer(path, read_stl)
            # The tail of another file is that file.
            right = [volume, *(v for c, v in files if content == c)]
            assert found is None or np.isclose(found, right, rtol=TOLERANCE).any(), (found, right)
        except Exception as error:
            error.add_note(f"round {number}, file {n}: {content!r}")
            raise


@pytest.mark.parametrize("number", rounds())
def test_altered_3mf_files(tmp_path, number):
    rng = random.Random(4000 + number)
    models = [model(c) for c, _ in SOLIDS.values()]
    wholes = [package(m, method) for m in models for method in (0, zipfile.ZIP_DEFLATED)]
    for n in range(ROUND):
        path = tmp_path / "part.3mf"
        inside = rng.random() < 0.7
        if inside:  # what a zip archive's checksum would not let pass
            content = altered_bytes(rng, rng.choice(models), models)
            path.write_bytes(package(content))
        else:
            content = altered_bytes(rng, rng.choice(wholes), wholes)
            path.write_bytes(content)
        try:
            found = answer(path, read_3mf)
            if found is None:
                continue
            # Turned or doubled triangles are mended, which the sum of the oracle is not.
            right = [v for _, v in SOLIDS.values()]
            right += [stated_volume(content)] if inside else []
            assert np.isclose(found, right, rtol=TOLERANCE).any(), (found, right)
        except Exception as error:
            error.add_note(f"round {number}, file {n}: {content!r}")
            raise
