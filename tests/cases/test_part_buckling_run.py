"""A run with a least load factor of buckling ends in a verdict on the printed file."""

import pytest
from command_run import result_of

CASE = """
[case]
name = "column"
[part]
box = ["24 mm", "8 mm", "8 mm"]
mesh_size = "3 mm"
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[material]
youngs_modulus = "70 GPa"
poissons_ratio = 0.3
density = "2.7 g/cm^3"
[[keep]]
region = "root"
margin = "1 mm"
[[keep]]
region = "tip"
margin = "1 mm"
[[load_case]]
name = "press"
fix = [{region = "root"}]
load = [{region = "tip", force = ["-6000 N", "0 N", "0 N"]}]
[limits]
part_buckling = [{least = 2.0}]
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = [0.25, 0.7]
size_effects = false
[run]
price = false
[output]
formats = ["stl", "report"]
"""


def assert_accepted(result):
    assert result["lightest"]
    (row,) = result["limits"]
    assert row["key"]["kind"] == "part_buckling"
    assert (row["unit"], row["limit"]) == ("times the loads", 2.0)
    assert row["band"]["low"] == row["decisive"] >= 2.0
    assert row["band"]["high"] < 1.06 * row["band"]["low"]
    assert row["judged_by"].startswith("finite cells on the whole printed surface")
    # The solid column by Euler, with shear by Engesser.
    (solid,) = result["solid"]
    euler = 3.141593**2 * 70e3 * 8.0**4 / 12 / 48.0**2
    shear = 5 / 6 * 70e3 / 2.6 * 64.0
    assert solid["value"] == pytest.approx(euler / (1 + euler / shear) / 6000, rel=0.01)
    # One cell across: the first prediction is far off, and its correction converges.
    found = [entry["limits"][0]["discrepancy"] for entry in result["iterations"]]
    assert found[0] < -0.4
    assert abs(found[-1]) < 0.03


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_the_lightest_column_that_holds_twice_its_load(tmp_path):
    assert_accepted(result_of(CASE, tmp_path))
