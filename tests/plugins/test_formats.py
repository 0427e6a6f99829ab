"""File formats of plugins end to end: the README's distribution, built and installed."""

import json
import re
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from gradedesign import CaseError, PluginError, load_case
from gradedesign.design.resolve.fitting_part import part_of
from gradedesign.design.resolve.part_readers import part_readers
from gradedesign.pipeline import run
from gradedesign.program.host.registry import build_registry

README = (Path(__file__).parents[2] / "plugins" / "README.md").read_text(encoding="utf-8")
TOML = re.findall(r"^```toml\n(.*?)^```$", README, flags=re.DOTALL | re.MULTILINE)
(NAMED,) = (block for block in TOML if "formats = " in block)

#: A block of 10 x 5 x 5 mm, as the facets of its sides.
SIDES = {
    "bottom": (0, 2, 1, 0, 3, 2),
    "top": (4, 5, 6, 4, 6, 7),
    "front": (0, 1, 5, 0, 5, 4),
    "back": (2, 3, 7, 2, 7, 6),
    "hot end": (1, 2, 6, 1, 6, 5),
    "root": (3, 0, 4, 3, 4, 7),
}
CORNERS = ["0 0 0", "10 0 0", "10 5 0", "0 5 0", "0 0 5", "10 0 5", "10 5 5", "0 5 5"]
FACETS = "".join(
    f"{' '.join(CORNERS[k] for k in corners[at : at + 3])} {name}\n"
    for name, corners in SIDES.items()
    for at in (0, 3)
)
#: The same block, its corners around the origin.
BOX = trimesh.creation.box((10.0, 5.0, 5.0))
PART = '[part]\nfile = "block.facets"\n'
GENERATED = f"""\
[case]
name = "block"
{PART}
[lattice]
cell = "gyroid-sheet"
size = "5 mm"
density = 0.4
[output]
formats = ["voxels", "stl"]
"""
SIZED = f"""\
[case]
name = "block"
{PART}mesh_size = "4 mm"
[region.root]
name = "root"
[region.tip]
color = "#ff0000"
[material]
name = "PA12"
[[load_case]]
name = "pull"
fix = [{{region = "root"}}]
load = [{{region = "tip", force = ["50 N", "0 N", "0 N"]}}]
[limits]
displacement = [{{region = "tip", magnitude = "1 mm"}}]
[lattice]
cell = "gyroid-sheet"
size = "5 mm"
density = [0.2, 0.5]
[run]
stop_after = "lattice"
[output]
formats = ["voxels"]
"""


@pytest.fixture
def installed(formats_site, monkeypatch):
    """The README's formats, as if installed."""
    monkeypatch.syspath_prepend(str(formats_site))
    yield
    sys.modules.pop("gradedesign_acme_formats", None)


def write(folder, text, facets=FACETS):
    (folder / "case.toml").write_text(text, encoding="utf-8")
    (folder / "block.facets").write_text(facets, encoding="utf-8")
    return folder


def test_the_readme_names_the_formats_of_its_plugin():
    named = tomllib.loads(NAMED)
    assert named["part"]["file"].endswith(".facets")
    assert named["output"]["formats"] == ["stl", "voxels"]


def test_an_installed_format_is_read_and_another_written(installed, tmp_path, cli):
    case = write(tmp_path, GENERATED)
    ended = cli("run", case, "-o", tmp_path / "out", "--strict-plugins")
    assert ended.code == 0, ended.err
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert result["files"]["lattice_voxels"] == "lattice.npz"
    assert result["files"]["stl"] == "lattice.stl"
    assert "gradedesign-acme-formats 0.1.0" in result["plugins"]
    # The field and the surface are one body: voxels of 0.25 mm hold the volume that is stated.
    with np.load(tmp_path / "out" / "lattice.npz") as voxels:
        volume = voxels["solid"].sum() * float(voxels["step"]) ** 3
        assert voxels["case_hash"] == load_case(case).case_hash
        assert voxels["name"] == "block"
        np.testing.assert_allclose(voxels["lower"], 0.0, atol=0.02)
    assert volume == pytest.approx(result["measures"]["volume_mm3"], rel=0.05)
    manifest = json.loads((tmp_path / "out" / "run.json").read_text(encoding="utf-8"))
    assert "lattice.npz" in manifest["artefacts"]
    assert not list((tmp_path / "out").glob(".*unfinished"))


