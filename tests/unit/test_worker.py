"""Workers that crash, hang, eat memory or answer nonsense must not harm the parent."""

import fcntl
import os
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np
import psutil
import pytest

from gradedesign.common.system.scratch import sweep_scratch
from gradedesign.common.system.worker import run_worker
from gradedesign.errors import MeshError, ResourceError

HEAD = """
import json, os, signal, sys, time
options = json.load(open(sys.argv[3]))
"""
NUMPY = """
import numpy as np
with np.load(sys.argv[1]) as archive:
    arrays = dict(archive)
"""
WORKERS = {
    "doubles": "np.savez(sys.argv[2], x=2 * arrays['x'], n=options['n'], cwd=os.getcwd())",
    "segfaults": "print('about to fail', flush=True); os.kill(os.getpid(), signal.SIGSEGV)",
    "aborts": "os.abort()",
    "fails": "sys.exit('the hole is too large')",
    "eats": "x = np.zeros(2**28)",
    "eats_in_cpp": "sys.stderr.write('what():  std::bad_alloc\\n'); sys.stderr.flush(); os.abort()",
    "eats_in_blas": "sys.exit('OpenBLAS error: Memory allocation still failed after 10 retries')",
    "oom_killed": "os.kill(os.getpid(), signal.SIGKILL)",
    "fills_and_is_killed": "x = bytearray(175 * [1]) * 10**6; os.kill(os.getpid(), signal.SIGKILL)",
    "hangs": "open(options['pids'], 'w').write(str(os.getpid())); time.sleep(600)",
    "silent": "",
    "garbage": "open(sys.argv[2], 'wb').write(b'garbage')",
    "pickles": "np.savez(sys.argv[2], x=np.array([{}], dtype=object))",
    "litters": "open('__tracked_surface.stl', 'w').write('x'); np.savez(sys.argv[2], x=1)",
}
#: Starts a child that ignores everything but SIGKILL and waits with it.
WORKERS["forks"] = """
import subprocess
child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)'])
open(options['pids'], 'w').write(f'{os.getpid()} {child.pid}')
if options['wait']:
    time.sleep(600)
import numpy
numpy.savez(sys.argv[2], x=1)
"""


#: Takes the libraries of the package before it begins.
WORKERS["serves"] = """
from gradedesign.common.system.worker import serve
serve(lambda arrays, options: arrays)
"""


@pytest.fixture(autouse=True)
def modules(tmp_path, monkeypatch):
    """Put the fake workers on the path, and temporary folders where they can be counted."""
    folder = tmp_path / "modules"
    folder.mkdir()
    for name, body in WORKERS.items():
        (folder / f"worker_that_{name}.py").write_text(
            body if "serve(" in body else HEAD + (NUMPY if "np." in body else "") + body
        )
    monkeypatch.setenv("PYTHONPATH", str(folder), prepend=os.pathsep)
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))
    yield
    assert list(scratch.iterdir()) == []  # nothing temporary is ever left


def run(name, options=None, *, time_limit_s=60.0, memory=2**30):
    return run_worker(
        f"worker_that_{name}",
        {"x": np.arange(4.0)},
        {"n": 7, **(options or {})},
        time_limit_s=time_limit_s,
        memory_limit_bytes=memory,
    )


def assert_gone(path):
    """The processes named in the file are dead and reaped, or left to init."""
    for pid in path.read_text().split():
        for _ in range(100):
            if not psutil.pid_exists(int(pid)):
                break
            if psutil.Process(int(pid)).status() == psutil.STATUS_ZOMBIE:
                assert psutil.Process(int(pid)).ppid() != os.getpid()
                break
            time.sleep(0.02)
        else:
            pytest.fail(f"process {pid} still runs")


def test_arrays_and_options_go_there_and_back(tmp_path):
    result = run("doubles")
    np.testing.assert_array_equal(result.arrays["x"], [0, 2, 4, 6])
    assert result.arrays["n"] == 7
    assert str(result.arrays["cwd"]).startswith(str(tmp_path / "scratch"))
    assert 0 < result.seconds < 60


def test_the_users_folder_stays_clean(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.iterdir())
    run("litters")
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("segfaults", r"crashed with SIGSEGV; last output: about to fail"),
        ("aborts", "crashed with SIGABRT; it printed nothing"),
        ("fails", "failed with exit code 1; last output: the hole is too large"),
        ("silent", "without a readable result"),
        ("garbage", "without a readable result"),
        ("pickles", "without a readable result"),
        ("is_missing", "No module named"),
    ],
)
def test_a_broken_worker_is_a_mesh_error_that_says_why(name, message):
    with pytest.raises(MeshError, match=message):
        run(name)


@pytest.mark.parametrize("name", ["eats", "eats_in_cpp", "eats_in_blas"])
def test_memory_is_a_resource_error(name):
    # "eats" asks for 2 GiB with a limit of 1 GiB.
    with pytest.raises(ResourceError, match=r"more memory than its limit of 1\.07 GB"):
        run(name)


