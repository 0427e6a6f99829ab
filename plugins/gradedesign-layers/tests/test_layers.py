"""Layers of generated lattices as CLI and PNG: areas, directions, islands, turned parts."""

import dataclasses
import io
import json
import zipfile

import matplotlib.image
import numpy as np
import pytest
import trimesh

from gradedesign.geometry.formats.printed_lattice import PrintedLattice
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles.surface_mesh import enclosed_volume
from gradedesign_layers import layers
from gradedesign_layers.cli_layers import export_cli, export_cli_binary, read_cli
from gradedesign_layers.contours import signed_area
from gradedesign_layers.layers import slice_lattice
from gradedesign_layers.png_stack import export_png_stack

CASE = """\
[case]
name = "a & b < c"
[part]
box = ["10 mm", "5 mm", "5 mm"]
[lattice]
cell = "gyroid-sheet"
size = "5 mm"
density = 0.4
[print]
min_wall = "0.1 mm"
layer_height = "0.1 mm"
pixel_size = "0.125 mm"
build_direction = "{direction}"
overhang_angle = "40 deg"
build_volume = ["10 mm", "5 mm", "10 mm"]
[output]
formats = ["cli", "cli-binary", "png-stack"]
"""


@pytest.mark.parametrize("direction", ["+z", "-x"])
def test_layers_of_a_generated_lattice(cli, tmp_path, direction):
    (tmp_path / "case.toml").write_text(CASE.format(direction=direction), encoding="utf-8")
    ended = cli("run", tmp_path, "-o", tmp_path / "out")
    assert ended.code == 0, ended.err
    out = tmp_path / "out"
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    assert result["files"]["lattice_cli"] == "lattice.cli"
    assert result["files"]["lattice_png-stack"] == "lattice.zip"
    printed = result["measures"]["printability"]
    assert printed["build_direction"] == direction
    overhang = printed["overhang"]
    assert (
        0 <= overhang["least_fraction"] <= overhang["fraction"] <= overhang["most_fraction"] < 0.3
    )
    assert overhang["support_volume_mm3"] > 0
    volume = result["measures"]["volume_mm3"]
    count, wide, deep = (50, 80, 40) if direction == "+z" else (100, 40, 40)
    text, binary = (
        list(read_cli(out / name)) for name in ("lattice.cli", "lattice-cli-binary.cli")
    )
    assert b"$$LABEL/1,a & b < c\n" in (out / "lattice.cli").read_bytes()
    assert len(text) == len(binary) == count + 1
    assert text[0][1] == []
    np.testing.assert_allclose(np.diff([top for top, _ in text]), 0.1, atol=2e-6)
    held = sum(signed_area(p[:-1]) * 0.1 for _, lines in text for _, p in lines)
    assert held == pytest.approx(volume, rel=0.01)
    for (_, one), (_, other) in zip(text, binary, strict=True):
        assert [d for d, _ in one] == [d for d, _ in other]
        for (_, p), (_, q) in zip(one, other, strict=True):
            np.testing.assert_allclose(p, q, atol=2e-6)
            assert (p[0] == p[-1]).all()
    points = np.concatenate([p for _, lines in text for _, p in lines])
    if direction == "+z":
        np.testing.assert_allclose(points.min(axis=0), [0, 0], atol=1e-5)
        np.testing.assert_allclose(points.max(axis=0), [10, 5], atol=1e-5)
    with zipfile.ZipFile(out / "lattice.zip") as stack:
        index = json.loads(stack.read("stack.json"))
        assert (index["name"], len(index["layers"])) == ("a & b < c", count)
        assert index["pixels"] == [wide + 2, deep + 2]
        images = [matplotlib.image.imread(io.BytesIO(stack.read(n))) for n in index["layers"]]
    assert images[0].shape == (deep + 2, wide + 2)
    pixels = sum(int((image > 0.5).sum()) for image in images)
    assert pixels * 0.125**2 * 0.1 == pytest.approx(volume, rel=0.01)


def test_a_part_that_its_printer_cannot_hold_is_refused_with_directions(cli, tmp_path):
    text = CASE.format(direction="+y")
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    ended = cli("run", tmp_path, "-o", tmp_path / "out")
    # Built towards y, its z lies along x, its x along y: 5 x 10 x 5 mm.
    assert ended.code == 2
    told = " ".join(ended.err.split())
    assert "print.build_volume: found a part of 5 x 10 x 5 mm, built towards +y" in told
    assert "take build_direction +z, -z" in told


ALONE = """\
[case]
name = "layers alone"
[part]
box = ["6 mm", "5 mm", "4 mm"]
[material]
name = "Ti-6Al-4V"
[lattice]
cell = "bcc"
size = "4 mm"
origin = ["0.43 mm", "1.17 mm", "0.31 mm"]
density = 0.25
skin = {thickness = "0.3 mm", net = true}
[print]
layer_height = "0.1 mm"
pixel_size = "0.05 mm"
build_direction = "+x"
[output]
formats = ["cli-binary", "png-stack"]
"""


