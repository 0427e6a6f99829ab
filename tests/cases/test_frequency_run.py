"""A run with a least natural frequency ends in a verdict on the printed file."""

import pytest
from command_run import result_of
from small_parts import SHORT_BAR

CASE = (
    SHORT_BAR.replace('["16 mm", "8 mm", "8 mm"]', '["24 mm", "8 mm", "8 mm"]')
    + """
[[load_case]]
name = "held"
fix = [{region = "root"}]
acceleration = ["0 m/s^2", "0 m/s^2", "-9.81 m/s^2"]
[limits]
frequency = [{least = "5 kHz"}]
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = [0.3, 0.7]
size_effects = false
[run]
price = false
[output]
formats = ["stl"]
"""
)


@pytest.mark.slow
def test_the_lightest_bar_that_vibrates_fast_enough(tmp_path):
    result = result_of(CASE, tmp_path)
    assert result["lightest"]
    (row,) = result["limits"]
    assert (row["key"]["kind"], row["unit"], row["limit"]) == ("frequency", "Hz", 5000.0)
    assert row["band"]["low"] == row["decisive"] >= 5000.0
    assert row["band"]["order"] in ("residual", "observed")
    assert row["judged_by"].startswith("finite cells on the whole printed surface")
    # The solid bar: 1.8751^2 / (2 pi) sqrt(E / rho) h / sqrt(12) / L^2 is 11.5 kHz by Euler and
    # Bernoulli; shear and rotation take a tenth at three heights of length.
    (solid,) = result["solid"]
    assert solid["value"] == pytest.approx(0.92 * 11.5e3, rel=0.05)
    # One cell across: the first prediction is far off, and its correction converges.
    last = result["iterations"][-1]["limits"][0]
    assert abs(last["discrepancy"]) < 0.02
