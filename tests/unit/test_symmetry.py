"""Planes of symmetry: a half stands for the whole, and what has no mirror image is refused."""

import json

import manifold3d
import numpy as np
import pytest
from small_parts import box_part

from gradedesign.geometry.formats.write_stl import write_stl
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

REST = """
[material]
name = "Ti-6Al-4V"
[[load_case]]
name = "down"
fix = [{region = "root"}, {region = "cut", symmetry = true}]
load = [{region = "tip", force = ["0 N", "0 N", "-50 N"]}]
[limits]
safety_factor = 2
displacement = [{region = "tip", magnitude = "1 mm"}]
[lattice]
cell = "gyroid-sheet"
size = "5 mm"
density = [0.2, 0.6]
[run]
stop_after = "solid"
[output]
formats = ["report"]
"""
REGIONS = """
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[region.cut]
plane = "y = min"
"""
HALF = "[case]\nname = 'half'\n[part]\n" + box_part(40, 10, 10, 5) + REGIONS + REST


@pytest.fixture
def folder(tmp_path):
    def write(*swaps, name="case.toml", text=HALF):
        for old, new in swaps:
            assert old in text, old
            text = text.replace(old, new)
        (tmp_path / name).write_text(text, encoding="utf-8")
        return tmp_path / name

    return write


def test_the_whole_part_is_told_beside_the_half(cli, folder, tmp_path):
    data = json.loads(cli("check", folder(), "--json", "--no-picture").out)
    # 40 x 10 x 10 mm^3 at 4.41 g/cm^3, twice.
    assert data["symmetry"]["planes"] == ["cut (y = 0 mm)"]
    assert data["symmetry"]["copies"] == 2
    assert data["symmetry"]["solid_mass_g"] == pytest.approx(2 * 17.64, rel=0.01)
    assert data["unjudged_stress"]["around"] == "1.25 mm of root"
    ended = cli("run", folder(), "-o", tmp_path / "out")
    assert "the whole part is 2 times this one" in " ".join(ended.out.split())
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Mirrored on cut (y = 0 mm)" in report
    assert json.loads((tmp_path / "out" / "result.json").read_text())["symmetry"]["copies"] == 2


@pytest.mark.parametrize(
    ("cell", "mirrors"),
    [("bcc", True), ("gyroid-sheet", False)],
)
def test_cells_that_do_not_mirror_are_told(cli, folder, cell, mirrors):
    """A plane through the corners of cubic cells mirrors bcc struts; a gyroid has no mirrors."""
    told = cli("check", folder(('"gyroid-sheet"', f'"{cell}"')), "--no-picture").out
    assert ("the cells do not mirror" in " ".join(told.split())) != mirrors


def test_a_skin_on_the_plane_is_told(cli, folder):
    told = cli("check", folder(("density =", 'skin = {thickness = "1 mm"}\ndensity =')),
               "--no-picture").out  # fmt: skip
    assert "skin closes the plane of symmetry" in " ".join(told.split())
    faces = 'skin = {thickness = "1 mm", faces = ["tip"]}\ndensity ='
    told = cli("check", folder(("density =", faces)), "--no-picture").out
    assert "skin closes the plane" not in " ".join(told.split())


SECOND = """
[[load_case]]
name = "side"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "50 N", "0 N"]}]
[limits]
"""


@pytest.mark.parametrize(
    ("swap", "words"),
    [
        (("symmetry = true", 'symmetry = true, components = "y"'), "expected it alone"),
        (("symmetry = true", 'symmetry = "y"'), "expected true or false"),
        (
            ("[limits]\n", SECOND.lstrip()),
            "load case 'side' does not hold region 'cut' by symmetry",
        ),
        (
            ("load = [", 'acceleration = ["0 m/s^2", "9.81 m/s^2", "0 m/s^2"]\nload = ['),
            "9.81 m/s^2 across the plane of symmetry cut (y = 0 mm)",
        ),
        (('load = [{region = "tip"', 'load = [{region = "cut"'), "the whole part has no face"),
        (
            ("symmetry = true}]", 'symmetry = true}, {region = "far", symmetry = true}]'),
            "would repeat without end",
        ),
        (
            (
                'plane = "y = min"\n',
                'plane = "y = min"\nclip = true\nbox = {lower = ["-1 mm", "-1 mm", "-1 mm"], '
                'upper = ["30 mm", "1 mm", "11 mm"]}\n',
            ),
            "covers 300 of the 400 mm^2",
        ),
    ],
)
def test_what_has_no_mirror_image_is_refused(cli, folder, swap, words):
    far = ("[material]", '[region.far]\nplane = "y = max"\n[material]')
    ended = cli("check", folder(far, swap), "--no-picture")
    assert ended.code == 2
    assert words in " ".join(ended.err.split())


