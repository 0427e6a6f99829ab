"""Kill a run again and again at random times: it resumes to the same result, and leaves nothing.

Minutes, so ``-m slow`` only. ``GRADEDESIGN_KILLS`` says how often it is killed.
"""

import json
import os
import random
import shutil
import subprocess
import sys
import time

import pytest
from small_parts import SHORT_BAR

from gradedesign.program.store.run_folder import open_run_folder

KILLS = int(os.environ.get("GRADEDESIGN_KILLS", "3"))
#: Seconds after its start at which a run is killed at the latest.
LATEST_S = float(os.environ.get("GRADEDESIGN_KILL_WITHIN", "60"))

#: `mini`, smaller, with a limit that its lightest lattice holds: one iteration and its acceptance.
CASE = (
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
[run]
max_iterations = 2
stop_after = "verdict"
elements_per_wall = 1.5
acceptance = "whole"
[output]
formats = ["stl", "vtu", "report"]
"""
)


def result_of(run):
    data = json.loads((run / "result.json").read_text(encoding="utf-8"))
    return data["status"], data["lightest"], data["mass_g"], data["case_hash"]


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("stop_after", ["lattice", "verdict"])
def test_a_run_killed_at_random_times_resumes_to_the_same_result(tmp_path, stop_after):
    text = CASE.replace('"verdict"', f'"{stop_after}"')
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    scratch, cache, run = (tmp_path / name for name in ("scratch", "cache", "run"))
    scratch.mkdir()
    env = {**os.environ, "TMPDIR": str(scratch), "XDG_CACHE_HOME": str(cache)}

    def start(folder, *options):
        words = [sys.executable, "-m", "gradedesign", "run", str(tmp_path), "-o", str(folder)]
        return subprocess.Popen(
            [*words, *options],
            env=env,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )

    whole = start(tmp_path / "whole")
    printed, _ = whole.communicate()
    assert whole.returncode == 0, printed
    assert list(scratch.iterdir()) == []

    rng = random.Random(20)
    ended = 0
    for number in range(KILLS):
        if number % 2 == 0:  # the mesher is asked again
            shutil.rmtree(cache / "gradedesign" / "tetwild", ignore_errors=True)
        process = start(run, *(["--resume"] if run.exists() else []))
        wait = rng.uniform(0.3, LATEST_S)
        try:
            process.wait(wait)
        except subprocess.TimeoutExpired:
            process.kill()
        printed, _ = process.communicate()
        print(f"kill {number} at {wait:.1f} s: {process.returncode} {printed.splitlines()[-1:]}")  # noqa: T201
        assert process.returncode in (0, -9), printed
        for _ in range(200):  # the launcher of a worker looks for its parent now and then
            if not list(scratch.glob("gradedesign-worker-*")):
                break
            time.sleep(0.02)
        assert list(scratch.iterdir()) == []
        if process.returncode == 0:
            ended += 1
            assert result_of(run) == result_of(tmp_path / "whole")
            shutil.rmtree(run)

    last = start(run, *(["--resume"] if run.exists() else []))
    printed, _ = last.communicate()
    assert last.returncode == 0, printed
    assert result_of(run) == result_of(tmp_path / "whole")
    assert list(scratch.iterdir()) == []
    assert [p.name for p in run.rglob("*") if p.name.startswith(".")] == []
    whole_files = {str(p.relative_to(tmp_path / "whole")) for p in (tmp_path / "whole").rglob("*")}
    assert {str(p.relative_to(run)) for p in run.rglob("*")} == whole_files
    with open_run_folder(run, result_of(run)[3], resume=True, overwrite=False) as folder:
        assert folder.damaged_artefacts() == ()
    print(f"{ended} of {KILLS} ended before they were killed")  # noqa: T201
