"""Cells that a case describes itself: as a graph, or by a file of voxels or triangles."""

import json
import shutil

import numpy as np
import pytest

from gradedesign.design.case.read_case import load_case
from gradedesign.design.resolve.own_cell import with_own_cell
from gradedesign.errors import CaseError, GradeDesignError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.pipeline import run
from gradedesign.program.host.registry import build_registry

START = """\
[case]
name = "own"
[part]
box = ["5 mm", "5 mm", "5 mm"]
[lattice]
cell = "mine"
size = "5 mm"
"""
DENSITY = '[lattice.density_map]\nformula = "0.3"\n'
NODES = "nodes = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]\n"
CUBES = f'maker = "strut-graph"\n{NODES}edges = [[0, 1], [0, 2], [0, 3]]\n'
REGISTRY = build_registry()


def case(folder, own, start=START):
    (folder / "case.toml").write_text(f"{start}[lattice.own_cell]\n{own}\n{DENSITY}")
    return load_case(folder)


def family(folder, own):
    read = case(folder, own)
    return with_own_cell(read.lattice, REGISTRY, read.where).cell_families["mine"]


def primitive_voxels(n=24):
    axis = (np.arange(n) + 0.5) / n
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    return np.cos(2 * np.pi * x) + np.cos(2 * np.pi * y) + np.cos(2 * np.pi * z)


@pytest.mark.parametrize(
    ("own", "twin"),
    [
        (CUBES, "sc"),
        (CUBES + 'section = "square"', "sc-square"),
        (CUBES.replace("strut-graph", "convolution-graph"), "sc-convolution"),
    ],
)
def test_a_graph_of_a_case_is_the_installed_cell_of_that_graph(tmp_path, own, twin):
    """The same shape, point by point to rounding and the tails of sums, symmetry and window."""
    mine, theirs = family(tmp_path, own), REGISTRY.cell_families[twin]
    points = np.random.default_rng(7).random((3, 400))
    np.testing.assert_allclose(mine.shape(points), theirs.shape(points), rtol=0, atol=1e-7)
    assert mine.symmetry == theirs.symmetry == "cubic"
    assert calibrate(mine).window == pytest.approx(calibrate(theirs).window, abs=1e-6)


def test_voxels_of_a_case_are_the_cell_they_sample(tmp_path):
    """Samples of the primitive surface hold half the cell, the half that is above zero."""
    np.save(tmp_path / "cell.npy", primitive_voxels())
    mine = family(tmp_path, 'maker = "voxels"\nfile = "cell.npy"\nlevel = 0.0\nsymmetry = "cubic"')
    u = np.random.default_rng(7).random((3, 20_000))
    # Half by symmetry; 20000 points know it to 0.0035, the voxels' edges add 0.01.
    assert (mine.shape(u) <= 0).mean() == pytest.approx(0.5, abs=0.02)
    assert mine.shape(np.zeros((3, 1)))[0] < 0 < mine.shape(np.full((3, 1), 0.5))[0]


def test_a_mesh_of_a_case_is_printed_as_it_is(tmp_path):
    """The lattice of an installed cell, read back as a cell of its own, has the same density."""
    whole = tmp_path / "whole"
    whole.mkdir()
    text = START.replace('"mine"', '"primitive-network"') + DENSITY
    (whole / "case.toml").write_text(text)
    first = run(load_case(whole), folder=tmp_path / "out")
    shutil.copy(tmp_path / "out" / "lattice.stl", tmp_path / "cell.stl")
    mine = family(
        tmp_path,
        'maker = "mesh"\nfile = "cell.stl"\nbox = [[0, 0, 0], [5, 5, 5]]\ntolerance = 0.05',
    )
    u = np.random.default_rng(7).random((3, 20_000))
    assert first.relative_density == pytest.approx(0.3, abs=0.003)
    assert (mine.shape(u) <= 0).mean() == pytest.approx(0.3, abs=0.015)


def test_a_case_with_its_own_cell_is_generated(tmp_path, cli):
    case(tmp_path, CUBES)
    ended = cli("run", tmp_path, "-o", tmp_path / "out")
    assert ended.code == 0, ended.err
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    assert result["relative_density"] == pytest.approx(0.3, abs=0.01)


def test_its_properties_are_those_of_the_installed_cell_of_that_graph(tmp_path, cli):
    case(tmp_path, CUBES)
    options = ("--density", "0.3", "--resolution", "16", "--json")
    own = cli("homogenise", tmp_path, *options)
    assert own.code == 0, own.err
    twin = cli("homogenise", "sc", *options)
    mine, theirs = json.loads(own.out), json.loads(twin.out)
    assert (mine["cell"], theirs["cell"]) == ("mine", "sc")
    # Both come from the same voxels; what is printed has four digits.
    np.testing.assert_allclose(mine["C"], theirs["C"], rtol=1e-3, atol=1e-6)
    other = cli("homogenise", tmp_path / "case.toml", "--density", "0.25", *options[2:])
    assert json.loads(other.out)["C"][0][0] < 0.9 * mine["C"][0][0]


