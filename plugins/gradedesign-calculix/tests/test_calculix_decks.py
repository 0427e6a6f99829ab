"""Decks of a run in CalculiX: its displacements are ours, node by node."""

import re
import shutil
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from oracles.calculix import needs_ccx, run_calculix
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
phases = ["lattice"]
size_effects = false
[run]
stop_after = "sizing"
[output]
formats = ["inp"]
"""
)


def stated(deck):
    """Largest displacements that a deck says of itself, mm."""
    return [float(x) for x in re.findall(r"displacement of a node (\S+) mm", deck.read_text())]


def largest(deck):
    """Largest displacement of a node in each step by CalculiX, mm."""
    return np.linalg.norm(run_calculix(deck)["DISP"], axis=2).max(axis=1)


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


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A run whose accepted surface is meshed whole."""
    folder = tmp_path_factory.mktemp("whole")
    text = CASE.replace('stop_after = "sizing"', 'acceptance = "whole"\nelements_per_wall = 0.5')
    text = text.replace('formats = ["inp"]', 'formats = ["inp", "vtu"]')
    (folder / "case.toml").write_text(text, encoding="utf-8")
    return folder / "out", run(load_case(folder / "case.toml"), folder=folder / "out")


@pytest.mark.slow
def test_the_printed_lattice_in_calculix_and_the_series_of_iterations(whole):
    out, result = whole
    files = result.files
    assert {"solid_inp", "homogenised_inp", "explicit_inp", "iterations_pvd"} <= set(files)
    if shutil.which("ccx") is not None:
        deck = out / "explicit.inp"
        np.testing.assert_allclose(largest(deck), stated(deck), rtol=1e-3)
    series = ElementTree.parse(out / "iterations.pvd").getroot()
    *_, entry = series.iter("DataSet")
    assert entry.get("timestep") == str(len(result.iterations))
    first, last = (meshio.read(p) for p in (out / entry.get("file"), out / "density.vtu"))
    name = "relative_density [-]"
    np.testing.assert_array_equal(first.cell_data[name][0], last.cell_data[name][0])


@needs_ccx
@pytest.mark.parametrize("name", ["solid", "homogenised"])
def test_calculix_finds_our_displacements(decks, name):
    deck = decks[0] / f"{name}.inp"
    np.testing.assert_allclose(largest(deck), stated(deck), rtol=1e-4)