#: Of the core and of the plugins that `make install` installs; others may read more.
WRITTEN = ("3mf", "3mf-beams", "cli", "cli-binary", "glb", "obj", "off", "ply", "png-stack", "stl")
READABLE = (".3mf", ".glb", ".obj", ".off", ".ply", ".stl")


@pytest.mark.slow
def test_a_run_writes_the_formats_beside_its_stl(installed, tmp_path, cli):
    case = write(tmp_path, SIZED)
    ended = cli("run", case, "-o", tmp_path / "out")
    assert ended.code == 0, ended.err
    assert "lattice.npz" in ended.out
    files = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))["files"]
    assert (files["lattice_voxels"], files["stl"]) == ("lattice.npz", "lattice.stl")
    import trimesh

    surface = trimesh.load(tmp_path / "out" / "lattice.stl")
    with np.load(tmp_path / "out" / "lattice.npz") as voxels:
        # PA12 of 0.93 g/cm^3, as the library has it.
        assert float(voxels["mass_g"]) == pytest.approx(surface.volume * 0.93e-3, rel=1e-3)
        # The volume of 20 points a cell, in the symmetry of its walls, is off by a tenth; whether
        # each is solid is not, but for those on the surface itself.
        solid, step = voxels["solid"], float(voxels["step"])
        points = np.argwhere(np.ones(solid.shape)) * step + voxels["lower"]
    assert (surface.contains(points + 1e-3) != solid.ravel()).mean() < 0.03


def test_the_doctor_lists_formats(installed, cli):
    out = " ".join(cli("doctor").out.split())
    readable = out.split("parts: ")[1].split("; formats: glb, obj")[0].split(", ")
    assert {*READABLE, ".facets"} <= set(readable)


def test_units_and_bytes_of_the_file_count(installed, tmp_path):
    case = load_case(write(tmp_path, SIZED.replace(PART, PART + 'units = "cm"\n')))
    part = part_of(case, part_readers(case.part, case.run.memory, build_registry()))
    assert part.volume == pytest.approx(250_000.0)
    assert "read in cm as part.units says, though its unit is mm" in part.report.warnings[0]
    assert part.regions["tip"].area == pytest.approx(2500.0)
    before = load_case(write(tmp_path, SIZED)).case_hash
    assert load_case(write(tmp_path, SIZED, FACETS.replace("10 ", "12 "))).case_hash != before


def test_a_cad_file_without_its_plugin_names_the_plugin(tmp_path):
    case = load_case(write(tmp_path, SIZED))
    part = case.part.model_copy(update={"file": tmp_path / "lever.STEP"})
    bare = replace(build_registry(), readers={})
    with pytest.raises(CaseError, match=r"plugin gradedesign-step.*; or export it"):
        part_readers(part, case.run.memory, bare)


@pytest.mark.parametrize(
    ("command", "text"), [(c, text) for c in ("run", "check") for text in (SIZED, GENERATED)]
)
def test_what_nothing_installed_reads_or_writes_is_told_with_its_line(tmp_path, cli, command, text):
    place = [] if command == "check" else ["-o", tmp_path / "out"]
    case = write(tmp_path, text.replace('"voxels"', '"stll"'))
    wrong = cli(command, case, *place)
    line = text.splitlines().index("[output]") + 2
    assert wrong.code == 2
    assert f"case.toml:{line}: output.formats: no format named 'stll'; did you mean" in wrong.err
    written = " ".join(wrong.err.split()).split("available: ")[1]
    assert all(name in written for name in (*WRITTEN, "vtu", "inp", "report"))
    case = write(tmp_path, text.replace('"voxels", "stl"', '"stl"').replace('"voxels"', '"vtu"'))
    wrong = cli(command, case, *place)
    assert wrong.code == 2
    assert 'case.toml:4: part.file: found "block.facets", which no installed reader' in wrong.err
    readable = " ".join(wrong.err.split()).split("readable: ")[1]
    assert all(suffix in readable for suffix in READABLE)


