"""Decks of a run in CalculiX: its displacements are ours, node by node."""

import re
import shutil
import subprocess

import numpy as np
import pytest
from small_parts import SHORT_BAR

from gradedesign import load_case, run

LOADS = """
[[load_case]]
name = "shear & <heat>"
fix = [{region = "root"}]
load = [{region = "tip", force = ["30 N", "0 N", "-100 N"], moment = ["5 N m", "0 N m", "0 N m"]}]
acceleration = ["0 m/s^2", "0 m/s^2", "-981 m/s^2"]
temperature_change = "20 K"
[[load_case]]
name = "stretch"
fix = [{region = "root", components = "x"},
       {region = "root", displacement = ["free", "0 mm", "0 mm"]},
       {region = "tip", displacement = ["0.01 mm", "free", "free"]}]
"""
CASE = (
    SHORT_BAR
    + LOADS
    + """
[limits]
displacement = [{region = "tip", magnitude = "0.05 mm"}]
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
rotation = ["20 deg", "0 deg", "30 deg"]
density = [0.3, 0.7]
size_effects = false
[run]
stop_after = "sizing"
[output]
formats = ["inp"]
"""
)
needs_ccx = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")


def stated(deck):
    """Largest displacements that a deck says of itself, mm."""
    return [float(x) for x in re.findall(r"displacement of a node (\S+) mm", deck.read_text())]


def displacements(deck):
    """Displacements ``(steps, nodes, 3)`` by ccx, as its result file has them, mm."""
    name = deck.with_suffix("")
    done = subprocess.run(
        ["ccx", "-i", name.name], cwd=deck.parent, capture_output=True, text=True, check=False
    )
    assert "Job finished" in done.stdout, done.stdout[-2000:]
    steps, inside = [], False
    for line in name.with_suffix(".frd").read_text().splitlines():
        if line.startswith(" -4"):
            inside = line.split()[1] == "DISP"
            if inside:
                steps.append([])
        elif inside and line.startswith(" -1"):
            steps[-1].append([float(line[13 + 12 * k : 25 + 12 * k]) for k in range(3)])
        elif line.startswith(" -3"):
            inside = False
    return np.array(steps)


@pytest.fixture(scope="module")
def decks(tmp_path_factory):
    folder = tmp_path_factory.mktemp("decks")
    (folder / "case.toml").write_text(CASE, encoding="utf-8")
    result = run(load_case(folder / "case.toml"), folder=folder / "out")
    return folder / "out", result


def test_a_run_writes_a_deck_of_the_solid_and_of_the_homogenised_part(decks):
    out, result = decks
    assert result.files["solid_inp"] == "solid.inp"
    assert result.files["homogenised_inp"] == "homogenised.inp"
    text = (out / "homogenised.inp").read_text(encoding="utf-8")
    assert "** load case shear & <heat>: largest displacement" in text
    assert text.count("*STEP\n") == 2
    assert "*ELASTIC, TYPE=ANISO" in text
    assert max(len(line) for line in text.splitlines() if not line.startswith("**")) < 200
    # One material for each density: the ends of the box are solid, the rest is graded.
    assert text.count("*MATERIAL") > 20
    assert text.count("*MATERIAL") == text.count("*SOLID SECTION")
    assert (out / "solid.inp").read_text(encoding="utf-8").count("*MATERIAL") == 1


@needs_ccx
@pytest.mark.parametrize("name", ["solid", "homogenised"])
def test_calculix_finds_our_displacements(decks, name):
    deck = decks[0] / f"{name}.inp"
    found = np.linalg.norm(displacements(deck), axis=2).max(axis=1)
    np.testing.assert_allclose(found, stated(deck), rtol=1e-4)
