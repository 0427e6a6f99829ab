"""`gradedesign sweep`: studies, their tables and trade-offs, with a stand-in for each run."""

from __future__ import annotations

import csv
import json
import tomllib
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import pytest
from matplotlib.image import imread
from numba import get_num_threads
from small_parts import SHORT_BAR

from gradedesign import load_case
from gradedesign.common.values.toml_text import toml_text
from gradedesign.design.verdict.result import RunResult
from gradedesign.errors import LatticeError, ResourceError
from gradedesign.mechanics.limits.banded import Banded
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.program.commands import on_dask
from gradedesign.program.outputs.failed import recording_failure
from gradedesign.program.outputs.files import write_result
from gradedesign.program.outputs.finished import finished_result
from gradedesign.program.pictures.figure import save_figure
from gradedesign.program.store.stages import open_stages
from gradedesign_sweep import run_sweep as module
from gradedesign_sweep.non_dominated import non_dominated
from gradedesign_sweep.table import DesignRow, LimitValue, limit_value
from gradedesign_sweep.tradeoff_plot import TradeoffPoint, mass_unit, tradeoff_figure

BASE = (
    SHORT_BAR
    + """
[[load_case]]
name = "push & pull"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-100 N"]}]
[limits]
displacement = [{region = "tip", magnitude = "0.5 mm"}]
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = [0.45, 0.60]
"""
)

STUDY = """
[study]
name = "bar study"
case = "case.toml"
[vary]
"lattice.cell" = ["gyroid-sheet", "bcc"]
"lattice.size" = ["4 mm", "8 mm"]
"""


@pytest.fixture
def folder(tmp_path):
    """A folder with the base case; `study` writes a study beside it."""
    (tmp_path / "case.toml").write_text(BASE, encoding="utf-8")
    return tmp_path


def study(folder, text=STUDY):
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return path


def limit(value, allowed=0.5):
    return LimitRow(
        key=LimitKey(kind="displacement", region="tip", component="magnitude"),
        name="displacement of tip magnitude",
        load_case="push & pull",
        value=value,
        limit=allowed,
        unit="mm",
        judged_by="a stand-in",
    )


@pytest.fixture
def stand_in(monkeypatch):
    """A run that takes no time: the mass by cell and size; bcc of 4 mm fails."""
    ran = []

    def run(case, registry, *, folder, resume):
        assert resume
        with open_stages(folder, case.case_hash, resume=True, overwrite=False) as out:
            done = finished_result(out, case.run)
            assert done is None, "a finished design was run again"
            ran.append((case.lattice.cell, *case.lattice.size))
            with recording_failure(out, case, registry, dict):
                if ran[-1] == ("bcc", 4.0):
                    raise LatticeError("struts of\n 0.1 mm are too thin; take larger cells")
            mass = {"gyroid-sheet": 2.0, "bcc": 3.0}[case.lattice.cell] / case.lattice.size[0]
            result = RunResult(
                status="met",
                lightest=True,
                reason="it holds",
                ended_by="tight",
                mass_g=mass,
                solid_mass_g=4.0,
                relative_density=mass / 4.0,
                limits=(limit(0.49 if case.lattice.cell == "bcc" else 0.4),),
                case_hash=case.case_hash,
                case_name=case.name,
                folder=out.path,
            )
            write_result(out, result)
            return result

    monkeypatch.setattr(module, "run_case", run)
    return ran


