"""The command line: what each command prints, its data, and how it ends."""

import dataclasses
import json
import os
import re
import signal
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path

import pytest
import trimesh

import gradedesign
from gradedesign.errors import (
    CaseError,
    DensityError,
    GradeDesignError,
    LatticeError,
    MeshError,
    PartError,
    PluginError,
    ResourceError,
    SolverError,
)
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.program.commands import lists as list_module
from gradedesign.program.commands import loading
from gradedesign.program.commands import run as run_module
from gradedesign.program.commands.run import holds_only_a_failure
from gradedesign.program.host.registry import build_registry
from gradedesign.program.store.stages import default_folder

CASES = Path(__file__).parents[2] / "cases"


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def infeasible(tmp_path_factory):
    """One run of cases/infeasible in a process of its own, from another working folder."""
    folder = tmp_path_factory.mktemp("infeasible")
    case = (CASES / "infeasible" / "case.toml").read_text(encoding="utf-8")
    case = case.replace('name = "infeasible"', "name = \"<script>alert('x')</script>\"")
    (folder / "case.toml").write_text(case, encoding="utf-8")
    command = [sys.executable, "-m", "gradedesign", "run", str(folder)]
    ended = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, timeout=300, check=False
    )
    return ended, folder


def test_the_version_is_printed():
    command = [sys.executable, "-m", "gradedesign", "--version"]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert ended.stdout == f"gradedesign {version('gradedesign')}\n"


def test_an_infeasible_case_ends_with_4_and_names_what_helps(infeasible):
    ended, _ = infeasible
    assert ended.returncode == 4
    assert ended.stderr == ""
    lines = re.sub(r"\n(  )+ *", " ", ended.stdout).splitlines()  # paragraphs in one line again
    (verdict,) = [line for line in lines if line.startswith("INFEASIBLE: ")]
    assert "displacement of tip magnitude" in verdict
    assert "would help" in verdict
    # Without a terminal there are no frames, colours or carriage returns.
    assert not set(ended.stdout) & set("\x1b\r│┃─")
    assert any(line.startswith("solid ") and "BROKEN" in line for line in lines)


def test_the_default_run_folder_stays_below_runs(infeasible):
    _, folder = infeasible
    (run,) = (folder / "runs").iterdir()
    assert run.name == "script-alert-x-script"


def test_every_file_is_listed_and_in_the_manifest(infeasible):
    ended, folder = infeasible
    (run,) = (folder / "runs").iterdir()
    result = json.loads((run / "result.json").read_text(encoding="utf-8"))
    manifest = json.loads((run / "run.json").read_text(encoding="utf-8"))
    found = {p.name for p in run.iterdir()} - {"run.json"}
    assert found == set(result["files"].values()) == set(manifest["artefacts"])
    assert found == {
        "case-as-run.toml", "iterations.csv", "loads.png", "report.html", "result.json",
        "scene.json", "solid.vtu",
    }  # fmt: skip
    assert all(name in ended.stdout for name in found)
    assert result["status"] == "infeasible"
    assert result["iterations"] == []
    # Cantilever: F L^3 / (3 E I) = 50 * 60^3 / (3 * 1387 * 833.3) = 3.115 mm with the E of PA12;
    # shear adds 0.07 mm, the clamped end and the coarse mesh take as much away.
    assert result["limits"][0]["value"] == pytest.approx(3.115, rel=0.03)


def test_the_report_of_a_run_needs_nothing_else_and_escapes(infeasible):
    _, folder = infeasible
    (run,) = (folder / "runs").iterdir()
    html = (run / "report.html").read_text(encoding="utf-8")
    # Pictures and scripts stand in the page, which its own policy holds to these scripts.
    assert not re.search(r'(?:src|href)="(?!data:)', html)
    assert html.count("<script") == 3  # the scene's data, three.js and ours
    assert html.count("'sha256-") == 2
    assert "alert('x')</script>" not in html
    assert "&lt;script&gt;" in html
    assert html.index("INFEASIBLE") < html.index('<section class="scene"') < html.index("<h2>")


def test_a_report_is_written_again_from_its_folder(infeasible, cli):
    """A report that is lost comes back as it was, and the folder is as sound as before."""
    _, folder = infeasible
    (run,) = (folder / "runs").iterdir()
    before = {path.name: path.read_bytes() for path in run.iterdir()}
    (run / "report.html").unlink()
    ended = cli("report", run)
    assert ended.code == 0, ended.err
    assert "INFEASIBLE: " in ended.out
    assert {path.name: path.read_bytes() for path in run.iterdir()} == before


