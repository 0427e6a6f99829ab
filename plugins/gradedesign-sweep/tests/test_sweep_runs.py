"""A real sweep: two workers and one process give the same table, also where it was killed."""

import csv
import json
import os
import subprocess
import sys
import time

import pytest
from small_parts import SHORT_BAR

BASE = (
    SHORT_BAR
    + """
[[load_case]]
name = "shear"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-100 N"]}]
[limits]
displacement = [{region = "tip", magnitude = "0.03 mm"}]
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = [0.30, 0.60]
[run]
stop_after = "sizing"
memory = "2 GB"
[output]
formats = ["stl"]
"""
)

#: Two cells by two limits, and a cell that nobody has.
STUDY = """
[study]
name = "bars"
case = "case.toml"
[vary]
"lattice.cell" = ["gyroid-sheet", "bcc", "no-such-cell"]
"limits.displacement[0].magnitude" = ["0.03 mm", "0.04 mm"]
"""


def command(folder, out, workers):
    words = ("sweep", str(folder / "study.toml"), "-o", str(folder / out), "--workers", workers)
    return [sys.executable, "-m", "gradedesign", *words]


def table(folder):
    """The table without its column of times."""
    with (folder / "table.csv").open(encoding="utf-8") as file:
        return [{k: v for k, v in row.items() if k != "time [s]"} for row in csv.DictReader(file)]


def finished(folder):
    """Results of the designs that ended well, by file."""
    texts = {path: path.read_bytes() for path in folder.glob("designs/*/run/result.json")}
    return {p: text for p, text in texts.items() if json.loads(text)["status"] == "partial"}


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_two_workers_killed_and_resumed_give_the_table_of_one_process(tmp_path):
    pytest.importorskip("distributed")
    (tmp_path / "case.toml").write_text(BASE, encoding="utf-8")
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    env = {**os.environ, "COLUMNS": "80"}
    one = subprocess.run(
        command(tmp_path, "one", "1"), env=env, capture_output=True, text=True, check=False
    )
    assert one.returncode == 0, one.stderr
    rows = table(tmp_path / "one")
    assert [row["status"] for row in rows] == ["partial"] * 4 + ["failed"] * 2
    assert all("no-such-cell" in row["error"] for row in rows[4:])
    # A wider limit, a lighter bar.
    masses = [float(row["mass [g]"]) for row in rows[:4]]
    assert masses[1] < masses[0]
    assert masses[3] < masses[2]

    two = tmp_path / "two"
    killed = subprocess.Popen(
        command(tmp_path, "two", "2"),
        env=env,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    deadline = time.monotonic() + 1200
    while not finished(two):
        assert killed.poll() is None, killed.communicate()[0]
        assert time.monotonic() < deadline
        time.sleep(0.05)
    killed.kill()
    killed.communicate(timeout=60)
    before = finished(two)
    assert len(before) < 4
    # As if it had been killed while it wrote its table.
    (two / f".table.csv.{16 * '0'}.unfinished").write_text("design", encoding="utf-8")

    went_on = subprocess.run(
        command(tmp_path, "two", "2"), env=env, capture_output=True, text=True, check=False
    )
    assert went_on.returncode == 0, went_on.stderr + went_on.stdout
    assert table(two) == rows
    assert f"{len(before)} of 6 designs are finished already" in went_on.stdout
    assert all(path.read_bytes() == text for path, text in before.items())
    assert (two / "tradeoff.png").read_bytes() == (tmp_path / "one" / "tradeoff.png").read_bytes()
    assert not list(two.rglob(".*"))