def test_its_table_is_written_under_its_name(tmp_path, cli, monkeypatch):
    case(
        tmp_path,
        'maker = "formula"\nformula = "cos(2*pi*x) + cos(2*pi*y) + cos(2*pi*z) + b"\n'
        'parameters = [["b", 0.0]]',
        START.replace('size = "5 mm"', 'size = "5 mm"\nparameters = {b = 0.1}'),
    )
    asked = []

    def table(cell, **_):
        asked.append(cell)
        raise CaseError("asked")

    monkeypatch.setattr("gradedesign_laboratory.run_tabulate.compute_table", table)
    ended = cli("tabulate", tmp_path, "-o", tmp_path / "tables", "--workers", "1")
    assert (ended.code, asked[0].family.name, asked[0].parameters["b"]) == (2, "mine", 0.1)
    ended = cli("tabulate", tmp_path / "casse.toml", "-o", tmp_path / "tables")
    assert 'did you mean "case.toml"?' in ended.err


def test_the_makers_are_listed(cli):
    listed = json.loads(cli("cells", "--makers", "--json").out)
    names = {maker["name"]: maker for maker in listed}
    assert {"strut-graph", "convolution-graph", "mesh", "voxels"} <= set(names)
    assert "nodes" in names["strut-graph"]["options"]
    assert names["mesh"]["file"] == [".stl"]
    assert "sigma" in cli("cells", "--makers").out


@pytest.mark.parametrize(
    ("own", "words"),
    [
        (CUBES.replace("strut-graph", "strut-grahp"), ["own_cell.maker", "strut-graph"]),
        (CUBES + "sections = 1", ["own_cell.sections", "no such option", "section"]),
        (CUBES + "path = true", ["possible are"]),
        (CUBES.replace("[0, 0, 1]]", "[0, 0, 1], [0.5, 0.5, 0.5]]"), ["node 4"]),
        (CUBES.replace("[0, 3]", "[0, 9]"), ["9"]),
        (CUBES.replace("[0, 3]", "[0]"), ["strut-graph"]),
        (f'maker = "strut-graph"\n{NODES}', ["needs edges", "[[i, j], ...]"]),
        (CUBES.replace("[0, 0, 1]]", f"[0, 0, 1], [1{'0' * 400}, 0, 0]]"), ["cannot use"]),
        (CUBES + 'file = "case.toml"', ["reads no file"]),
        ('maker = "mesh"', ["own_cell.file", "no file", ".stl"]),
        ('maker = "mesh"\nfile = "case.toml"', ["own_cell.file", "case.toml", ".stl"]),
        ('maker = "mesh"\nfile = "cell.stl"', ["does not exist"]),
        ('maker = "mesh"\nfile = "../cell.stl"', ["outside the folder"]),
        ('maker = "voxels"\nfile = 3', ["file name"]),
        (CUBES + "x = [[[[[1]]]]]", ["own_cell.x", "4 deep"]),
        (CUBES + "x = {y = 1}", ["own_cell.x", "a number, a text"]),
        ("nodes = []", ["own_cell", "maker"]),
    ],
)
def test_what_is_wrong_is_named(tmp_path, own, words):
    with pytest.raises(GradeDesignError) as caught:
        family(tmp_path, own)
    message = str(caught.value)
    assert "case.toml" in message
    for word in words:
        assert word in message


def test_voxels_that_are_not_periodic_are_refused(tmp_path):
    np.save(
        tmp_path / "cell.npy", np.indices((16, 16, 16))[1] < 4 + np.indices((16, 16, 16))[0] // 2
    )
    with pytest.raises(CaseError, match=r"case\.toml:\d+: lattice\.own_cell: .*along x"):
        family(tmp_path, 'maker = "voxels"\nfile = "cell.npy"')


def test_the_name_of_an_installed_cell_is_refused(tmp_path):
    told = case(tmp_path, CUBES, START.replace('"mine"', '"gyroid-sheet"'))
    with pytest.raises(CaseError, match="installed cell"):
        with_own_cell(told.lattice, REGISTRY, told.where)


def test_a_case_stays_itself_where_it_lies_until_its_cell_changes(tmp_path):
    """The hash by which a run resumes knows the bytes of the cell's file, not its path."""
    text = (
        START.replace("[lattice]", 'mesh_size = "2 mm"\n[lattice]')
        + 'density = [0.2, 0.4]\n[lattice.own_cell]\nmaker = "voxels"\nfile = "cell.npy"\n'
    )
    text += """\
[material]
name = "Ti-6Al-4V"
[region.low]
plane = "x = min"
[region.high]
plane = "x = max"
[[load_case]]
name = "pull"
fix = [{ region = "low" }]
load = [{ region = "high", force = ["1 N", "0 N", "0 N"] }]
[[limits.displacement]]
region = "high"
magnitude = "1 mm"
[print]
min_wall = "0.3 mm"
"""
    hashes = []
    for folder, voxels in (("a", 0.0), ("b", 0.0), ("c", 0.1)):
        (tmp_path / folder).mkdir()
        np.save(tmp_path / folder / "cell.npy", primitive_voxels() + voxels)
        (tmp_path / folder / "case.toml").write_text(text)
        hashes.append(load_case(tmp_path / folder).case_hash)
    assert hashes[0] == hashes[1] != hashes[2]
