"""Bad input through the command line: its exit code, one message, and nothing half-written.

Rows are those of the fault table of the quality reference. The readers, the schema and the
workers have closer tests of their own in tests/unit; here each row meets the whole program.
"""

import json
import os
import struct
import textwrap
from dataclasses import replace

import manifold3d
import numpy as np
import pytest
from small_parts import held_bar

from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles.surface_mesh import corner_points
from gradedesign.program.host import builtin

BOX = corner_points(box_surface((20.0, 10.0, 10.0)))

CASE = (
    held_bar(
        'file = "part.stl"\nunits = "mm"\nmesh_size = "5 mm"', name="bad", force="50 N, 0 N, 0 N"
    )
    + """\
[limits]
displacement = [{region = "tip", magnitude = "1 mm"}]
[lattice]
cell = "gyroid-sheet"
size = "5 mm"
density = [0.2, 0.5]
[run]
time = "20 s"
memory = "2 GB"
stop_after = "solid"
[output]
formats = ["stl"]
"""
)
BOX_CASE = CASE.replace('file = "part.stl"\nunits = "mm"', 'box = ["20 mm", "10 mm", "10 mm"]')


def binary(corners, count=None, header=b"made by hand"):
    """Binary STL, one record at a time."""
    data = header.ljust(80) + struct.pack("<I", len(corners) if count is None else count)
    for triangle in corners:
        data += struct.pack("<12fH", 0, 0, 0, *np.ravel(triangle), 0)
    return data


def text(corners, number="{:.9g}"):
    """ASCII STL, one line at a time."""
    lines = ["solid box"]
    for triangle in corners:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex " + " ".join(number.format(v) for v in p) for p in triangle]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid box", ""])


def patched(offset, value):
    data = bytearray(binary(BOX))
    data[offset : offset + len(value)] = value
    return bytes(data)


