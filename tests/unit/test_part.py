"""The part of a case: from a box or a file, with its regions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import manifold3d
import numpy as np
import pytest

from gradedesign.common.values.locate import Where
from gradedesign.errors import CaseError, PartError
from gradedesign.geometry.formats.read_stl import read_stl
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.part import read_part
from gradedesign.geometry.part.part_schema import PartSpec
from gradedesign.geometry.part.regions_schema import RegionSpec
from gradedesign.geometry.triangles.surface_mesh import corner_points

READERS = {".stl": read_stl}
BOX = corner_points(box_surface((10.0, 20.0, 30.0)))


def write_stl(path: Path, corners) -> Path:
    records = np.zeros(len(corners), dtype=[("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")])
    records["c"] = corners
    count = np.array(len(corners), dtype="<u4").tobytes()
    path.write_bytes(b"solid".ljust(80) + count + records.tobytes())
    return path


def case(folder: Path, part: dict, **regions):
    spec = PartSpec.model_validate({"mesh_size": "5 mm", **part}, context={"folder": folder})
    models = {name: RegionSpec.model_validate(value) for name, value in regions.items()}
    return spec, models


def part_of(stated, readers):
    return read_part(*stated, readers, Where(file="case.toml"))


def test_box_part(tmp_path):
    part = part_of(
        case(tmp_path, {"box": ["1500 mm", "300 mm", "200 mm"]}, root={"plane": "x = min"}), {}
    )
    assert part.source == "box"
    assert part.volume == pytest.approx(1500.0 * 300.0 * 200.0)
    assert part.diagonal == pytest.approx(np.sqrt(1500.0**2 + 300.0**2 + 200.0**2))
    assert part.regions["root"].area == pytest.approx(300.0 * 200.0)
    assert part.report.warnings == ()


def test_file_part_in_inches(tmp_path):
    write_stl(tmp_path / "block.STL", BOX)
    asked = case(
        tmp_path,
        {"file": "block.STL", "units": "inch"},
        top={"plane": "z = max"},
        side={"facing": "+x"},
    )
    part = part_of(asked, READERS)
    assert part.source == "block.STL"
    assert part.volume == pytest.approx(6000.0 * 25.4**3)
    assert list(part.regions) == ["top", "side"]
    assert part.regions["top"].centroid[2] == pytest.approx(30 * 25.4)


def test_warnings_of_reading_and_of_repair_are_collected(tmp_path):
    path = write_stl(tmp_path / "block.stl", np.concatenate([BOX, BOX[:1]]))
    path.write_bytes(path.read_bytes() + b"  ")
    part = part_of(case(tmp_path, {"file": "block.stl", "units": "mm"}), READERS)
    assert [w.split(":")[0] for w in part.report.warnings] == ["block.stl"] * 2
    assert "trailing" in part.report.warnings[0]
    assert "duplicate" in part.report.warnings[1]


def test_a_face_that_curves_away_is_told(tmp_path):
    # Half a round bar: of its curved face 60 of 180 degrees are turned by more than 60 degrees
    # away from +z, which its mean normal faces.
    bar = manifold3d.Manifold.cylinder(30.0, 10.0, 10.0, 180).trim_by_plane([0.0, 1.0, 0.0], 0.0)
    mesh = bar.to_mesh64()
    corners = np.asarray(mesh.vert_properties)[:, :3][np.asarray(mesh.tri_verts).astype(int)]
    file = write_stl(tmp_path / "bar.stl", corners)
    chosen = case(
        tmp_path, {"file": file.name, "units": "mm"}, top={"facing": "+y"}, flat={"facing": "-y"}
    )
    warnings = part_of(chosen, {".stl": read_stl}).report.warnings
    assert len(warnings) == 1
    assert warnings[0].startswith("region.top: 33 % of its 942.4 mm^2 is turned more than 60 deg")


def test_options_of_repair_reach_it(tmp_path):
    outer = BOX[0]
    inner = 0.05 * outer + 0.95 * outer.mean(
        axis=0
    )  # a small facet, missing from a frame around it
    frame = [[outer[k - 1], outer[k], inner[k]] for k in range(3)]
    frame += [[outer[k - 1], inner[k], inner[k - 1]] for k in range(3)]
    write_stl(tmp_path / "open.stl", np.concatenate([BOX[1:], np.array(frame)]))
    with pytest.raises(PartError, match=r"open\.stl: the surface is open"):
        part_of(case(tmp_path, {"file": "open.stl", "units": "mm"}), READERS)
    part = part_of(case(tmp_path, {"file": "open.stl", "units": "mm", "repair": "auto"}), READERS)
    assert part.volume == pytest.approx(6000.0)
    write_stl(tmp_path / "two.stl", np.concatenate([BOX, BOX + 50]))
    with pytest.raises(PartError, match="separate solids"):
        part_of(case(tmp_path, {"file": "two.stl", "units": "mm"}), READERS)
    part = part_of(case(tmp_path, {"file": "two.stl", "units": "mm", "bodies": "all"}), READERS)
    assert part.volume == pytest.approx(12000.0)


def test_no_reader(tmp_path):
    write_stl(tmp_path / "block.stl", BOX)
    with pytest.raises(CaseError, match=r"readable: \.obj, \.ply"):
        part_of(case(tmp_path, {"file": "block.stl", "units": "mm"}), {".ply": None, ".obj": None})


def test_row_27_missing_unit(tmp_path):
    write_stl(tmp_path / "block.stl", BOX)
    with pytest.raises(CaseError, match=r"part\.units: missing; block\.stl carries no unit"):
        part_of(case(tmp_path, {"file": "block.stl"}), READERS)


def test_a_unit_of_the_file_is_used_and_one_of_the_case_overrules_it_aloud(tmp_path):
    write_stl(tmp_path / "block.stl", BOX)

    def in_metres(path):
        return replace(read_stl(path), unit="m")

    part = part_of(case(tmp_path, {"file": "block.stl"}), {".stl": in_metres})
    assert (part.volume, part.units) == (pytest.approx(6000.0e9), "m")
    assert "metres" not in str(part.report.warnings)
    part = part_of(case(tmp_path, {"file": "block.stl", "units": "mm"}), {".stl": in_metres})
    assert (part.volume, part.units) == (pytest.approx(6000.0), "mm")
    assert "read in mm as part.units says, though its unit is m" in part.report.warnings[0]