def test_layers_alone_are_those_of_a_lattice_with_a_surface(cli, tmp_path):
    """The same layers, and their mass and densities in place of the surface's."""
    found = []
    for name, formats in (("alone", ""), ("both", '"stl", ')):
        text = ALONE.replace('formats = ["cli', f'formats = [{formats}"cli')
        (tmp_path / "case.toml").write_text(text, encoding="utf-8")
        ended = cli("run", tmp_path, "-o", tmp_path / name)
        assert ended.code == 0, ended.err
        found.append(json.loads((tmp_path / name / "result.json").read_text(encoding="utf-8")))
        assert ("no surface was made" in " ".join(ended.out.split())) == (name == "alone")
    alone, both = found
    files = [
        (tmp_path / folder / name).read_bytes()
        for folder, name in (("alone", "lattice.cli"), ("both", "lattice.cli"))
    ]
    heads = [f[f.index(b"$$HEADEREND") :] for f in files]
    one, other = (
        list(read_cli(tmp_path / folder / name))
        for folder, name in (("alone", "lattice.cli"), ("both", "lattice.cli"))
    )
    assert len(heads[0]) == len(heads[1])
    for (top, lines), (meant, others) in zip(one, other, strict=True):
        assert top == meant
        for (way, points), (turn, places) in zip(lines, others, strict=True):
            assert way == turn
            np.testing.assert_allclose(points, places, atol=1e-5)
    assert not (tmp_path / "alone" / "lattice.png").exists()
    assert "printability" not in alone["measures"]
    assert "closed_voids" not in alone["measures"]
    density = alone["measures"]["density"]
    held = sum(signed_area(p[:-1]) * 0.1 for _, lines in one for _, p in lines)
    assert alone["measures"]["volume_mm3"] == pytest.approx(held, rel=0.01)
    assert alone["mass_g"] == pytest.approx(both["mass_g"], rel=0.02)
    assert density["layers"] == pytest.approx(both["measures"]["density"]["surface"], rel=0.02)
    assert density["field"] == pytest.approx(both["measures"]["density"]["field"], rel=0.01)
    for axis, slabs in density["slabs"].items():
        meant = both["measures"]["density"]["slabs"][axis]
        assert slabs["edges_mm"] == meant["edges_mm"]
        np.testing.assert_allclose(slabs["layers"], meant["surface"], atol=0.02)
        np.testing.assert_allclose(slabs["field"], meant["field"], atol=0.01)
    table = (tmp_path / "alone" / "slabs.csv").read_text(encoding="utf-8")
    assert table.startswith("axis,from_mm,to_mm,part_mm3,target,field,layers\n")


def test_layers_written_as_contours_need_no_pixels_that_hold_thin_struts(
    cli, tmp_path, monkeypatch
):
    # Struts of 0.27 mm: pixels hold 3.9 % less than the field, contours between them 2.7 %.
    monkeypatch.setattr(layers, "VOLUME_TOLERANCE", 0.03)
    coarse = ALONE.replace('"0.05 mm"', '"0.11 mm"').replace("density = 0.25", "density = 0.2")
    coarse = coarse.replace('"bcc"', '"f2bcc"').replace('size = "4 mm"', 'size = "3 mm"')
    (tmp_path / "case.toml").write_text(coarse, encoding="utf-8")
    ended = cli("run", tmp_path, "-o", tmp_path / "both")
    assert ended.code != 0
    assert "with pixels of 0.11 mm hold" in " ".join(ended.err.split())
    drawn = coarse.replace(', "png-stack"', "")
    (tmp_path / "case.toml").write_text(drawn, encoding="utf-8")
    ended = cli("run", tmp_path, "-o", tmp_path / "drawn")
    assert ended.code == 0, ended.err
    result = json.loads((tmp_path / "drawn" / "result.json").read_text(encoding="utf-8"))
    written = read_cli(tmp_path / "drawn" / "lattice.cli")
    held = sum(signed_area(p[:-1]) * 0.1 for _, lines in written for _, p in lines)
    # Single precision of the file.
    assert result["measures"]["volume_mm3"] == pytest.approx(held, rel=1e-4)
    density = result["measures"]["density"]
    assert density["layers"] == pytest.approx(density["field"], rel=0.03)


def ball(centre, radius):
    return lambda p: (
        np.linalg.norm(p - np.reshape(centre, (3, *[1] * (p.ndim - 1))), axis=0) - radius
    )


