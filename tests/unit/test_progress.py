"""Progress: steps reach whoever watches, and a command shows that it lives."""

import importlib
import io
import json
import re
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from numba import njit
from numba.core import event
from rich.console import Console

from gradedesign.common.system.limits import resident_memory_bytes
from gradedesign.common.system.progress import (
    Event,
    Step,
    Watch,
    counted,
    report_step,
    stepping,
    watching,
)
from gradedesign.mechanics.solver.conjugate_gradients import _share_done
from gradedesign.program.commands import progress_lines, show
from gradedesign.program.commands.progress_lines import ProgressLines, clock, status_text

CASES = Path(__file__).parents[2] / "cases"
#: Stage, steps, share where known, seconds; time of the budget; memory.
STATUS = re.compile(
    r"[a-z-]+ +\S.*?(, \d{1,3} %)?, \d+ s(, \d+ s left)?; "
    r"\d+:\d\d( of \d+:\d\d(:\d\d)?| in all); \d+\.\d GB"
)


@pytest.fixture
def talkative(monkeypatch):
    """A command that never keeps silent: a line at every look."""
    monkeypatch.setattr(progress_lines, "SILENCE", 0.0)
    monkeypatch.setattr(progress_lines, "POLL", 0.02)
    monkeypatch.setenv("COLUMNS", "80")


def texts(watch):
    return [step.text for step in watch.steps()]


def test_steps_stand_below_each_other_and_end():
    watch = Watch()
    with watching(watch):
        with stepping("outer"):
            report_step("first")
            report_step("second", 0.5)
            assert texts(watch) == ["outer", "second"]
            assert watch.steps()[-1].fraction == 0.5
            with stepping("third"):
                assert texts(watch) == ["outer", "third"]
            assert texts(watch) == ["outer"]
        assert texts(watch) == []
    report_step("nobody hears this")
    assert texts(watch) == []


def test_a_step_keeps_its_beginning_while_only_its_share_grows():
    now = [0.0]
    watch = Watch(clock=lambda: now[0])
    for n in range(3):
        now[0] = float(n)
        watch.report("iterations", n / 3)
    assert watch.steps()[0].began == 0.0
    watch.report("something else")
    assert watch.steps()[0].began == 2.0


def fail_inside():
    with stepping("outer"):
        for n in counted([0], "inner", 1):
            raise RuntimeError(f"on purpose {n}")


def test_an_error_leaves_no_step_behind():
    watch = Watch()
    with watching(watch):
        with pytest.raises(RuntimeError, match="on purpose"):
            fail_inside()
        assert texts(watch) == []
        report_step("after")
        assert texts(watch) == ["after"]


def test_counted_says_which_of_how_many():
    watch, seen = Watch(), []
    with watching(watch):
        for _ in counted("abc", "window", 3):
            seen.append((watch.steps()[-1].text, watch.steps()[-1].fraction))
    assert seen == [(f"window {n} of 3", pytest.approx((n - 1) / 3)) for n in (1, 2, 3)]


def test_other_threads_may_read_but_do_not_report():
    watch, seen = Watch(), []

    def other():
        report_step("not of this computation")
        seen.append(texts(watch))

    with watching(watch), stepping("computing"):
        thread = threading.Thread(target=other)
        thread.start()
        thread.join()
        assert texts(watch) == ["computing"]
    assert seen == [["computing"]]


def test_the_share_of_an_iteration_counts_digits():
    first, goal = np.array([1.0, 1.0]), np.array([1e-8, 1e-8])
    now = np.array([1e-4, 1e-6])
    both = np.array([True, True])
    assert _share_done(first, now, goal, both) == pytest.approx(0.5)  # 4 of 8 digits
    assert _share_done(first, now, goal, ~both) is None