def ball():
    mesh = manifold3d.Manifold.sphere(10.0, 24).to_mesh64()
    return np.asarray(mesh.vert_properties)[:, :3][np.asarray(mesh.tri_verts).astype(int)]


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    """A cache, a working folder and a case folder of this test's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "case"
    folder.mkdir()
    return folder


def write(folder, case, stl=None):
    if stl is not None:
        data = stl if isinstance(stl, bytes) else stl.encode()
        (folder / "part.stl").write_bytes(data)
    (folder / "case.toml").write_text(case, encoding="utf-8")


def files_below(folder):
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())


def refused(cli, folder, code, words, *, command="run"):
    """Run a case that must be refused: its exit code, one message, and a clean run folder."""
    before = files_below(folder)
    run = folder.parent / "run"
    options = ["-o", run] if command == "run" else []
    ended = cli(command, folder, *options)
    assert ended.code == code, ended
    assert ended.err.count("error: ") == 1, ended.err
    assert "Traceback" not in ended.err + ended.out
    for word in words:
        assert word in ended.err
    assert files_below(folder) == before
    if run.exists():
        assert files_below(run) == ["result.json", "run.json"]
        result = json.loads((run / "result.json").read_text(encoding="utf-8"))
        assert result["status"] == "failed"
        assert result["reason"] in ended.err
    return ended


STL_REFUSED = {
    "1 empty": (b"", ["empty file"]),
    "2 fifty bytes": (binary(BOX)[:50], ["truncated header"]),
    "3 no triangles": (binary(BOX)[:80] + bytes(4), ["no triangles"]),
    "4 cut in a record": (binary(BOX)[:-20], ["declares 12", "holds 11"]),
    "5 cut between records": (binary(BOX)[:-50], ["declares 12", "holds 11"]),
    "6 absurd count": (patched(80, b"\xff" * 4), ["declares 4294967295"]),
    "7 count too small": (binary(np.tile(BOX, (4, 1, 1)), count=2), ["declares 2"]),
    "9 cut in a facet": (text(BOX)[:120], ["line"]),
    "9 no endsolid": (text(BOX).replace("endsolid box\n", ""), ["'endsolid' is missing"]),
    "7 a shell too few": (binary(np.concatenate([BOX, BOX + 50.0]), count=12), ["12 more follow"]),
    "10 decimal comma": (text(BOX + 0.5).replace("0.5", "0,5"), ["decimal comma", "line"]),
    "11 HTML": ("<!DOCTYPE html><html>404</html>", ["not STL", "HTML"]),
    "11 OBJ": ("# made by\nv 0 0 0\nv 1 0 0\nf 1 2 3\n", ["not STL", "OBJ"]),
    "11 PNG": (b"\x89PNG\r\n\x1a\n" + bytes(300), ["not STL", "PNG"]),
    "12 random bytes": (np.random.default_rng(12).bytes(2000), []),
    "13 NaN": (patched(96, struct.pack("<f", np.nan)), ["NaN"]),
    "14 infinite": (patched(96, struct.pack("<f", np.inf)), ["infinite"]),
    "14 1e30": (patched(96, struct.pack("<f", 1e30)), ["far"]),
    "19 a facet missing": (binary(BOX[1:]), ["hole"]),
    "20 a fifth missing": (binary(ball()[np.random.default_rng(20).random(288) > 0.2]), ["hole"]),
    "24 two bodies": (binary(np.concatenate([BOX, BOX + 50.0])), ["bodies"]),
    "26 flat": (binary(BOX * [1.0, 1.0, 0.0]), []),
}


@pytest.mark.parametrize(("stl", "words"), STL_REFUSED.values(), ids=STL_REFUSED.keys())
def test_damaged_part_files(cli, home, stl, words):
    write(home, CASE, stl)
    refused(cli, home, 3, ["case.toml:4: part.file", "part.stl", *words])


STL_READ = {
    "7 a few bytes too many": (binary(BOX) + b"  ", "warning"),
    "8 binary that starts with solid": (binary(BOX, header=b"solid"), None),
    "10 CRLF, tabs, upper case": (text(BOX).upper().replace("\n", "\r\n"), None),
    "15 facets without area": (binary(np.concatenate([BOX, BOX[:2, [0, 0, 1]]])), "degenerate"),
    "16 duplicates": (binary(np.concatenate([BOX, BOX])), "duplicates"),
    "17 inverted": (binary(BOX[:, ::-1]), "warning"),
    "18 a third flipped": (binary([t[::-1] if k % 3 == 0 else t for k, t in enumerate(BOX)]), None),
}


@pytest.mark.parametrize(("stl", "word"), STL_READ.values(), ids=STL_READ.keys())
def test_unusual_part_files_are_read_and_what_was_done_is_told(cli, home, stl, word, monkeypatch):
    # The mesher is not the question here: the fan of test_mesher_faults stands in for it.
    lay_out_worker(home.parent, monkeypatch, "fan")
    write(home, CASE, stl)
    ended = cli("check", home, "--no-picture")
    assert ended.code == 0, ended.err
    assert ", 2000 mm^3, " in ended.out
    if word is not None:
        assert word in ended.out


# Old text, new text, words of the message; the message names the line of the old text.
WRONG = {
    "39 syntax": ('name = "PA12"', 'name = = "PA12"', ["not valid TOML", "^"]),
    "40 unknown key": ("magnitude =", "magnitud =", ['did you mean "magnitude"?']),
    "41 wrong word": ('stop_after = "solid"', 'stop_after = "solod"', ['did you mean "solid"?']),
    "42 no unit": ('magnitude = "1 mm"', 'magnitude = "1"', ["without a unit"]),
    "42 other dimension": ('"50 N"', '"50 mm"', ["expected a force"]),
    "43 hostile quantity": ('"50 N"', '"9**9**9"', ["not a number followed by a unit"]),
    "44 impossible stiffness": (
        'name = "PA12"',
        'youngs_modulus = "-2 GPa"\npoissons_ratio = 0.3\ndensity = "1 g/cm^3"',
        ["above 0"],
    ),
    "45 limit of nothing": ('magnitude = "1 mm"', 'magnitude = "0 mm"', ["above 0"]),
    "45 densities reversed": ("[0.2, 0.5]", "[0.5, 0.2]", ["lowest above the highest"]),
    "51 nothing there": ('plane = "x = max"', 'plane = "x = 999 mm"', ["region.tip", "nearest"]),
    "55 zero load": ('"50 N"', '"0 N"', ["loads nothing"]),
    "unknown format": (
        '["stl"]',
        '["step"]',
        [
            "no format named 'step'; available:",
            "glb, obj, off, ply, png-stack, stl, inp, report, vtu",
        ],
    ),
    "misspelt format": ('["stl"]', '["stll"]', ['did you mean "stl"', "stl, inp, report, vtu"]),
    "size without a range": ("density =", 'grading = "size"\ndensity =', ["goes with a range"]),
    "unknown cell": ("gyroid-sheet", "gyroid-shet", ['did you mean "gyroid-sheet"?']),
    "unknown law": ("density =", 'law = "ramires"\ndensity =', ["no law named 'ramires'"]),
    "law of another cell": (
        "density =",
        'law = "ramirez-2022-primitive-4x4x4"\ndensity =',
        ["not 'gyroid-sheet'"],
    ),
    "unknown material": ('"PA12"', '"PA21"', ['did you mean "PA12"?']),
    "unknown parameter": ("density =", "parameters = {kk = 1.0}\ndensity =", ["kk"]),
    "53 too few supports": (
        'fix = [{region = "root"}]',
        'fix = [{region = "root", components = "x"}]',
        ["rigid motions free", "rotat"],
    ),
    "53 no support": ('fix = [{region = "root"}]', "fix = []", ["no support"]),
}


@pytest.mark.parametrize("command", ["run", "check"])
@pytest.mark.parametrize(("old", "new", "words"), WRONG.values(), ids=WRONG.keys())
def test_wrong_cases(cli, home, old, new, words, command):
    assert BOX_CASE.count(old) == 1
    write(home, BOX_CASE.replace(old, new))
    ended = refused(cli, home, 2, words, command=command)
    line = BOX_CASE[: BOX_CASE.index(old)].count("\n") + 1
    # A selector or a table is named at its own line, one above or two below its contents.
    near = [f"case.toml:{k}" for k in range(line - 1, line + 2)]
    assert any(word in ended.err for word in near), (line, ended.err)


def test_44_a_nearly_incompressible_material_is_warned_of(cli, home):
    stated = 'youngs_modulus = "2 GPa"\npoissons_ratio = 0.4999\ndensity = "1 g/cm^3"'
    write(home, BOX_CASE.replace('name = "PA12"', stated))
    ended = cli("check", home, "--no-picture")
    assert ended.code == 0
    told = " ".join(ended.out.split())
    assert "material.poissons_ratio: found 0.4999, nearly incompressible" in told


def test_densities_that_no_law_supports(cli, home):
    write(home, BOX_CASE.replace("[0.2, 0.5]", "[0.97, 0.99]"))
    refused(cli, home, 2, ["windows", "density"])


def test_densities_that_the_printer_cannot_make(cli, home):
    thin = BOX_CASE.replace("[0.2, 0.5]", "[0.2, 0.25]")
    write(home, thin.replace("[run]", '[print]\nmin_wall = "1 mm"\n[run]'))
    refused(cli, home, 2, ["lattice.density", "min_wall 1 mm", "widen it or choose another"])
    write(home, thin.replace("[run]", '[print]\nmin_wall = "2 mm"\n[run]'))
    refused(cli, home, 2, ["print.min_wall", "at most 1.69 mm", "larger cells"])


WORKERS = {
    "fan": "answer(*fan())",
    "crash": "os.kill(os.getpid(), signal.SIGSEGV)",
    "hang": "time.sleep(600)",
    "eat": "x = np.zeros(2**32)",
    "nothing": "answer(np.zeros((0, 3)), np.zeros((0, 4), dtype=np.int32))",
    "inverted": "p, t = fan(); answer(p, t[:, [1, 0, 2, 3]])",
    "short": "p, t = fan(); answer(p * 0.95 ** (1 / 3), t)",
}


def lay_out_worker(folder, monkeypatch, name):
    """Put a mesher that answers, or fails, in the place of the real one."""
    modules = folder / "modules"
    modules.mkdir()
    source = """
        import os, signal, sys, time
        import numpy as np
        with np.load(sys.argv[1]) as archive:
            v, f = archive['vertices'], archive['faces']

        def answer(points, tets):
            np.savez(sys.argv[2], points=np.asarray(points, float), tets=np.asarray(tets))

        def fan():
            return np.vstack([v, v.mean(axis=0)]), np.column_stack([np.full(len(f), len(v)), f])

        """
    body = textwrap.dedent(source) + WORKERS[name] + "\n"
    (modules / "stand_in.py").write_text(body, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(modules), prepend=os.pathsep)
    monkeypatch.setattr(builtin, "PYTETWILD", replace(builtin.PYTETWILD, worker="stand_in"))


@pytest.mark.parametrize(
    ("name", "code", "words"),
    [
        ("crash", 6, ["SIGSEGV", "attempts with the same tolerance: 3", "to reproduce"]),
        ("hang", 6, ["timed out"]),
        ("eat", 5, ["memory", "run.memory"]),
        ("nothing", 6, ["no tetrahedra"]),
        ("inverted", 6, ["attempts"]),
        ("short", 6, ["volume"]),
    ],
)
def test_mesher_faults(cli, home, monkeypatch, name, code, words):
    lay_out_worker(home.parent, monkeypatch, name)
    write(home, CASE.replace('"20 s"', '"5 s"' if name == "hang" else '"20 s"'), binary(BOX))
    refused(cli, home, code, ["part.mesh_size", *words])


def install(folder, monkeypatch, source):
    """Lay out a plugin as pip leaves it."""
    monkeypatch.syspath_prepend(str(folder))
    module = f"plugin_{abs(hash(source))}"
    (folder / f"{module}.py").write_text(source, encoding="utf-8")
    info = folder / "acme_cells-1.2.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: acme-cells\nVersion: 1.2\n")
    (info / "entry_points.txt").write_text(f"[gradedesign]\nacme = {module}\n")


CELL = """
import numpy as np
from gradedesign import CellFamily, LawOrigin, hookimpl, power_law