def lattice_of(field, surface, **stated):
    settings = {"layer_height": 0.05, "pixel_size": 0.05} | stated
    return PrintedLattice(surface=surface, name="balls", field=field, **settings)


def test_what_hangs_in_the_air_is_left_out_and_columns_that_join_above_are_not(tmp_path):
    """An arch: two columns that are apart in every layer but the top ones, and a ball beside."""

    def box(low, high):
        mid, half = (np.add(low, high) / 2), (np.subtract(high, low) / 2)
        return lambda p: (np.abs(p.T - mid) - half).T.max(axis=0)

    arch = [box((0, 0, 0), (1, 1, 3)), box((2, 0, 0), (3, 1, 3)), box((0, 0, 2), (3, 1, 3))]
    lone = ball((1.5, 0.5, 1.0), 0.3)

    def field(p):
        return np.min([f(p) for f in (*arch, lone)], axis=0)

    # 7 mm^3 of arch, as a box of that volume and the arch's extent for the bounds.
    surface = box_surface((3.0, 1.0, 3.0))
    object.__setattr__(surface, "faces", surface.faces)
    lattice = lattice_of(field, surface)
    with pytest.raises(Exception, match=r"hold 7 mm\^3, the printed surface 9 mm\^3"):
        slice_lattice(lattice)
    assert enclosed_volume(surface) == pytest.approx(9)
    both = lattice_of(field, surface, bodies=2)
    with pytest.raises(Exception, match=r"hold 7\.1"):
        slice_lattice(both)


def test_a_pixel_that_nobody_stated_is_halved_until_the_layers_hold_the_surface():
    """A bar of 0.32 mm: 3 pixels of 0.1 mm, 6 of 0.05 mm (0.3 mm), 13 of 0.025 mm (0.325 mm)."""
    mid, half = np.array([0.16, 0.5, 0.5]), np.array([0.16, 0.5, 0.5])
    bar = lattice_of(
        lambda p: (np.abs(p.T - mid) - half).T.max(axis=0),
        box_surface((0.32, 1.0, 1.0)),
        layer_height=0.1,
        pixel_size=None,
    )
    sliced = slice_lattice(bar)
    assert (sliced.height, sliced.pixel) == (0.1, pytest.approx(0.025))
    assert sliced.solid(5).sum() == 13 * 40
    # The machine's own resolution is not ours to change.
    with pytest.raises(Exception, match=r"pixels of 0\.1 mm hold 0\.3 mm\^3"):
        slice_lattice(dataclasses.replace(bar, pixel_size=0.1))
    # Its contours lie between the pixels, where the bar ends; they cut its four edges.
    drawn = slice_lattice(dataclasses.replace(bar, pixel_size=0.07), contoured=True)
    assert abs(drawn.volume / 0.32 - 1) > 0.05
    assert drawn.printed_volume == pytest.approx(0.32 - 4 * 0.07**2 / 8, rel=0.01)
    for _, held in drawn.axis_volumes():
        assert held.sum() == pytest.approx(drawn.printed_volume)
    with pytest.raises(Exception, match=r"pixels of 0\.075 mm hold"):
        slice_lattice(dataclasses.replace(bar, layer_height=0.3))


@pytest.mark.parametrize("export", [export_cli, export_cli_binary, export_png_stack])
def test_layers_without_a_height_say_which_key_is_missing(tmp_path, export):
    lattice = lattice_of(ball((0, 0, 0), 1), box_surface((1, 1, 1)), layer_height=None)
    with pytest.raises(Exception, match=r"\[print\] layer_height"):
        export(tmp_path / "x", lattice)


def test_files_of_a_case_whose_name_ends_headers_are_read(tmp_path, cli):
    # Three "$": without the first two the rest is the command.
    name = "a, end_header END_HEADER $$$HEADEREND $$GEOMETRYSTART"
    text = CASE.format(direction="+z").replace("a & b < c", name)
    text = text.replace('"png-stack"', '"ply"').replace('"0.1 mm"\npixel', '"0.2 mm"\npixel')
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    ended = cli("run", tmp_path, "-o", tmp_path / "out")
    assert ended.code == 0, ended.err
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    volume = result["measures"]["volume_mm3"]
    mesh = trimesh.load_mesh(tmp_path / "out" / "lattice.ply")
    assert mesh.volume == pytest.approx(volume, rel=1e-4)
    for key in ("lattice_cli", "lattice_cli-binary"):
        file = tmp_path / "out" / result["files"][key]
        # As another program finds the end of the header: the first time that its word stands there.
        assert file.read_bytes().count(b"$$HEADEREND") == 1
        layers = list(read_cli(file))
        assert len(layers) == 26
        area = sum(signed_area(points[:-1]) for _, lines in layers for _, points in lines)
        assert 0.2 * area == pytest.approx(volume, rel=0.02)
