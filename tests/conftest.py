"""Fixtures that several folders of tests use."""

import sys
from pathlib import Path
from typing import NamedTuple

import pytest

from gradedesign.cli import main

# Tests of every folder hold the code against the same oracles: `from oracles.x import y`.
sys.path.insert(0, str(Path(__file__).parent))


class Ended(NamedTuple):
    """How a command ended."""

    code: int
    out: str
    err: str


@pytest.fixture
def cli(capsys):
    """Run the command line in this process: its exit code and what it printed."""

    def call(*words):
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            main([str(word) for word in words])
        printed = capsys.readouterr()
        code = ended.value.code
        return Ended(code if isinstance(code, int) else int(bool(code)), printed.out, printed.err)

    return call


@pytest.fixture
def undrawn(monkeypatch):
    """Leave out the pictures of runs and checks, for tests of something else."""
    leave_out_pictures(monkeypatch)


def leave_out_pictures(patch):
    """Do so for a fixture that lives longer than a test."""
    patch.setattr("gradedesign.cli.check.picture_loads", lambda *_, **__: ())
    for name in ("loads", "density", "lattice", "stress", "deformed"):
        patch.setattr(f"gradedesign.results.files.picture_{name}", lambda *_, **__: ())


@pytest.fixture(scope="module")
def undrawn_module():
    """`undrawn` for a whole module."""
    with pytest.MonkeyPatch.context() as patch:
        leave_out_pictures(patch)
        yield