def shape(u):
    return {value}

@hookimpl
def gradedesign_cell_families():
    yield CellFamily(name="acme-cell", shape=shape)

@hookimpl
def gradedesign_scaling_laws():
    yield power_law("acme-law", ("acme-cell",), youngs=(1.0, 2.0), strength=(1.0, 2.0),
                    window=(0.1, 0.9), origin=LawOrigin(kind="fe", source="none", test="none"))
"""


def test_76_a_plugin_that_fails_to_import_is_disabled_and_told(cli, home, monkeypatch):
    install(home.parent, monkeypatch, "import no_such_module_at_all")
    write(home, BOX_CASE)
    ended = cli("check", home, "--no-picture")
    assert ended.code == 0
    assert "warning: disabled plugin 'acme' of acme-cells 1.2" in ended.err
    assert "no_such_module_at_all" in ended.err
    ended = cli("check", home, "--strict-plugins")
    assert ended.code == 7
    assert "no_such_module_at_all" in ended.err
    write(home, BOX_CASE.replace("gyroid-sheet", "acme-cell"))
    ended = cli("check", home, "--no-picture")
    assert ended.code == 7
    assert "acme-cells 1.2" in ended.err
    assert "Traceback" not in ended.err


def test_77_a_misspelt_hook_names_its_distribution(cli, home, monkeypatch):
    install(home.parent, monkeypatch, CELL.format(value="u[0]").replace("_families", "_family"))
    write(home, BOX_CASE)
    refused(cli, home, 7, ["acme-cells 1.2", "gradedesign_cell_family"])


@pytest.mark.parametrize(
    ("value", "word"),
    [
        ("np.full(u.shape[1:], np.nan)", "finite"),
        ("u", "shape"),
        ("1 / 0", "ZeroDivisionError"),
    ],
)
def test_78_a_cell_that_breaks_its_contract(cli, home, monkeypatch, value, word):
    install(home.parent, monkeypatch, CELL.format(value=value))
    write(home, BOX_CASE.replace("gyroid-sheet", "acme-cell"))
    refused(cli, home, 7, ["lattice.cell", "acme-cell", word])


def test_a_failed_run_does_not_stand_in_the_way(cli, home):
    write(home, BOX_CASE.replace('"PA12"', '"PA21"'))
    refused(cli, home, 2, ["PA12"])
    write(home, BOX_CASE)
    ended = cli("run", home, "-o", home.parent / "run")
    assert ended.code == 0, ended.err
    assert "PARTIAL" in ended.out


def test_a_run_folder_of_another_case_is_kept(cli, home):
    run = home.parent / "run"
    write(home, BOX_CASE)
    assert cli("run", home, "-o", run).code == 0
    kept = {name: (run / name).read_bytes() for name in files_below(run)}
    write(home, BOX_CASE.replace('"50 N"', '"51 N"'))
    for options in ([], ["--resume"]):
        ended = cli("run", home, "-o", run, *options)
        assert ended.code == 2
        assert "belongs to another case" in ended.err
        assert "--overwrite" in ended.err
    assert {name: (run / name).read_bytes() for name in files_below(run)} == kept
