"""How threads of compiled kernels share the cores and wait for each other."""

import os
import subprocess
import sys

import pytest

from gradedesign.common.system import processor

#: Settings that the tests' own process inherits to its children.
SETTINGS = (
    "OMP_WAIT_POLICY",
    "NUMBA_THREADING_LAYER",
    "NUMBA_THREADING_LAYER_PRIORITY",
    "NUMBA_NUM_THREADS",
)
SUM = (
    "import gradedesign, numba, numpy as np\n"
    "@numba.njit(parallel=True)\n"
    "def total(x):\n"
    "    s = 0.0\n"
    "    for i in numba.prange(len(x)):\n"
    "        s += x[i]\n"
    "    return s\n"
    "assert total(np.ones(100)) == 100\n"
    "print(numba.threading_layer())"
)


def said(code, **stated):
    environment = {k: v for k, v in os.environ.items() if k not in SETTINGS} | stated
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    return done.stdout.split()[-1]


@pytest.mark.parametrize(
    ("stated", "policy"), [({}, "passive"), ({"OMP_WAIT_POLICY": "active"}, "active")]
)
def test_threads_of_a_command_sleep_unless_told_otherwise(stated, policy):
    code = (
        "import atexit, os, sys\n"
        "from gradedesign.program.commands import main\n"
        "assert 'numba' not in sys.modules  # which reads it once\n"
        "atexit.register(lambda: print(os.environ['OMP_WAIT_POLICY']))\n"
        "main(['--help'])"
    )
    expected = stated.get("OMP_WAIT_POLICY", "passive")
    assert said(code, **stated) == expected  # printed last, after the help


@pytest.mark.parametrize("stated", [{}, {"NUMBA_THREADING_LAYER": "workqueue"}])
def test_the_layer_is_ours_unless_the_user_names_one(stated):
    expected = stated.get("NUMBA_THREADING_LAYER", "omp")
    assert said(SUM, **stated) == expected
    doctor = "import gradedesign\nfrom gradedesign.common.system.processor import threading_layer\n"
    assert said(doctor + "print(threading_layer())", **stated) == expected


@pytest.mark.parametrize(("text", "cores"), [("150000 100000\n", 2), ("max 100000\n", 1 << 20)])
def test_cores_follow_the_quota_of_a_control_group(tmp_path, monkeypatch, text, cores):
    quota = tmp_path / "cpu.max"
    quota.write_text(text, encoding="ascii")
    monkeypatch.setattr(processor, "_QUOTA", quota)
    assert processor.usable_cores() == min(len(os.sched_getaffinity(0)), cores)
