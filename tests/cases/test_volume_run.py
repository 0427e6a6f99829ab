"""Passive solids stated by volume are sized, analysed, accepted and printed as by region."""

import json

import pytest
from small_parts import SHORT_BAR

START = SHORT_BAR.index("[[keep]]")
VOLUMES = """\
[[keep]]
box = {lower = ["0 mm", "0 mm", "0 mm"], upper = ["1.5 mm", "8 mm", "8 mm"]}
[[keep]]
cylinder = {diameter = "20 mm", ends = [["14.5 mm", "4 mm", "4 mm"], ["20 mm", "4 mm", "4 mm"]]}
"""
#: The same ends as layers below the faces that are held and loaded.
LAYERS = SHORT_BAR[START:]
REST = """\
[[load_case]]
name = "shear"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-100 N"]}]
[limits]
displacement = [{region = "tip", magnitude = "0.05 mm"}]
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = [0.4, 0.7]
grading = "uniform"
[run]
price = false
analysis = "finite-cells"
acceptance = "whole"
max_iterations = 2
[output]
formats = ["stl"]
"""


def ran(folder, passive, cli):
    """Result of a run that ends met."""
    folder.mkdir()
    (folder / "case.toml").write_text(SHORT_BAR[:START] + passive + REST, encoding="utf-8")
    ended = cli("run", folder, "-o", folder / "r")
    assert ended.code == 0, ended.out + ended.err
    result = json.loads((folder / "r" / "result.json").read_text(encoding="utf-8"))
    assert result["status"] == "met"
    return result


def tip(result):
    """Displacement of the tip in the last iteration, and the low end of its judged band, mm.

    The low end is the value of the finest analysis less half a per cent. The high end follows the
    residual of the tractions, which differs by a factor of two between these two files.
    """
    name = "displacement of tip magnitude"
    (explicit,) = (r["explicit"] for r in result["iterations"][-1]["limits"] if r["name"] == name)
    (band,) = (row["band"] for row in result["limits"] if row["name"] == name)
    return explicit, band["low"]


@pytest.mark.slow
def test_a_run_with_volumes_ends_as_one_with_regions(tmp_path, cli):
    volumes = ran(tmp_path / "volumes", VOLUMES, cli)
    regions = ran(tmp_path / "regions", LAYERS, cli)
    assert volumes["mass_g"] == pytest.approx(regions["mass_g"], rel=0.002)
    assert tip(volumes) == pytest.approx(tip(regions), rel=0.001)
    # Two ends of 1.5 x 8 x 8 mm.
    assert volumes["printed"]["volumes_mm3"]["passive solid"] == pytest.approx(192.0, rel=0.002)
