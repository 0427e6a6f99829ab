"""Rows of the fully solid part: their bands, and the statuses that follow."""

import json

import meshio
import numpy as np
import pytest

from gradedesign import load_case, run
from gradedesign.design.check import first_answer as first_answer_module
from gradedesign.design.check.first_answer import first_answer
from gradedesign.design.resolve.design_model import prepare
from gradedesign.design.resolve.solid import solve_solid, with_solid
from gradedesign.mechanics.limits.banded import Banded
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.row import LimitRow, row_from_json
from gradedesign.mechanics.limits.verdict import unsure_words
from gradedesign.program.host.registry import build_registry

#: A bar in pure bending: 180 MPa at its surface, so that the percentile is 0.995 of that.
PERCENTILE = 179.1
BAR = """
[case]
name = "bent"
[part]
box = ["60 mm", "10 mm", "10 mm"]
mesh_size = "3.5 mm"
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[material]
name = "Ti-6Al-4V"
[[load_case]]
name = "half"
fix = [{{region = "root"}}]
load = [{{region = "tip", moment = ["0 N m", "15 N m", "0 N m"]}}]
[[load_case]]
name = "whole"
fix = [{{region = "root"}}]
load = [{{region = "tip", moment = ["0 N m", "30 N m", "0 N m"]}}]
[limits]
stress = "{limit} MPa"
exclusion_radius = "15 mm"
[lattice]
cell = "sc"
size = "10 mm"
phases = ["lattice"]
size_effects = false
[run]
stop_after = "solid"
[output]
formats = [{formats}]
"""


def bar(folder, limit, formats=""):
    path = folder / "case.toml"
    path.write_text(BAR.format(limit=limit, formats=formats), encoding="utf-8")
    return load_case(path)


@pytest.mark.parametrize(
    ("limit", "status", "passed"),
    # The band is half a per cent to either side: 178.2 to 180.0 MPa.
    [(185.0, "partial", True), (179.7, "partial", False), (178.5, "partial", False),
     (177.5, "infeasible", False)],
)  # fmt: skip
def test_the_favourable_end_breaks_the_part(tmp_path, limit, status, passed):
    result = run(bar(tmp_path, limit), folder=tmp_path / "run")
    (row,) = result.solid
    assert row.value == pytest.approx(PERCENTILE, rel=1e-3)
    assert (result.status, row.passed) == (status, passed)
    words = [words for words in result.warnings if "neither met nor broken" in words]
    assert len(words) == (status == "partial" and not passed)
    if words:
        assert f"the limit of {limit:.4g} MPa" in words[0]
        assert "part.mesh_size" in words[0]
    if status == "infeasible":
        words = "is 178.2 MPa at the favourable end of its band (178.2 to 180), 1.00 times the"
        assert words in result.reason


def test_the_row_holds_band_largest_and_the_governing_case(tmp_path):
    said = []
    case = bar(tmp_path, 400.0, '"report"')
    result = run(case, folder=tmp_path / "run", on_event=said.append)
    (row,) = result.solid
    (line,) = [e.message for e in said if e.stage == "solid" and "stress" in e.message]
    assert line.endswith(f"largest {row.largest:.4g} MPa")
    assert row.load_case == "whole"
    assert row.largest == pytest.approx(180.0, rel=2e-3)
    assert row.band.low < row.value < row.band.high
    (stored,) = json.loads((tmp_path / "run" / "result.json").read_text())["solid"]
    assert stored["largest"] == row.largest
    assert stored["band"]["order"] == "recovered"
    assert row_from_json(stored) == row
    report = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    part = report[report.index("<h2>Fully solid part</h2>") :].replace("\u00a0", " ")
    for words in (f"{row.band.low:.4g} to {row.band.high:.4g}", f"{row.largest:.4g}"):
        assert words in part
    assert "from two resolutions" not in report


def test_a_first_answer_sizes_where_the_limit_lies_in_the_band(tmp_path, monkeypatch):
    monkeypatch.setattr(first_answer_module, "price_of_lattice", lambda *_: ())
    setup = prepare(bar(tmp_path, 179.7), build_registry())
    setup = with_solid(setup, solve_solid(setup.homogenised))
    (answer,) = first_answer(setup).constant
    assert answer.density is None
    assert answer.reason != "broken when solid"


def test_ends_of_a_band_that_break():
    def row(low, high, limit, unfavourable="high"):
        return LimitRow(
            key=LimitKey(kind="stress"),
            name="stress",
            load_case="a",
            value=0.5 * (low + high),
            limit=limit,
            unit="MPa",
            judged_by="solid part",
            band=Banded(value=0.5 * (low + high), low=low, high=high),
            unfavourable=unfavourable,
        )

    assert not row(90, 110, 120).broken
    assert not row(90, 110, 95).broken
    assert row(90, 110, 80).broken
    assert row(90, 110, 80).least_utilisation == pytest.approx(90 / 80)
    assert not row(90, 110, 95, "low").broken
    assert row(90, 110, 120, "low").broken
    words = [row(90, 110, limit).word for limit in (80, 100, 120)]
    assert words == ["BROKEN", "UNSURE", "holds"]
    assert [bool(unsure_words((row(90, 110, limit),))) for limit in (80, 100, 120)] == [0, 1, 0]


def test_solid_vtu_holds_stress_at_nodes_and_no_stress_of_free_expansion(tmp_path):
    text = BAR.format(limit=400.0, formats='"vtu"')
    start, end = text.index("[[load_case]]"), text.index("[limits]")
    held = ", ".join(f'{{region = "{axis}", components = "{axis}"}}' for axis in "xyz")
    regions = "".join(f'[region.{axis}]\nplane = "{axis} = min"\n' for axis in "xyz")
    warm = f'{regions}[[load_case]]\nname = "warm"\nfix = [{held}]\ntemperature_change = "80 K"\n'
    warm += '[[load_case]]\nname = "pull"\nfix = [{region = "root"}]\n'
    warm += 'load = [{region = "tip", force = ["1 kN", "0 N", "0 N"]}]\n'
    (tmp_path / "case.toml").write_text(text[:start] + warm + text[end:], encoding="utf-8")
    run(load_case(tmp_path / "case.toml"), folder=tmp_path / "run")
    mesh = meshio.read(tmp_path / "run" / "solid.vtu")
    free = mesh.point_data["von_mises warm [MPa]"]
    assert free.shape == (len(mesh.points),)
    # 80 K of titanium held on all sides are some 75 MPa; float32 and the solver leave a millionth.
    assert np.abs(free).max() < 1e-3
    pulled = mesh.point_data["von_mises pull [MPa]"][mesh.points[:, 0] > 30]
    assert pulled == pytest.approx(np.full(pulled.size, 10.0), rel=5e-3)
