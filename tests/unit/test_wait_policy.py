"""How threads of a command wait for each other."""

import os
import subprocess
import sys

import pytest


@pytest.mark.parametrize(("stated", "policy"), [(None, "passive"), ("active", "active")])
def test_threads_of_a_command_sleep_unless_told_otherwise(stated, policy):
    environment = {k: v for k, v in os.environ.items() if k != "OMP_WAIT_POLICY"}
    if stated:
        environment["OMP_WAIT_POLICY"] = stated
    code = (
        "import atexit, os, sys\n"
        "from gradedesign.cli import main\n"
        "assert 'numba' not in sys.modules  # which reads it once\n"
        "atexit.register(lambda: print(os.environ['OMP_WAIT_POLICY']))\n"
        "main(['--help'])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.split()[-1] == policy  # printed last, after the help