def written(solid, path):
    """A manifold as an STL file."""
    mesh = solid.to_mesh()
    surface = SurfaceMesh(
        vertices=np.asarray(mesh.vert_properties, float)[:, :3], faces=np.asarray(mesh.tri_verts)
    )
    write_stl(path, surface)


@pytest.fixture
def plates(tmp_path):
    """A plate of 60 x 30 x 6 mm with a hole of 12 mm, and a slanted face beside a quarter of it."""
    hole = manifold3d.Manifold.cylinder(6.0, 6.0, circular_segments=32)
    whole = manifold3d.Manifold.cube([60, 30, 6]).translate([-30, -15, 0]) - hole
    written(whole, tmp_path / "whole.stl")
    written(whole ^ manifold3d.Manifold.cube([40, 20, 6]), tmp_path / "quarter.stl")
    wedge = manifold3d.Manifold.cube([60, 30, 6]).rotate([0, 0, 10])
    written(wedge, tmp_path / "wedge.stl")


PLATE = (
    '[case]\nname = \'plate\'\n[part]\nfile = "whole.stl"\nunits = "mm"\nmesh_size = "2.5 mm"\n'
    '[region.hole]\ncylinder = {diameter = "12 mm"}\n[region.ends]\nany = ["low", "high"]\n'
    '[region.low]\nplane = "x = min"\n[region.high]\nplane = "x = max"\n'
    '[region.cut]\nplane = "y = min"\n'
    + REST.replace(
        'fix = [{region = "root"}, {region = "cut", symmetry = true}]', 'fix = [{region = "ends"}]'
    )
    .replace(
        'region = "tip", force = ["0 N", "0 N", "-50 N"]', 'region = "hole", pressure = "50 MPa"'
    )
    .replace('"tip"', '"hole"')
)


@pytest.mark.usefixtures("plates")
def test_a_quarter_of_a_plate_reads_as_the_whole(cli, folder, tmp_path):
    """Pressed in its hole and held at its ends: stress, displacement and mass of the whole."""
    quarter = (
        ("whole.stl", "quarter.stl"),
        (
            'fix = [{region = "ends"}]',
            'fix = [{region = "high"}, {region = "low", symmetry = true}, '
            '{region = "cut", symmetry = true}]',
        ),
    )
    results = []
    for name, swaps in (("whole", ()), ("quarter", quarter)):
        ended = cli("run", folder(*swaps, text=PLATE), "-o", tmp_path / name)
        assert ended.code == 0, ended.err
        results.append(json.loads((tmp_path / name / "result.json").read_text(encoding="utf-8")))
    whole, part = results
    used = [{row["key"]["kind"]: row["utilisation"] for row in r["limits"]} for r in results]
    assert used[1]["stress"] == pytest.approx(used[0]["stress"], rel=0.01)
    assert used[1]["displacement"] == pytest.approx(used[0]["displacement"], rel=0.01)
    assert part["symmetry"]["copies"] == 4
    assert part["symmetry"]["solid_mass_g"] == pytest.approx(whole["solid_mass_g"], rel=0.005)


@pytest.mark.usefixtures("plates")
def test_a_face_off_the_axes_is_no_plane_of_symmetry(cli, folder):
    swaps = (
        ("whole.stl", "wedge.stl"),
        ('[region.hole]\ncylinder = {diameter = "12 mm"}', '[region.hole]\nplane = "z = max"'),
        ('plane = "x = min"', 'nearest = ["-2.6 mm", "14.8 mm", "3 mm"]'),
        ('plane = "x = max"', 'nearest = ["56 mm", "25 mm", "3 mm"]'),
        ('plane = "y = min"', 'nearest = ["30 mm", "5.2 mm", "3 mm"]'),
        (
            'fix = [{region = "ends"}]',
            'fix = [{region = "high"}, {region = "low", symmetry = true}]',
        ),
    )
    ended = cli("check", folder(*swaps, text=PLATE), "--no-picture")
    assert ended.code == 2
    assert "region 'low' is no plane across x, y or z" in " ".join(ended.err.split())
