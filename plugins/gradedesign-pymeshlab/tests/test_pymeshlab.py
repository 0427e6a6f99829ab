"""Repair by MeshLab through the command line and through the part of a case."""

import importlib.util
import json
import struct

import numpy as np
import pytest

import gradedesign_pymeshlab
from gradedesign import PartError
from gradedesign.design.case.read_case import load_case
from gradedesign.design.resolve.fitting_part import part_of
from gradedesign.design.resolve.part_repairer import part_repairer
from gradedesign.geometry.formats.read_stl import read_stl
from gradedesign.geometry.part.repair import build_surface
from gradedesign.program.commands import main
from gradedesign.program.host.registry import build_registry

manifold3d = pytest.importorskip("manifold3d")
REGISTRY = build_registry(plugins=[gradedesign_pymeshlab])

needs_meshlab = pytest.mark.skipif(
    importlib.util.find_spec("pymeshlab") is None, reason="pymeshlab is not installed"
)


CASE = """\
[case]
name = "mended"
[part]
file = "part.stl"
units = "mm"
mesh_size = "8 mm"
repair = "pymeshlab"
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[material]
name = "PA12"
[[load_case]]
name = "push"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-1 N"]}]
[limits]
displacement = [{region = "tip", magnitude = "9 mm"}]
[lattice]
cell = "gyroid-sheet"
size = "20 mm"
density = [0.2, 0.5]
"""


def corners_of(solid):
    """Corners of the triangles of a solid."""
    mesh = solid.to_mesh64()
    return np.array(mesh.vert_properties)[:, :3][np.array(mesh.tri_verts).astype(int)]


CUBE = corners_of(manifold3d.Manifold.cube((20, 20, 20)))


def ball(segments=48):
    """Corners of a ball of 10 mm."""
    return corners_of(manifold3d.Manifold.sphere(10, segments))


def binary(corners):
    """A binary STL file."""
    records = np.zeros(len(corners), dtype=[("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")])
    records["c"] = corners
    return bytes(80) + struct.pack("<I", len(corners)) + records.tobytes()


def volume_of(corners):
    a, b, c = np.moveaxis(corners, 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def read(folder, corners, options=""):
    """The part of a case with these triangles."""
    (folder / "part.stl").write_bytes(binary(corners))
    (folder / "case.toml").write_text(
        '[case]\nname = "mended"\n[part]\nfile = "part.stl"\nunits = "mm"\nrepair = "pymeshlab"\n'
        f'repair_options = {{{options}}}\n[lattice]\ncell = "walls"\nsize = "8 mm"\ndensity = 0.3\n'
    )
    case = load_case(folder / "case.toml")
    mend = part_repairer(case.part, case.run, REGISTRY, case.where)
    return part_of(case, {".stl": read_stl}, mend)


@needs_meshlab
def test_a_hole_that_auto_refuses_is_filled_and_told(tmp_path):
    """A square of 6.7 mm in the middle of a side of a cube: closed flat, 8000 mm^3."""
    corners = corners_of(manifold3d.Manifold.cube((20, 20, 20)).refine(6))
    side = (corners[:, :, 2] == 20.0).all(axis=1)
    side &= ((corners[:, :, :2] > 6.0) & (corners[:, :, :2] < 14.0)).all(axis=(1, 2))
    with pytest.raises(PartError, match="too large to fill"):
        build_surface(corners[~side], repair="auto")
    part = read(tmp_path, corners[~side])
    assert part.volume == pytest.approx(8000.0, rel=1e-6)
    assert part.report.changes["holes_filled"] == 1
    assert part.report.changes["facets_added_in_holes"] >= 6
    (note,) = (w for w in part.report.warnings if "1 holes filled" in w)
    assert "compare it with CAD" in note


@needs_meshlab
def test_holes_above_the_size_stated_are_left_and_refused(tmp_path):
    corners = ball()
    with pytest.raises(PartError, match=r"'pymeshlab' leaves 1 holes: \d+ edges"):
        read(tmp_path, corners[corners[:, :, 2].mean(axis=1) < 9.0], "hole_edges = 8")


@needs_meshlab
def test_isotropic_remeshing_keeps_the_volume_and_evens_the_edges(tmp_path):
    part = read(tmp_path, CUBE, 'edge_length = "2 mm"')
    assert part.volume == pytest.approx(8000.0, rel=1e-3)
    corners = part.surface.vertices[part.surface.faces]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    assert 1.0 < np.percentile(edges, 5) < np.percentile(edges, 95) < 3.0
    assert part.report.changes["triangles_after_remeshing"] == len(corners)


@needs_meshlab
def test_decimation_keeps_the_volume_within_one_per_cent_or_is_refused(tmp_path):
    corners = ball(96)
    part = read(tmp_path, corners, "triangles = 1500")
    assert part.report.changes["triangles_after_decimation"] == len(part.surface.faces) <= 1500
    assert part.volume == pytest.approx(volume_of(corners), rel=0.01)
    assert any("lie up to" in w for w in part.report.warnings)
    with pytest.raises(PartError, match="changes the volume"):
        read(tmp_path, corners, "triangles = 20")


@needs_meshlab
@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("triangles = 2", "triangles is 2"),
    ],
)
def test_wrong_options_are_named(tmp_path, options, words):
    with pytest.raises(PartError, match=words):
        read(tmp_path, CUBE, options)


@needs_meshlab
def test_check_counts_the_changes_of_the_repairer_that_the_case_names(tmp_path, capsys):
    (tmp_path / "part.stl").write_bytes(binary(CUBE[1:]))
    (tmp_path / "case.toml").write_text(CASE)
    with pytest.raises(SystemExit) as ended:
        main(["check", str(tmp_path), "--no-picture", "--json"])
    printed = capsys.readouterr()
    assert ended.value.code in (0, None), printed.err
    checked = json.loads(printed.out)
    assert checked["part"]["volume_mm3"] == pytest.approx(8000.0, rel=1e-6)
    assert checked["part"]["repairs"] == {"holes_filled": 1, "facets_added_in_holes": 1}
    assert any("mended by 'pymeshlab'" in w for w in checked["warnings"])


def test_the_repairer_is_registered():
    assert list(REGISTRY.repairers) == ["pymeshlab"]