def test_a_status_names_steps_share_times_and_memory():
    steps = [
        Step(text="2 of 8 at most", fraction=None, began=0.0),
        Step(text="multigrid", fraction=0.25, began=0.0),
    ]
    values = {"step_s": 12.4, "elapsed_s": 3700.0, "budget_s": 7200.0, "memory_GB": 3.14}
    text = status_text(steps, values)
    share = "2 of 8 at most: multigrid, 25 %, 12 s, 37 s left"  # 0.75 / 0.25 times 12.4 s
    assert text == f"{share}; 1:01:40 of 2:00:00; 3.1 GB"
    assert STATUS.fullmatch(f"iteration   {text}") is None  # an hour more
    assert clock(59.6) == "1:00"


def test_memory_counts_this_process():
    assert resident_memory_bytes() > 10_000_000


def test_without_a_terminal_a_line_tells_where_the_computation_stands(talkative, capsys):
    seen = ""
    with ProgressLines(budget_s=90.0) as progress:
        progress(Event(stage="iteration", message="started"))
        with stepping("2 of 8 at most"):
            report_step("multigrid", 0.25)
            for _ in range(2000):  # the thread's turn comes; nothing is timed
                seen += capsys.readouterr().out
                if "2 of 8" in seen:
                    break
                time.sleep(0.005)
    (line, *_) = [line for line in seen.splitlines() if "2 of 8" in line]
    assert STATUS.fullmatch(line)
    assert line.startswith("iteration   2 of 8 at most: multigrid, 25 %, ")
    assert " of 1:30; " in line


def test_a_stage_does_not_begin_with_the_last_step_of_the_one_before():
    with ProgressLines(memory=lambda: 10**9) as progress:
        progress(Event(stage="part", message="started"))
        report_step("meshing")
        assert progress.status().message.startswith("meshing, ")
        progress(Event(stage="part", message="done", seconds=1.0))
        progress(Event(stage="solid", message="started"))
        assert (progress.status().stage, progress.status().fraction) == ("solid", None)
        assert progress.status().message.startswith("working, ")


def test_a_step_that_lets_no_thread_run_is_said_before_it(monkeypatch, capsys):
    monkeypatch.setattr(progress_lines, "BLOCKED", 0.0)
    monkeypatch.setattr(progress_lines, "SILENCE", np.inf)
    with ProgressLines():
        report_step("intersection")
        assert capsys.readouterr().out == ""
        report_step("intersection", blocking=True)
        assert STATUS.fullmatch(capsys.readouterr().out.strip())


def test_a_run_says_where_it_stands(talkative, cli, tmp_path, monkeypatch):
    steps, report = [], Watch.report

    def noting(watch, text, fraction=None):
        steps.append(text)
        report(watch, text, fraction)

    monkeypatch.setattr(Watch, "report", noting)
    ended = cli("run", CASES / "infeasible", "-o", tmp_path / "run")
    assert ended.code == 4
    assert ended.err == ""
    before = ended.out.split("\nINFEASIBLE: ")[0]
    joined = re.sub(r"\n {12}", " ", before)  # later lines of a paragraph stand indented
    statuses = [line for line in joined.splitlines() if line.endswith(" GB")]
    assert statuses
    for line in statuses:
        assert STATUS.fullmatch(line), line
    assert max(map(len, before.splitlines())) <= 80
    assert {line.split()[0] for line in statuses} <= {"start", "part", "solid", "output"}
    # Which of its steps a line falls into depends on the machine; that it has them does not.
    assert any(step.startswith("assembling") for step in steps), steps
    assert any(step.startswith("direct solution") for step in steps), steps
    assert "\x1b" not in ended.out


