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
