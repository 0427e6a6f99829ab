"""A run with a least natural frequency ends in a verdict on the printed file."""

import json
import subprocess
import sys

import pytest
from result_keys import undocumented
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
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    command = [
        *(sys.executable, "-m", "gradedesign", "run", str(tmp_path)),
        *("-o", str(tmp_path / "r"), "--json"),
    ]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    result = json.loads((tmp_path / "r" / "result.json").read_text(encoding="utf-8"))
    assert (result["status"], result["lightest"]) == ("met", True)
    assert undocumented(result) == []
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