def rows_of(folder):
    with (folder / "table.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_every_design_is_a_row_in_the_order_of_the_study(cli, stand_in, folder):
    out = folder / "out"
    ended = cli("sweep", study(folder), "-o", out, "--workers", "1")
    assert ended.code == 0
    assert stand_in == [("gyroid-sheet", 4.0), ("gyroid-sheet", 8.0), ("bcc", 4.0), ("bcc", 8.0)]
    rows = rows_of(out)
    assert [row["design"] for row in rows] == ["1", "2", "3", "4"]
    assert [row["lattice.cell"] for row in rows] == ["gyroid-sheet"] * 2 + ["bcc"] * 2
    assert [row["status"] for row in rows] == ["met", "met", "failed", "met"]
    # By the stand-in: 2/4, 2/8, none, 3/8.
    assert [row["mass [g]"] for row in rows] == ["0.5", "0.25", "", "0.375"]
    assert [row["utilisation of displacement of tip magnitude [-]"] for row in rows] == [
        "0.8", "0.8", "", "0.98",
    ]  # fmt: skip
    assert rows[2]["error"] == "struts of 0.1 mm are too thin; take larger cells"
    assert [row["non-dominated"] for row in rows] == ["0", "1", "0", "0"]
    assert list(rows[0])[-1] == "time [s]"
    data = json.loads((out / "table.json").read_text(encoding="utf-8"))
    assert data["keys"] == ["lattice.cell", "lattice.size"]
    assert [d["mass_g"] for d in data["designs"]] == [0.5, 0.25, None, 0.375]
    assert data["designs"][3]["limits"] == [
        {
            "name": "displacement of tip magnitude",
            "value": 0.49,
            "limit": 0.5,
            "unit": "mm",
            "utilisation": 0.98,
        }
    ]
    assert imread(BytesIO((out / "tradeoff.png").read_bytes())).ndim == 3
    assert max(map(len, ended.out.replace(str(out), "out").splitlines())) <= 80
    assert "design 3 failed: struts of 0.1 mm are too thin" in " ".join(ended.out.split())
    assert not [p for p in out.iterdir() if p.name.startswith(".")]


def test_finished_designs_are_not_run_again_whatever_the_study_became(cli, stand_in, folder):
    out = folder / "out"
    assert cli("sweep", study(folder), "-o", out, "--workers", "1").code == 0
    first = (out / "table.csv").read_text(encoding="utf-8")
    del stand_in[:]
    again = cli("sweep", study(folder), "-o", out, "--workers", "1")
    assert "3 of 4 designs are finished already" in again.out
    assert stand_in == [("bcc", 4.0)]  # what failed is tried again
    assert (out / "table.csv").read_text(encoding="utf-8").splitlines()[1] == first.splitlines()[1]
    del stand_in[:]
    longer = STUDY.replace('["4 mm", "8 mm"]', '["8.0 mm", "16 mm"]')
    cli("sweep", study(folder, longer), "-o", out, "--workers", "1")
    assert stand_in == [("gyroid-sheet", 16.0), ("bcc", 16.0)]
    assert [row["mass [g]"] for row in rows_of(out)] == ["0.25", "0.125", "0.375", "0.1875"]


def test_a_design_is_an_ordinary_case(cli, stand_in, folder):
    part = folder / "bar.stl"
    part.write_bytes(b"solid")
    box = 'box = ["16 mm", "8 mm", "8 mm"]'
    assert box in BASE
    text = BASE.replace(box, 'file = "bar.stl"\nunits = "mm"')
    (folder / "case.toml").write_text(text, encoding="utf-8")
    out = folder / "out"
    cli("sweep", study(folder), "-o", out, "--workers", "1")
    for row in rows_of(out):
        case = load_case(out / row["folder"], allow_outside=True)
        assert case.part.file == part
        assert case.case_hash.startswith(row["folder"].removeprefix("designs/"))
        assert f"{case.lattice.size[0]:g} mm" == row["lattice.size"]
        assert load_case(folder / "case.toml").load_case == case.load_case


def test_rows_of_values_that_belong_together(cli, stand_in, folder):
    text = """
[study]
name = "rows"
case = "case.toml"
[vary]
"limits.displacement[0].magnitude" = ["0.5 mm", "0.6 mm"]
[[design]]
"lattice.cell" = "bcc"
"lattice.density" = [0.2, 0.4]
[[design]]
lattice.cell = "gyroid-sheet"
print.min_wall = "0.1 mm"
"""
    out = folder / "out"
    assert cli("sweep", study(folder, text), "-o", out, "--workers", "1").code == 0
    rows = rows_of(out)
    key = "limits.displacement[0].magnitude"
    assert [(row["lattice.cell"], row[key], row["lattice.density"]) for row in rows] == [
        ("bcc", "0.5 mm", "[0.2, 0.4]"), ("bcc", "0.6 mm", "[0.2, 0.4]"),
        ("gyroid-sheet", "0.5 mm", ""), ("gyroid-sheet", "0.6 mm", ""),
    ]  # fmt: skip
    case = load_case(out / rows[2]["folder"])
    assert (case.print.min_wall, case.lattice.density) == (0.1, (0.45, 0.6))


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ('"lattice.cel" = ["bcc"]', 'lattice.cel: unknown key; did you mean "cell"?'),
        ('"latice.cell" = ["bcc"]', "latice: unknown table"),
        ('"lattice.size" = []', "study.toml:6: vary.lattice.size: an empty list"),
        ('"lattice.size" = "8 mm"', 'found "8 mm"; expected a list of values'),
        ('"lattice.size" = ["8 mn"]', 'design 1 (lattice.size = 8 mn)'),
        ('"lattice.size" = ["8 mm", "8.0 mm"]', "designs 1 and 2 ask for the same"),
        ('"run.time" = ["8 min", "9 min"]', "designs 1 and 2 ask for the same"),
        ('"load_case[1].name" = ["a"]', "load_case has 1 entries, counted from [0]"),
        ('"load_case.name" = ["a"]', "load_case is a list of 1; expected a table; name its entry"),
        ('"lattice.cell.name" = ["a"]', 'lattice.cell is "gyroid-sheet"; expected a table'),
        ('"lattice size" = ["a"]', '"lattice size" is no key of a case'),
        ("", "nothing to vary"),
        (f'"limits.percentile" = {list(range(1, 1002))}', "1001 designs; expected 1000 at most"),
        ('"lattice.size" = ["4 mm"]\n[[design]]\nlattice.size = "8 mm"', "is in [vary] too"),
        ('"lattice.size" = ["4 mm"]\n[[design]]', "an empty table"),
        ('"lattice.size" = ["4 mm"]\n[varied]', 'varied: unknown key; did you mean "vary"?'),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_study_is_told_before_anything_runs(
    cli, stand_in, folder, wrong, words
):
    text = f'\n[study]\nname = "s"\ncase = "case.toml"\n[vary]\n{wrong}\n'
    ended = cli("sweep", study(folder, text), "-o", folder / "out")
    assert ended.code == 2
    assert words in " ".join(ended.err.split())
    assert "study.toml" in ended.err
    assert stand_in == []
    assert not (folder / "out").exists()


def test_the_study_of_the_docs_is_one():
    path = Path(__file__).parents[3] / "docs" / "tutorial" / "study.toml"
    designs = module.load_study(path, module.build_registry()).designs
    assert [d.label for d in designs] == [
        "gyroid-sheet, 8 mm", "gyroid-sheet, 12 mm", "bcc, 8 mm", "bcc, 12 mm",
    ]  # fmt: skip
    assert [d.case.lattice.size for d in designs] == [(8.0,), (12.0,)] * 2


CASES = Path(__file__).parents[3] / "cases"


@pytest.mark.parametrize(
    ("path", "count"),
    [
        ("engine-bracket/study.toml", 2),
        ("ramirez-cantilever/mesh.toml", 6),
        ("ramirez-whole/grading.toml", 2),
    ],
)
def test_studies_of_the_cases_are_read(path, count):
    assert len(module.load_study(CASES / path, module.build_registry()).designs) == count


def test_the_beam_is_graded_in_two_ways():
    path = CASES / "ramirez-whole" / "grading.toml"
    lattices = [
        design.case.lattice for design in module.load_study(path, module.build_registry()).designs
    ]
    assert [(each.cell, each.grading, each.size) for each in lattices] == [
        ("gyroid-sheet", "ratio", (40.0, 50.0)),
        ("gyroid-wall", "thickness", (50.0,)),
    ]


def test_files_and_folders_that_are_none(cli, stand_in, folder):
    assert "no such file" in cli("sweep", folder / "none.toml").err
    missing = study(folder, STUDY.replace('"case.toml"', '"base.toml"'))
    assert 'did you mean "case.toml"?' in cli("sweep", missing, "-o", folder / "out").err
    ended = cli("sweep", study(folder), "-o", folder)
    assert ended.code == 2
    assert "not the folder of a sweep" in ended.err
    assert stand_in == []


def test_a_sweep_of_nothing_but_failures_has_their_exit_code(cli, folder, monkeypatch):
    def run(case, registry, *, folder, resume):
        raise ResourceError("no memory")

    monkeypatch.setattr(module, "run_case", run)
    out = folder / "out"
    ended = cli("sweep", study(folder), "-o", out, "--workers", "1", "--json")
    assert ended.code == ResourceError.exit_code
    data = json.loads(ended.out)
    assert [d["status"] for d in data["designs"]] == ["failed"] * 4
    assert not (out / "tradeoff.png").exists()


def test_an_unforeseen_error_is_a_row(cli, folder, monkeypatch):
    def run(case, registry, *, folder, resume):
        raise ZeroDivisionError("somewhere")

    monkeypatch.setattr(module, "run_case", run)
    out = folder / "out"
    assert cli("sweep", study(folder), "-o", out, "--workers", "1").code == 70
    assert {r["error"] for r in rows_of(out)} == {"internal error: ZeroDivisionError('somewhere')"}


def test_memory_side_by_side_is_told_and_chooses_the_workers(cli, stand_in, folder, monkeypatch):
    class Memory:
        total = 20_000_000_000

    monkeypatch.setattr(module.psutil, "virtual_memory", Memory)
    monkeypatch.setattr(module, "usable_cores", lambda: 16)
    monkeypatch.setattr(module, "has_dask", lambda: True)
    designs = module.load_study(study(folder), module.build_registry()).designs
    # 8 GB each by default: two fit into 20 GB.
    assert module.default_workers(designs) == 2
    monkeypatch.setattr(on_dask, "find_spec", lambda _: None)
    ended = cli("sweep", study(folder), "-o", folder / "out", "--workers", "3")
    told = " ".join(ended.out.split())
    assert "3 designs side by side may take [run] memory of 24 GB together" in told
    assert "this machine has 20 GB" in told
    assert "pip install distributed" in ended.err


@pytest.mark.parametrize(("asked", "given"), [(1, 1), (None, "all"), (10_000, "all")])
def test_threads_of_a_computation(asked, given):
    everything = get_num_threads()
    expected = everything if given == "all" else given
    assert on_dask.with_threads(asked, get_num_threads) == expected
    assert get_num_threads() == everything


def row(number, mass, **limits):
    """A design whose limits are given as (value, allowed)."""
    return DesignRow(
        number=number,
        label=f"design {number}",
        values={},
        status="met",
        folder="",
        mass_g=mass,
        limits={
            name: LimitValue(value=v, limit=a, unit="mm", utilisation=v / a, severity=v)
            for name, (v, a) in limits.items()
        },
    )


def test_a_limit_counts_by_the_unfavourable_end_of_its_band():
    band = Banded(low=0.3, value=0.4, high=0.55)
    high = limit_value(replace(limit(0.4), band=band))
    # 0.55 of 0.5 mm: broken, though the value itself holds.
    assert (high.value, high.severity) == (0.4, 0.55)
    assert high.utilisation == pytest.approx(1.1)
    low = limit_value(replace(limit(0.4), band=band, unfavourable="low"))
    assert (low.severity, low.utilisation) == pytest.approx((1 / 0.3, 0.5 / 0.3))


def test_designs_that_no_other_one_beats():
    light, stiff = row(1, 1.0, u=(0.9, 1.0)), row(2, 2.0, u=(0.5, 1.0))
    worse, equal = row(3, 2.0, u=(0.95, 1.0)), row(4, 1.0, u=(0.9, 1.0))
    broken, unknown = row(5, 0.1, u=(1.1, 1.0)), row(6, None)
    assert non_dominated([light, stiff, worse, equal, broken, unknown]) == {1, 2, 4}
    # Where a lightest design ends between 97 and 100 % of its limit is chance.
    assert non_dominated([row(1, 1.0, u=(0.99, 1.0)), row(2, 1.1, u=(0.975, 1.0))]) == {1}
    # A wider limit makes its use smaller, not the design better.
    assert non_dominated([row(1, 2.0, u=(0.9, 1.0)), row(2, 1.0, u=(1.6, 2.0))]) == {1, 2}
    # A weaker material: less stress, and more of what is allowed.
    assert non_dominated([row(1, 2.0, s=(90.0, 100.0)), row(2, 1.0, s=(60.0, 61.0))]) == {1, 2}
    # Of other limits: not comparable.
    assert non_dominated([row(1, 2.0, u=(0.9, 1.0)), row(2, 1.0, s=(0.1, 1.0))]) == {1, 2}


def test_the_plot_of_many_designs_in_many_panels(tmp_path):
    limits = ["displacement of tip magnitude", "stress in lattice", "buckling of cells"]
    points = [
        TradeoffPoint(
            number=k,
            label=f"cell {k % 7}, {k} mm",
            group=f"cell {k % 7}",
            mass_g=10.0 + k % 11,
            utilisation={name: 0.9 + 0.002 * k for name in limits},
            marked=k % 3 == 0,
        )
        for k in range(60)
    ]
    figure = tradeoff_figure(points, limits, title="many", note="60 designs")
    save_figure(tmp_path / "plot.png", figure)
    picture = imread(BytesIO((tmp_path / "plot.png").read_bytes()))[:, :, :3]
    assert picture.shape[1] > 1.4 * picture.shape[0]
    assert 0.01 < (picture.min(axis=2) < 0.9).mean() < 0.5


def test_the_plot_of_more_cells_than_colours(tmp_path):
    """The list beside the panels ends within the picture, which its lowest rows show white."""
    points = [
        TradeoffPoint(
            number=k,
            label=f"cell {k}",
            group=f"cell {k}",
            mass_g=2e4 + 1e3 * k,
            utilisation={"stress": 1.0 - 0.01 * k},
            marked=k % 9 == 0,
        )
        for k in range(86)
    ]
    assert mass_unit(points) == ("kg", 1e-3)
    assert mass_unit(points[:0]) == ("g", 1.0)
    figure = tradeoff_figure(points, ["stress"], title="many", note="")
    save_figure(tmp_path / "plot.png", figure)
    picture = imread(BytesIO((tmp_path / "plot.png").read_bytes()))[:, :, :3]
    rows, columns = picture.shape[:2]
    right = picture[:, int(0.65 * columns) :]
    assert (right[: rows // 2] < 0.9).any()
    assert (right[int(0.9 * rows) :] == 1.0).all()


@pytest.mark.parametrize(
    "data",
    [
        {"a": 1, "b.c": [True, -2.5, 1e300, "x"], "": {}},
        {"t": {"text": 'quote " back \\ tab \t line \n del \x7f bell \a é'}, "more": {"e": []}},
        {"list": [{"x": {"y": [{"z": 1}, {}]}}, {}], "mixed": [1, {"k": "v"}], "last": {"i": 2}},
        {"first": {"in": {"side": {"deep": "x"}}}, "plain": float("inf")},
    ],
)
def test_a_written_case_is_read_as_it_was(data):
    assert tomllib.loads(toml_text(data)) == data
