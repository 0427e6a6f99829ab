"""3MF files with roles, as slicers write them: the known volume and names, or a refusal."""

import io
import random
import re
import zipfile

import numpy as np
import pytest
from threemf_variants import role_variants

from gradedesign.errors import PartError
from gradedesign.geometry.part.raw_triangles import in_mm
from gradedesign.geometry.part.repair import build_surface
from gradedesign.geometry.triangles.surface_mesh import enclosed_volume
from gradedesign_formats.read_3mf import read_3mf

VARIANTS = role_variants()
#: Faces that are flush are moved by 1e-6 of the diagonal and welded at twice that; some files
#: have seven digits, half of the last of which is 5e-7 of its diagonal.
TOLERANCE = 1e-5


def read(path, bodies="one"):
    raw = read_3mf(path)
    corners = in_mm(raw, raw.unit, path.name).corners
    surface, report = build_surface(corners, bodies=bodies, source=path.name)
    return raw, surface, report


@pytest.mark.parametrize("variant", VARIANTS, ids=[v.name for v in VARIANTS])
def test_every_file_is_right_or_refused_by_name(tmp_path, variant):
    path = tmp_path / "part.3mf"
    path.write_bytes(variant.data)
    if variant.volume is None:
        with pytest.raises(PartError, match=r"^part\.3mf") as refused:
            read(path)
        for words in variant.words:
            assert words in str(refused.value)
        return
    raw, surface, report = read(path)
    assert enclosed_volume(surface) == pytest.approx(variant.volume, rel=TOLERANCE)
    size = np.ptp(surface.vertices, axis=0)
    np.testing.assert_allclose(size, variant.size, rtol=TOLERANCE)
    # A closed surface of F triangles has 3 F / 2 edges.
    assert len(surface.vertices) - len(surface.faces) // 2 == variant.euler
    assert not report.changes.keys() - {"shells_united", "shells_ignored"}
    assert [(body.name, body.role) for body in raw.file_bodies] == list(variant.left)
    for name, role in variant.left:
        assert f"'{name}' ({role})" in " ".join(raw.warnings)


def test_metadata_altered_by_chance_is_read_right_refused_or_said(tmp_path):
    rng = random.Random(20261128)
    wholes = [v for v in VARIANTS if v.volume and v.name.startswith(("PrusaSlicer", "Bambu"))]
    path, entries = tmp_path / "part.3mf", {v.name: unpacked(v.data) for v in wholes}
    read_right = 0
    for variant in rng.choices(wholes, k=150):
        content = dict(entries[variant.name])
        (name,) = (entry for entry in content if entry.startswith("Metadata"))
        text = content[name].decode()
        words = re.findall(r"\w+", text)
        old, new = rng.sample(words, 2)
        content[name] = re.sub(rf"\b{old}\b", new, text, count=rng.choice([0, 1])).encode()
        with zipfile.ZipFile(path, "w") as archive:
            for entry, data in content.items():
                archive.writestr(entry, data)
        try:
            raw, surface, _ = read(path, bodies="all")
        except PartError as error:
            assert path.name in str(error)  # noqa: PT017 - all three outcomes are right
            continue
        same = enclosed_volume(surface) == pytest.approx(variant.volume, rel=TOLERANCE)
        assert same or raw.warnings, content[name]
        read_right += same
    assert read_right > 10


def unpacked(data):
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def test_the_generator_has_every_role_and_enough_files():
    left = {role for variant in VARIANTS for _, role in variant.left}
    assert len(left) == 4 + 4 + 5  # of PrusaSlicer and Bambu, of Cura, of the core specification
    assert len(VARIANTS) >= 100
    assert sum(variant.volume is None for variant in VARIANTS) >= 30