def test_a_finished_run_is_previewed(infeasible, cli, here):
    _, folder = infeasible
    (run,) = (folder / "runs").iterdir()
    assert cli("preview", run, "-o", here / "page.html").code == 0
    page = (here / "page.html").read_text(encoding="utf-8")
    assert "<p>INFEASIBLE: the fully solid part already breaks a limit" in page
    scene = json.loads((run / "scene.json").read_text(encoding="utf-8"))
    assert [view["id"] for view in scene["views"]] == ["cells", "case"]
    (run / "scene.json").rename(here / "scene.json")
    ended = cli("preview", run, "-o", here / "page.html")
    (here / "scene.json").rename(run / "scene.json")
    assert ended.code == 2
    assert "holds no scene.json" in ended.err
    assert cli("report", here).code == 2


def test_json_is_the_result(cli, here):
    ended = cli("run", CASES / "infeasible", "-o", here / "run", "--json")
    assert ended.code == 4
    printed = json.loads(ended.out)
    written = json.loads((here / "run" / "result.json").read_text(encoding="utf-8"))
    assert printed == written
    again = cli("run", CASES / "infeasible", "-o", here / "run")
    assert again.code == 2
    assert "--resume" in again.err
    assert "--overwrite" in again.err
    assert cli("run", CASES / "infeasible", "-o", here / "run", "--overwrite").code == 4
    both = cli("run", CASES / "infeasible", "-o", here / "run", "--overwrite", "--resume")
    assert both.code == 2


def test_loads_that_cancel_are_shown_without_rounding_noise(cli, here):
    trimesh.creation.annulus(r_min=8, r_max=16, height=20, sections=37).export(here / "ring.stl")
    (here / "case.toml").write_text(
        """
        [case]
        name = "ring"
        [part]
        file = "ring.stl"
        units = "mm"
        [region.bore]
        cylinder = {diameter = "16 mm"}
        [region.foot]
        plane = "z = min"
        [material]
        name = "316L"
        [[load_case]]
        name = "burst"
        fix = [{region = "foot"}]
        load = [{region = "bore", pressure = "3.7 MPa"}]
        [limits]
        safety_factor = 1.5
        [lattice]
        cell = "sc"
        size = "8 mm"
        """,
        encoding="utf-8",
    )
    printed = cli("check", here).out
    loads = printed[printed.index("Loads\n") : printed.index("free rigid motions")]
    (bore,) = [line.split() for line in loads.splitlines() if " bore " in line]
    assert " ".join(bore) == "burst bore (0, 0, 0) (0, 0, 0)"


@pytest.mark.usefixtures("drawn")
def test_check_says_what_a_run_would_do(cli, here):
    ended = cli("check", CASES / "mini")
    assert ended.code == 0
    assert "24 x 12 x 12 mm, 3456 mm^3" in ended.out
    assert "free rigid motions: none" in ended.out
    assert [p for p in here.rglob("*") if p.is_file()] == [here / "runs/mini-check/loads.png"]
    # The folder of a run is not touched: the run itself would refuse what it does not know.
    assert not (here / "runs" / "mini").exists()
    data = json.loads(cli("check", CASES / "mini", "--json", "-o", here / "mine.png").out)
    assert data["picture"] == str(here / "mine.png")
    assert (here / "mine.png").is_file()
    # The box of 24 x 12 x 12 mm: its end faces.
    assert [(r["name"], r["area_mm2"]) for r in data["regions"]] == [
        ("root", pytest.approx(144.0)),
        ("tip", pytest.approx(144.0)),
    ]
    assert data["regions"][1]["centroid_mm"] == pytest.approx([24.0, 6.0, 6.0])
    assert data["prediction"]["explicit_dofs"] > 10 * data["prediction"]["part_dofs"]


def test_cells_lists_families_with_window_and_source(cli, monkeypatch):
    # Cell has tests of its own and takes seconds per family.
    monkeypatch.setattr(list_module, "known_window", lambda _: [0.1, 0.6])
    families = {f["name"]: f for f in json.loads(cli("cells", "--json").out)}
    assert {"gyroid-sheet", "diamond-network", "primitive-wall"} <= set(families)
    for family in families.values():
        assert family["density_window"] == [0.1, 0.6]
        assert family["supplied_by"]
        assert family["source"]
    table = cli("cells").out
    assert all(name in table for name in families)
    assert "not computed yet" not in table


