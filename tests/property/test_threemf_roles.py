"""3MF files with roles, as slicers write them: the known volume and names, or a refusal."""

import numpy as np
import pytest
from threemf_variants import role_variants

from gradedesign.errors import PartError
from gradedesign.mesh.surface_mesh import enclosed_volume
from gradedesign.part.raw_triangles import in_mm
from gradedesign.part.repair import build_surface
from gradedesign.part.threemf import read_3mf

VARIANTS = role_variants()
#: Planes are exact in binary; turned, coordinates keep 15 digits, and welding moves them by 1e-6
#: of the diagonal at most where they are that close to each other.
TOLERANCE = 1e-9


def read(path):
    raw = read_3mf(path)
    surface, report = build_surface(in_mm(raw, raw.unit, path.name).corners, source=path.name)
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
    raw, surface, _ = read(path)
    assert enclosed_volume(surface) == pytest.approx(variant.volume, rel=TOLERANCE)
    np.testing.assert_allclose(np.ptp(surface.vertices, axis=0), variant.size, rtol=1e-9)
    assert [(body.name, body.role) for body in raw.file_bodies] == list(variant.left)
    for name, role in variant.left:
        assert f"'{name}' ({role})" in " ".join(raw.warnings)


def test_the_generator_has_every_role_and_enough_files():
    left = {role for variant in VARIANTS for _, role in variant.left}
    assert len(left) == 4 + 4 + 5  # of PrusaSlicer and Bambu, of Cura, of the core specification
    assert len(VARIANTS) >= 100
    assert sum(variant.volume is None for variant in VARIANTS) >= 30