def test_a_missing_file_is_told_before_its_suffix_is_judged(tmp_path):
    write(tmp_path, SIZED.replace("block.facets", "blok.facets"))
    with pytest.raises(CaseError, match=r'toml:4: part\.file: .*did you mean "block\.facets"'):
        load_case(tmp_path)


def test_a_file_without_a_unit_needs_one_in_the_case(tmp_path, cli):
    (tmp_path / "block.off").write_bytes(BOX.export(file_type="off").encode())
    text = GENERATED.replace("block.facets", "block.off").replace('"voxels", "stl"', '"obj"')
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    wrong = cli("run", tmp_path, "-o", tmp_path / "out")
    assert wrong.code == 2
    assert "case.toml:3: part.units: missing; block.off carries no unit" in wrong.err


def test_check_lists_the_faces_of_the_file(installed, tmp_path, cli):
    case = write(tmp_path, SIZED)
    found = json.loads(cli("check", case, "--no-picture", "--json").out)
    rows = {row["name"]: row for row in found["part"]["file_faces"]}
    assert set(rows) == set(SIDES)
    assert rows["hot end"] == {
        "face": 3, "name": "hot end", "color": "#ff0000", "area_mm2": pytest.approx(25.0),
        "centroid_mm": pytest.approx([10.0, 2.5, 2.5]), "surface": None, "diameter_mm": None,
    }  # fmt: skip
    assert found["part"]["units"] == "mm"
    areas = {row["name"]: row["area_mm2"] for row in found["regions"]}
    assert areas == pytest.approx({"root": 25.0, "tip": 25.0})
    out = cli("check", case, "--no-picture").out
    assert "Faces of the file" in out
    assert "hot end" in out
    write(tmp_path, SIZED.replace('name = "root"', 'name = "rot"'))
    wrong = cli("check", case, "--no-picture")
    assert wrong.code == 2
    assert "region.root: nothing in the part's file has the name 'rot'" in wrong.err
    assert "names in the file: back, bottom, front, hot end, root, top" in wrong.err


HEAD = """
import sys
import numpy as np
from gradedesign import Exporter, PartError, PartReader, RawTriangles, hookimpl
"""
BAD_EXPORTER = """
def write(path, lattice):
    {body}

@hookimpl
def gradedesign_exporters():
    yield Exporter(name="fake", suffix=".fake", write=write)
"""
BAD_READER = """
def read(path):
    {body}

@hookimpl
def gradedesign_readers():
    yield PartReader(name="fake", suffixes=(".facets",), read=read)
"""


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("lattice.surfaces", "failed: AttributeError"),
        ("path.write_text('half'); raise OSError('gone')", "failed: OSError: gone"),
        ("sys.exit(0)", "failed: SystemExit"),
        ("pass", "left nothing"),
        ("path.write_text('')", "left an empty file"),
        ("path.with_suffix('.mtl').write_text('x'); path.write_text('x')", "lattice.fake, lattice"),
        ("path.symlink_to('/etc/hosts')", "expected that one file"),
    ],
)
def test_a_broken_exporter_is_named_and_leaves_nothing(install, tmp_path, body, words):
    install("fake-writer", HEAD + BAD_EXPORTER.format(body=body))
    box = GENERATED.replace(PART, '[part]\nbox = ["5 mm", "5 mm", "5 mm"]\n')
    case = load_case(write(tmp_path, box.replace('"voxels", "stl"', '"fake"')))
    with pytest.raises(PluginError, match=r"exporter 'fake' of fake-writer 1\.2 ") as told:
        run(case, folder=tmp_path / "out")
    assert "writing lattice.fake" in str(told.value)
    assert words in str(told.value)
    names = {p.name for p in (tmp_path / "out").iterdir()}
    assert "lattice.fake" not in names
    assert not [name for name in names if "unfinished" in name]


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("int('x')", "failed: ValueError"),
        ("sys.exit(0)", "failed: SystemExit"),
        ("raise PartError('block.facets: torn')", "part.file: block.facets: torn"),
        ("return np.zeros((1, 3, 3))", "returned a ndarray, expected RawTriangles"),
        ("return RawTriangles(corners=np.full((1, 3, 3), np.nan))", "9 values that are not finite"),
        (
            "return RawTriangles(corners=np.full((1, 3, 3), 1e9), unit='mm')",
            "reach absurdly far",
        ),
        (
            "return RawTriangles(corners=np.zeros((0, 3, 3)), unit='mm')",
            "block.facets: no triangles",
        ),
    ],
)
def test_a_broken_reader_is_named_with_its_file(install, tmp_path, cli, body, words):
    install("fake-reader", HEAD + BAD_READER.format(body=body))
    case = write(tmp_path, GENERATED.replace('"voxels", "stl"', '"stl"'))
    ended = cli("run", case, "-o", tmp_path / "out")
    assert ended.code in (3, 7)
    assert "case.toml:4: part.file: " in ended.err
    assert words in ended.err
    assert ended.code == 3 or "part reader 'fake' of fake-reader 1.2 on block.facets" in ended.err