def test_a_list_computes_nothing(cli, here, monkeypatch):
    # 135 calibrations take many minutes
    monkeypatch.setenv("XDG_CACHE_HOME", str(here))
    monkeypatch.setattr(list_module, "calibrate", None)
    families = json.loads(cli("cells", "--json").out)
    known = {f["name"]: f for f in families}
    # Its shipped table covers less than the densities at which the cell exists.
    gyroid = known["gyroid-sheet"]
    table = next(k for k in gyroid["laws"] if k["name"] == "gyroid-sheet-computed")
    assert gyroid["density_window"] == table["window"]
    assert gyroid["density_window_of"] == "law"
    assert known["random-spheres"]["density_window"] is None
    assert {f["density_window_of"] for f in families} == {"law", None}
    listed = cli("cells").out
    # The list is wider than 80 columns: a block for every cell.
    lines = [line.split() for line in listed.splitlines()]
    shown = lines[lines.index(["cell", "gyroid-sheet"]) + 1]
    assert " ".join(shown[1:]) == f"{table['window'][0]:.3f} to {table['window'][1]:.3f} *"
    assert "the cell itself may reach further" in listed
    assert "'gradedesign cells NAME'" in listed


def test_a_window_is_calibrated_once(here, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(here))
    family = build_registry().cell_families["primitive-sheet"]
    assert list_module.known_window(family) is None
    found = list_module.density_window(family)
    assert found == list_module.known_window(family)
    assert found == [round(v, 4) for v in calibrate(family).window]
    monkeypatch.setattr(list_module, "calibrate", None)
    assert list_module.density_window(family) == found
    changed = dataclasses.replace(family, shape=lambda u: family.shape(u) ** 2)
    with pytest.raises(TypeError):
        list_module.density_window(changed)


def test_one_cell_in_full(cli):
    ended = cli("cells", "gyroid-sheet")
    assert "supplied by gradedesign-cells-tpms" in ended.out
    assert "law ramirez-2022-gyroid-4x4x4" in ended.out
    law = next(
        law
        for law in json.loads(cli("cells", "gyroid-sheet", "--json").out)["laws"]
        if law["name"] == "ramirez-2022-gyroid-4x4x4"
    )
    # Ramirez Salazar 2022, table 4.1: E / E0 = 0.402 rho^1.176.
    assert (law["coefficients"]["c1"], law["coefficients"]["n1"]) == (0.402, 1.176)
    wrong = cli("cells", "gyroid-shet")
    assert wrong.code == 2
    assert 'did you mean "gyroid-sheet"?' in wrong.err


def test_materials_have_values_and_sources(cli):
    data = json.loads(cli("materials", "--json").out)
    assert len(data) >= 10
    assert all(m["source"] and m["yield_strength_MPa"] > 0 for m in data)
    table = cli("materials").out
    assert all(m["name"] in table for m in data)


def test_doctor_knows_its_house(cli):
    data = json.loads(cli("doctor", "--json").out)
    assert data["versions"]["gradedesign"]
    assert data["cores"] >= 1
    assert any(p.startswith("gradedesign-cells-tpms") for p in data["plugins"])
    assert "cache: " in cli("doctor").out


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["bogus"], "bogus"),
        (["run"], "Missing argument"),
        (["run", "x.toml", "--bogus"], "--bogus"),
        (["run", "absent.toml"], "absent.toml: no such case file"),
        (["validate", "absent"], "absent"),
    ],
)
def test_usage_errors_end_with_2(cli, words, named):
    ended = cli(*words)
    assert ended.code == 2
    assert named in ended.err
    assert "Traceback" not in ended.err


#: Design, section 6.
CODES = {
    CaseError: 2,
    PartError: 3,
    LatticeError: 3,
    ResourceError: 5,
    MeshError: 6,
    SolverError: 6,
    DensityError: 6,
    PluginError: 7,
    GradeDesignError: 70,
    MemoryError: 5,
    KeyboardInterrupt: 130,
    ZeroDivisionError: 70,
}


@pytest.mark.parametrize("error", CODES, ids=lambda e: e.__name__)
def test_every_error_has_its_exit_code(cli, monkeypatch, error):
    def fail(*args, **options):
        raise error("something of 3 mm")

    monkeypatch.setattr(list_module, "materials", fail)
    ended = cli("materials")
    assert ended.code == CODES[error]
    assert ("Traceback" in ended.err) is (error is ZeroDivisionError)
    if issubclass(error, GradeDesignError):
        assert ended.err == "error: something of 3 mm\n"
        assert "Traceback" in cli("--debug", "materials").err


def test_a_full_disk_is_a_matter_of_resources(cli, monkeypatch):
    def fail(*args, **options):
        raise OSError(28, "No space left on device", "x")

    monkeypatch.setattr(list_module, "materials", fail)
    assert cli("materials").code == 5


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_says_how_to_go_on(cli, monkeypatch, here, number):
    def run(*args, **options):
        os.kill(os.getpid(), number)
        time.sleep(10)

    monkeypatch.setattr(run_module, "run_case", run)
    ended = cli("run", CASES / "infeasible")
    assert ended.code == 130
    assert "--resume" in ended.err


