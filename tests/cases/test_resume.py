"""A run that is killed goes on from its last finished stage and reaches the same status."""

import json
import signal
import subprocess
import sys
import time

import pytest
from small_parts import SHORT_BAR

from gradedesign import pipeline
from gradedesign.errors import LatticeError
from gradedesign.program.store.run_folder import open_run_folder

#: A box of two thick-walled cells whose limit no density can hold, which the first iteration cannot
#: know without size effects: two iterations, no acceptance.
CASE = (
    SHORT_BAR
    + """
[[load_case]]
name = "shear"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-100 N"]}]
[limits]
displacement = [{region = "tip", magnitude = "0.012 mm"}]
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
phases = ["lattice"]
density = [0.45, 0.60]
size_effects = false
[run]
max_iterations = 2
price = false
elements_per_wall = 1.0
[output]
formats = ["report"]
"""
)


def command(folder, *options):
    return [
        *(sys.executable, "-m", "gradedesign", "run", str(folder)),
        *("-o", str(folder / "run"), *options),
    ]


def start_and_kill(folder, stage, number):
    """Start a run and kill it as soon as a stage is stored; what it had printed."""
    process = subprocess.Popen(
        command(folder),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    try:
        deadline = time.monotonic() + 300
        while not (folder / "run" / "stages" / stage).is_file():
            assert process.poll() is None, process.communicate()[0]
            assert time.monotonic() < deadline
            time.sleep(0.02)
        time.sleep(0.3)
    finally:
        process.send_signal(number)
        printed, _ = process.communicate(timeout=120)
    return process.returncode, printed


@pytest.mark.parametrize(
    "number",
    [
        pytest.param(signal.SIGKILL, id="kill"),
        pytest.param(signal.SIGTERM, id="terminate", marks=pytest.mark.slow),
    ],
)
def test_a_killed_run_resumes(tmp_path, number):
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    code, printed = start_and_kill(tmp_path, "iteration-1.npz", number)
    if number == signal.SIGKILL:
        assert code == -signal.SIGKILL
    else:
        assert code == 130
        assert "--resume" in printed
    run = tmp_path / "run"
    assert not (run / "result.json").exists()
    first = (run / "stages" / "iteration-1.npz").read_bytes()

    refused = subprocess.run(command(tmp_path), capture_output=True, text=True, check=False)
    assert refused.returncode == 2
    assert "--resume" in refused.stderr
    if number == signal.SIGTERM:
        return

    resumed = subprocess.run(
        command(tmp_path, "--resume"), capture_output=True, text=True, check=False, timeout=600
    )
    # By construction no design holds the limit: the status that a whole run reaches.
    assert resumed.returncode == 4, resumed.stderr
    assert "iteration 1 (resumed)" in resumed.stdout
    assert "iteration 2:" in resumed.stdout
    result = json.loads((run / "result.json").read_text(encoding="utf-8"))
    assert result["status"] == "not_met"
    assert [it["number"] for it in result["iterations"]] == [1, 2]
    # Walls get thicker, but the correction of the first iteration holds on its own grid only.
    assert result["iterations"][1]["mean_density"] > result["iterations"][0]["mean_density"]
    assert result["iterations"][1]["spacing_mm"] <= result["iterations"][0]["spacing_mm"]
    assert (run / "stages" / "iteration-1.npz").read_bytes() == first
    assert not [p.name for p in run.iterdir() if p.name.startswith(".")]
    with open_run_folder(run, result["case_hash"], resume=True, overwrite=False) as folder:
        assert folder.damaged_artefacts() == ()


def one_line(text):
    """What was printed, whatever the width it was wrapped to."""
    return " ".join(text.split())


def test_a_run_whose_surface_cannot_be_written_keeps_its_rows(cli, tmp_path, monkeypatch):
    def open_surface(*_):
        raise LatticeError("the surface does not close")

    monkeypatch.setattr(pipeline, "export_surface", open_surface)
    text = CASE.replace("[run]", '[run]\ntime = "1 s"')
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    run = tmp_path / "run"
    failed = cli("run", tmp_path, "-o", run)
    assert failed.code == LatticeError.exit_code
    result = json.loads((run / "result.json").read_text(encoding="utf-8"))
    assert (result["status"], len(result["iterations"])) == ("failed", 1)
    assert result["reason"].startswith("the surface does not close; the limits are those of it")
    (row,) = (row for row in result["limits"] if row["name"].startswith("displacement of tip"))
    assert row["value"] > 0.0
    report = (run / "report.html").read_text(encoding="utf-8")
    assert row["name"] in report
    assert "the limits are those of iteration 1 by its explicit analysis" in report


def test_a_run_that_time_ended_goes_on_with_more_of_it_and_then_no_further(
    cli, tmp_path, monkeypatch
):
    prepare, budgets = pipeline.prepare, []

    def prepared(case, *more):
        budgets.append(case.run.time)
        return prepare(case, *more)

    began, priced, deadlines = time.monotonic(), pipeline._priced, []

    def price(*given):
        deadlines.append(given[-1])
        return priced(*given)

    monkeypatch.setattr(pipeline, "prepare", prepared)
    monkeypatch.setattr(pipeline, "_priced", price)
    case = tmp_path / "case.toml"
    text = CASE.replace("[run]", '[run]\ntime = "1 s"').replace("price = false", "")
    case.write_text(text, encoding="utf-8")
    run = tmp_path / "run"
    short = cli("run", tmp_path, "-o", run)
    assert short.code == 4, short.err
    assert "[run] time of 1 s ended the run after 1 iteration; about" in one_line(short.out)
    assert "more allow another iteration" in one_line(short.out)
    result = json.loads((run / "result.json").read_text(encoding="utf-8"))
    assert (result["ended_by"], len(result["iterations"])) == ("time", 1)
    solid, *others = result["bodies"]
    assert (solid["mass_g"], solid["note"]) == (result["solid_mass_g"], "")
    assert {body["note"] for body in others} == {"left out: 0 of 1 s of [run] time are left"}
    # Its iterations are in the clock of this process, and are not counted again.
    assert [deadline.start >= began for deadline in deadlines] == [True]
    # No acceptance judged it: bands come from two resolutions of the explicit analysis.
    (row,) = result["limits"]
    assert row["decisive"] == row["band"]["high"] > row["value"]
    # Of the tractions out of balance follows what the iteration's own value lacks.
    explicit = result["iterations"][0]["limits"][0]["explicit"]
    assert row["band"]["low"] < explicit < row["value"]
    coarse, fine = row["band"]["sizes_mm"]
    assert coarse > 1.05 * fine
    off = result["printed"]["comparison"]["volume_difference"]
    assert f"from which the file differs by {off:+.1%} in volume and mass" in result["reason"]
    assert set(result["predicted"]) == {"at_start", "after_first_iteration"}
    # Parts of the iteration, as the prediction has them.
    assert {"sizing", "explicit mesh", "explicit solve"} <= set(result["timing_s"])

    assert "nothing is run" in one_line(cli("run", tmp_path, "-o", run, "--resume").out)

    # Without other bodies it is the same case.
    case.write_text(CASE, encoding="utf-8")
    longer = cli("run", tmp_path, "-o", run, "--resume")
    assert longer.code == 4
    assert "iteration 1 (resumed)" in longer.out
    # More time would let the lower density fall, and iterations would be of two lattices.
    assert budgets == [1.0, 1.0]
    assert "this lattice cannot reach the limit on displacement of tip magnitude" in one_line(
        longer.out
    )
    assert "[[keep]]" not in longer.out, "the loaded face has its plate"
    result = json.loads((run / "result.json").read_text(encoding="utf-8"))
    assert (result["ended_by"], len(result["iterations"])) == ("saturated", 2)

    before = (run / "run.json").read_bytes()
    again = cli("run", tmp_path, "-o", run, "--resume")
    assert (again.code, "nothing is run" in again.out) == (4, True)
    assert result["reason"] in one_line(again.out)
    # The date is that of the result, and no part of what tells the cases apart.
    assert json.loads((run / "result.json").read_text(encoding="utf-8"))["date"] == result["date"]
    assert (run / "run.json").read_bytes() == before