def test_a_format_of_a_disabled_plugin_is_an_error_of_the_plugin(install, tmp_path, cli):
    install("fake-broken", "import no_such_module_at_all")
    ended = cli("run", write(tmp_path, GENERATED), "-o", tmp_path / "out")
    assert ended.code == 7
    assert "no_such_module_at_all" in ended.err


TWO = """
@hookimpl
def gradedesign_readers():
    yield PartReader(name="a", suffixes={one}, read=print)
    yield PartReader(name="b", suffixes={other}, read=print)
"""
ONE = """
@hookimpl
def gradedesign_exporters():
    yield Exporter(name="{name}", suffix="{suffix}", write=print)
"""


@pytest.mark.parametrize(
    ("source", "words"),
    [
        (TWO.format(one="('.x', '.y')", other="('.y',)"), r"'\.y' is read by both 'a'.*'b'"),
        (TWO.format(one="('.stl',)", other="('.y',)"), r"'\.stl' is read by both .*'stl' of gra"),
        (TWO.format(one="'.x'", other="('.y',)"), "expected a tuple"),
        (TWO.format(one="('.X',)", other="('.y',)"), "lower-case"),
        (ONE.format(name="vtu", suffix=".vtu"), "has the name of an output of gradedesign"),
        (ONE.format(name="x", suffix="/../x"), "expected a dot"),
    ],
)
def test_formats_that_clash_or_have_no_suffix_are_refused(install, source, words):
    install("fake-formats", HEAD + source)
    with pytest.raises(PluginError, match=words):
        build_registry()


def test_two_formats_of_one_suffix_get_two_names(install, tmp_path):
    install(
        "fake-two",
        HEAD + "write = lambda path, lattice: path.write_text(f'{lattice.material} {lattice.unit}')"
        "\n@hookimpl\ndef gradedesign_exporters():\n    for name in ('one', 'two'):\n"
        "        yield Exporter(name=name, suffix='.stl', write=write)\n",
    )
    box = GENERATED.replace(PART, '[part]\nbox = ["5 mm", "5 mm", "5 mm"]\n')
    text = box.replace('"voxels", "stl"', '"two", "one", "stl"') + '[material]\nname = "PA12"\n'
    result = run(load_case(write(tmp_path, text)), folder=tmp_path / "out")
    names = ("lattice-two.stl", "lattice-one.stl", "lattice.stl")
    assert tuple(result.files[k] for k in ("lattice_two", "lattice_one", "stl")) == names
    assert (tmp_path / "out" / "lattice-two.stl").read_text() == "PA12 mm"


def test_an_exporter_may_evaluate_the_field(install, tmp_path):
    body = "np.savetxt(path, lattice.field(lattice.surface.vertices.T))"
    install("fake-field", HEAD + BAD_EXPORTER.format(body=body))
    box = GENERATED.replace(PART, '[part]\nbox = ["5 mm", "5 mm", "5 mm"]\n')
    case = load_case(write(tmp_path, box.replace('"voxels", "stl"', '"fake"')))
    run(case, folder=tmp_path / "out")
    values = np.loadtxt(tmp_path / "out" / "lattice.fake")
    # The surface was extracted on a grid of 0.2 mm: its vertices lie near the zero set.
    assert np.abs(values).max() < 0.05