@pytest.mark.parametrize(
    "words",
    [
        ("run", CASES / "infeasible", "-o", "run"),
        ("check", CASES / "mini"),
        ("homogenise", "gyroid-network", "--density", "0.5", "--resolution", "16"),
    ],
    ids=lambda words: words[0],
)
def test_data_on_standard_output_stays_whole(talkative, cli, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    ended = cli(*words, "--json")
    assert ended.code in (0, 4), ended.err
    assert json.loads(ended.out)
    assert ended.err.strip()
    assert all(STATUS.fullmatch(s) for s in re.sub(r"\n {12}", " ", ended.err).splitlines())


def test_every_long_command_shows_progress():
    """Those that compute, beside `run` and `check`, which are tried above."""
    folder = Path(progress_lines.__file__).parent
    for name in ("run", "check", "check_stated"):
        assert "ProgressLines(" in (folder / f"{name}.py").read_text(encoding="utf-8"), name


@pytest.mark.parametrize(
    ("module", "names"),
    [
        ("geometry.tets._quality_kernels", "label_pieces"),
        ("geometry.triangles._tree_kernels", "number_nodes halve_nodes fill_boxes"),
        ("geometry.triangles._closest_kernels", "find_closest find_distance"),
        ("geometry.triangles._grid_kernels", "cross_lines fill_inside mark_near"),
        ("geometry.tets._point_location_kernels", "bin_tets find_tets weigh"),
        ("mechanics.fe._assembly_kernels", "elements_of_nodes list_columns stiffness_blocks"),
        ("mechanics.fe._space_kernels", "number_edges"),
        ("mechanics.solver._multigrid_kernels", "_multiply _relax inverse_diagonal"),
        ("geometry.contour._marching_kernels", "count_slab march_slab"),
        ("geometry.contour._side_kernels", "take_out_edges touching"),
        (
            "geometry.contour._surface_kernels",
            "unpaired_edges vertex_shells shell_volumes volumes_under",
        ),
        (
            "geometry.triangles._collapse_kernels",
            "mark_short stars collapse_short number_used renumber",
        ),
        ("geometry.cell._percolation_kernels", "flood"),
    ],
)
def test_kernels_over_a_whole_mesh_let_other_threads_speak(module, names):
    """One call takes seconds on a million tetrahedra: it must not hold the interpreter's lock."""
    kernels = importlib.import_module(f"gradedesign.{module}")
    for name in names.split():
        assert getattr(kernels, name).targetoptions.get("nogil"), name


def test_on_a_terminal_one_line_is_kept_and_then_erased(monkeypatch):
    screen = io.StringIO()
    monkeypatch.setattr(
        progress_lines,
        "Console",
        lambda stderr: Console(file=screen, force_terminal=True, width=80, stderr=stderr),
    )
    monkeypatch.setattr(progress_lines, "LIVE_POLL", 0.002)
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    with ProgressLines("homogenise") as progress, stepping("64^3 voxels"):
        for _ in range(2000):
            if "64^3 voxels" in screen.getvalue():
                break
            time.sleep(0.005)
        progress(Event(stage="part", message="done", seconds=1.0))
        show.print_text("an answer")
    drawn = screen.getvalue()
    assert "64^3 voxels" in drawn
    # What is printed meanwhile stands in lines of its own, the live line below it.
    seen = [line.split("\x1b[2K")[-1].rstrip("\r") for line in drawn.split("\n")]
    assert "part        done (1.0 s)" in seen
    assert "an answer" in seen
    assert drawn.rstrip().endswith(("\x1b[2K", "\x1b[?25h"))  # erased, cursor shown again
    assert sys.stdout is not screen


def test_a_kernel_that_is_compiled_is_said_and_one_that_is_ready_is_not():
    """Seen from inside numba, while it compiles a function of a test."""
    seen = []

    class Passes(event.Listener):
        def on_start(self, _):
            seen.append(progress.status())

        def on_end(self, _):
            pass

    @njit
    def doubled(x):
        return 2.0 * x

    with ProgressLines(memory=lambda: 10**9) as progress, stepping("distance grid", 0.0):
        assert "compiling" not in progress.status().message
        event.register("numba:run_pass", passes := Passes())
        try:
            assert doubled(1.0) == 2.0
            assert len(seen) > 10
            for status in seen:
                assert status.message.startswith(
                    "distance grid: compiling, once on this machine, 0 s; "
                )
                assert status.fraction is None
            count = len(seen)
            assert doubled(3.0) == 6.0
            assert len(seen) == count
        finally:
            event.unregister("numba:run_pass", passes)
        assert progress.status().message.startswith("distance grid, 0 %, ")
