"""Order, examples and fixtures of all tests, of the core and of every plugin."""

import gc
import os
import sys
from pathlib import Path
from typing import NamedTuple

import hypothesis
import pytest

from gradedesign.program.commands import main

ROOT = Path(__file__).parent

# Tests of every folder hold the code against the same oracles: `from oracles.x import y`.
sys.path.insert(0, str(ROOT / "tests"))

#: Folders of tests that come first. A worker takes a half of the list: one compiles the kernels of
#: these, the other, after the many short tests that stand directly in tests/, those of whole runs.
#: In the order of the alphabet both need the same kernels at the same time and compile them twice.
FIRST = ("plugins", "tests/verification", "tests")

# The same examples in every run, so that a change is to blame for a failure. `make test-all`, or
# HYPOTHESIS_PROFILE=explore, looks for new ones.
hypothesis.settings.register_profile("repeatable", derandomize=True)
hypothesis.settings.register_profile("explore", print_blob=True)
hypothesis.settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "repeatable"))


def pytest_collection_modifyitems(items):
    """Sort by folder, each as it was within."""
    items.sort(key=lambda item: rank(item.path))


def rank(path):
    """Place of the folder of a file of tests in `FIRST`, or after all of them."""
    folder = path.relative_to(ROOT).parent
    name = "plugins" if folder.parts[0] == "plugins" else folder.as_posix()
    return FIRST.index(name) if name in FIRST else len(FIRST)


def pytest_collection_finish():
    """Look for garbage seldom, and never among what was imported: compiling makes many objects."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)


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
        report = sys.unraisablehook
        with pytest.raises(SystemExit) as ended:
            main([str(word) for word in words])
        # An interrupted command leaves it silent, since its process ends.
        sys.unraisablehook = report
        printed = capsys.readouterr()
        code = ended.value.code
        return Ended(code if isinstance(code, int) else int(bool(code)), printed.out, printed.err)

    return call


def leave_out_pictures(patch):
    """Leave the pictures out of runs, checks and new cases."""
    patch.setattr("gradedesign.program.commands.check.picture_loads", lambda *_, **__: ())
    patch.setattr("gradedesign.program.commands.new.picture_loads", lambda *_, **__: ())
    patch.setattr("gradedesign.program.outputs.files.write_scene", lambda *_: ())
    for name in ("loads", "density", "lattice", "stress", "deformed"):
        patch.setattr(
            f"gradedesign.program.outputs.drawn_files.picture_{name}", lambda *_, **__: ()
        )


@pytest.fixture(scope="session", autouse=True)
def undrawn():
    """No pictures for tests of something else."""
    with pytest.MonkeyPatch.context() as patch:
        leave_out_pictures(patch)
        yield patch


@pytest.fixture
def drawn(undrawn):
    """Pictures for a test that looks at them."""
    undrawn.undo()
    yield
    leave_out_pictures(undrawn)