def test_help_loads_no_computation(here):
    """It has to come at once, so it may not wait for numpy, numba or scikit-fem."""
    program = """
import sys
from gradedesign.program.commands import main
try:
    main(["--help"])
except SystemExit:
    loaded = {"numpy", "numba", "skfem", "pydantic", "gradedesign.design.case"} & set(sys.modules)
    print("loaded:", sorted(loaded))
"""
    words = [sys.executable, "-c", program]
    ended = subprocess.run(words, capture_output=True, text=True, timeout=120, check=True)
    assert "loaded: []" in ended.stdout
    assert "homogenise" in ended.stdout


def test_output_into_a_closed_pipe_ends_quietly(here):
    command = f"{sys.executable} -m gradedesign materials | true"
    ended = subprocess.run(
        ["bash", "-o", "pipefail", "-c", command],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert ended.stderr == ""


@pytest.mark.parametrize("name", ["a" * 300, "abc/" * 2000, "a\0b", "x/" + "b" * 300])
@pytest.mark.parametrize(
    "words",
    [
        ("run", CASES / "infeasible", "-o"),
        ("tabulate", "bcc", "-o"),
        ("sweep", CASES.parent / "docs" / "tutorial" / "study.toml", "-o"),
        ("sweep",),
        ("check",),
        ("validate",),
    ],
    ids=lambda words: words[0],
)
def test_impossible_places_are_usage_errors(cli, here, words, name):
    ended = cli(*words, name)
    assert ended.code == 2
    assert "Traceback" not in ended.err


def test_names_of_cases_are_no_paths(cli, here):
    for name, folder in {
        "bracket": "bracket",
        "../../etc": "etc",
        "a b/c": "a-b-c",
        "Träger": "Träger",
        "..": "case",
    }.items():
        assert default_folder(name) == Path("runs") / folder


@pytest.mark.parametrize("content", ["none", "no manifest", "results"])
def test_only_a_mere_failure_is_replaced_unasked(here, content):
    folder = here / "run"
    if content != "none":
        folder.mkdir()
        (folder / "result.json").write_text('{"status": "failed"}')
    if content == "results":
        entry = {"sha256": "", "bytes": 0}
        artefacts = {"result.json": entry, "lattice.stl": entry}
        (folder / "run.json").write_text(
            json.dumps({"schema": 1, "case_hash": "x", "artefacts": artefacts})
        )
    assert not holds_only_a_failure(folder)


def test_the_api_is_the_same_pipeline(here):
    events = []
    case = gradedesign.load_case(CASES / "infeasible")
    result = gradedesign.run(case, folder=here / "api", on_event=events.append)
    assert result.status == "infeasible"
    assert [e.stage for e in events if e.message == "done"] == ["part", "solid", "output"]
    assert (here / "api" / "report.html").is_file()


def test_importing_the_package_stays_light():
    code = (
        "import sys, gradedesign; "
        "print(*{'skfem', 'vtk', 'pyvista', 'numba', 'pydantic', 'pyamg'} & set(sys.modules))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
    )
    assert done.stdout.split() == []
    with pytest.raises(AttributeError, match="no attribute 'runn'"):
        _ = gradedesign.runn


@pytest.mark.parametrize("options", [(), ("--json",)])
def test_loading_that_takes_long_is_told(cli, monkeypatch, options):
    monkeypatch.setattr(loading, "EVERY", 0.05)

    def command(*_, on_loaded, **__):
        time.sleep(0.3)
        on_loaded()
        time.sleep(0.2)
        return 0

    monkeypatch.setattr(run_module, "run", command)
    # The text is read before anything is loaded.
    monkeypatch.setattr(
        "gradedesign.design.case.read_case.require_case_text", lambda *_, **__: None
    )
    ended = cli("run", "case", *options)
    told, silent = (ended.err, ended.out) if options else (ended.out, ended.err)
    lines = told.splitlines()
    assert 2 <= len(lines) <= 6  # of 0.3 s, none of the time after
    assert lines[0] == "start       loading the program and its plugins, 0 s"
    assert silent == ""


def test_the_end_of_a_command_looks_for_no_cycles():
    """The last look through all objects is most of the time between the last line and the end."""
    code = (
        "import atexit, gc, sys; from gradedesign.program.commands import main; "
        "atexit.register(lambda: print('frozen', gc.get_freeze_count() > 10_000)); "
        "main(['--version'])"
    )
    ended = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=120
    )
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.splitlines()[-1] == "frozen True"