def test_a_kill_from_outside_names_both_who_may_have_sent_it():
    # It held some MB of the 1 GB it may take.
    with pytest.raises(
        ResourceError, match=r"from outside \(SIGKILL\).*batch system.*guard"
    ) as told:
        run("oom_killed")
    assert "needs more memory" not in str(told.value)


def test_a_kill_near_the_limit_is_a_lack_of_memory():
    with pytest.raises(ResourceError, match=r"while it held .* near its limit of 200 MB"):
        run("fills_and_is_killed", memory=200_000_000)


def test_a_limit_below_what_the_process_itself_takes_says_so():
    # Before the mend: a failing mesher of a coarser mesh, whatever the worker printed last.
    with pytest.raises(
        ResourceError,
        match=r"needs about \d+ MB .* before it begins .* limit of 60 MB.*run\.memory",
    ):
        run("serves", memory=60_000_000)
    assert run("serves").arrays["x"].sum() == 6


def test_folders_of_killed_runs_are_swept_and_others_kept(tmp_path):
    root = tmp_path / "swept"
    root.mkdir()
    ended = subprocess.Popen(["true"])
    ended.wait()
    stale, unlocked = (root / f"gradedesign-worker-{ended.pid}-{x}" for x in "ab")
    living, foreign = root / f"gradedesign-worker-{os.getpid()}-c", root / "gradedesign-notes-d"
    for folder in (stale, unlocked, living, foreign):
        folder.mkdir()
        (folder / "lock").touch()
    (unlocked / "lock").unlink()
    sweep_scratch(root)
    assert sorted(root.iterdir()) == sorted([living, foreign])


def test_a_locked_folder_is_kept_though_its_process_is_not_seen(tmp_path):
    # As of a container that shares the folder for temporary files, not the process numbers.
    ended = subprocess.Popen(["true"])
    ended.wait()
    folder = tmp_path / f"gradedesign-worker-{ended.pid}-a"
    folder.mkdir()
    with (folder / "lock").open("xb") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        sweep_scratch(tmp_path)
        assert folder.is_dir()
    sweep_scratch(tmp_path)
    assert not folder.exists()


def test_the_limit_is_what_stops_it():
    with pytest.raises(MeshError, match="without a readable result"):
        run("eats", memory=2**33)


def test_a_hanging_worker_is_killed_at_the_limit(tmp_path):
    pids = tmp_path / "pids"
    start = time.monotonic()
    with pytest.raises(MeshError, match="timed out after 3 s"):
        run("hangs", {"pids": str(pids)}, time_limit_s=3.0)
    assert time.monotonic() - start < 10
    assert_gone(pids)


@pytest.mark.parametrize("wait", [True, False])
def test_children_of_the_worker_die_with_it(tmp_path, wait):
    pids = tmp_path / "pids"
    options = {"pids": str(pids), "wait": wait}
    if wait:
        with pytest.raises(MeshError, match="timed out"):
            run("forks", options, time_limit_s=3.0)
    else:
        run("forks", options)
    assert_gone(pids)


PARENT = """
import signal, sys, numpy as np
signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background ignores it
from gradedesign.common.system.worker import run_worker
run_worker('worker_that_hangs', {'x': np.zeros(1)}, {'pids': sys.argv[1]},
           time_limit_s=600, memory_limit_bytes=2**30)
"""


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_the_worker_dies_with_its_parent(tmp_path, how):
    if how == signal.SIGKILL and not sys.platform.startswith("linux"):
        pytest.skip("only Linux can tie a process to its parent's death")
    pids = tmp_path / "pids"
    scratch = tmp_path / "elsewhere"
    scratch.mkdir()
    parent = subprocess.Popen(
        [sys.executable, "-c", PARENT, str(pids)],
        env={**os.environ, "TMPDIR": str(scratch)},
        stderr=subprocess.PIPE,
    )
    for _ in range(1000):
        if pids.exists() and pids.read_text():
            break
        time.sleep(0.02)
    parent.send_signal(how)
    _, words = parent.communicate(timeout=30)
    assert_gone(pids)
    if how == signal.SIGINT:
        assert b"KeyboardInterrupt" in words
    for _ in range(200):
        if not list(scratch.iterdir()):
            break
        time.sleep(0.02)
    assert list(scratch.iterdir()) == []  # the launcher removes it where the parent cannot


@pytest.mark.parametrize("name", ["; rm -rf /", "-c", "a..b", ""])
def test_only_module_names_are_run(name):
    with pytest.raises(ValueError, match="dotted name"):
        run_worker(name, {}, {}, time_limit_s=1, memory_limit_bytes=2**30)


@pytest.mark.parametrize(("seconds", "memory"), [(0.0, 2**30), (float("nan"), 2**30), (1.0, 0)])
def test_limits_must_be_positive(seconds, memory):
    with pytest.raises(ValueError, match="positive"):
        run_worker("a", {}, {}, time_limit_s=seconds, memory_limit_bytes=memory)
