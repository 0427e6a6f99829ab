"""What the shell offers for names of cells, materials and processes."""

import os
import subprocess
import sys

import pytest

from gradedesign import completed

#: The program as a shell asks it; what it loaded of these is told on stderr.
ASKED = """
import atexit, sys
heavy = {"numpy", "numba", "gradedesign_cells_tpms", "gradedesign_cells_strut"}
atexit.register(lambda: print(*heavy & set(sys.modules), file=sys.stderr))
sys.argv = ["gradedesign"]
from gradedesign.program.commands import main
main()
"""


def offered(*words):
    """Lines that the shell gets for a command line whose last word is not finished."""
    asked = {"_GRADEDESIGN_COMPLETE": "complete_bash", "COMP_CWORD": str(len(words))}
    ended = subprocess.run(
        [sys.executable, "-c", ASKED],
        env={**os.environ, **asked, "COMP_WORDS": " ".join(("gradedesign", *words))},
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    assert ended.stderr.split() == []
    return ended.stdout.splitlines()


def test_the_shell_offers_names_without_loading_a_plugin():
    cells = ["gyroid-sheet", "gyroid-sheet-raymont"]
    assert offered("cells", "gyroid-s") == cells
    assert offered("homogenise", "gyroid-s") == cells
    assert offered("coupon", "octet", "--process", "sls") == ["sls-pa12-struts"]
    assert offered("coupon", "octet", "--material", "Inc") == ["Inconel 625", "Inconel 718"]


CELLS = """
from gradedesign import CellFamily, hookimpl

@hookimpl
def gradedesign_cell_families():
    yield CellFamily(name="fake-cell", shape=abs)
"""


@pytest.mark.parametrize(
    ("text", "names"), [(CELLS, ["fake-cell"]), ("import no_such_module", []), ("", [])]
)
def test_a_plugin_of_others_is_asked_by_its_hook(install, text, names):
    install("fake-cells", text)
    assert completed("cell_families")("fake") == names


def test_without_plugins_the_core_offers_its_own(monkeypatch):
    monkeypatch.setenv("GRADEDESIGN_DISABLE_PLUGINS", "1")
    assert completed("cell_families")("") == []
    assert "316L" in completed("materials")("")
