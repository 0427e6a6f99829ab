"""Least load factors of buckling: from a case file, their rows, and what is refused."""

from types import SimpleNamespace

import numpy as np
import pytest

import gradedesign
from gradedesign.errors import SolverError
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.part_buckling import PartBucklingLimit, smooth_lowest
from gradedesign.mechanics.limits.verdict import (
    expected_factors,
    limit_rows,
    solid_breaks,
    unsure_words,
)

CASE = """\
[case]
name = "column"
[part]
box = ["60 mm", "6 mm", "4 mm"]
mesh_size = "4 mm"
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[material]
youngs_modulus = "70 GPa"
poissons_ratio = 0.0
density = "2.7 g/cm^3"
[[load_case]]
name = "press"
fix = [{region = "root"}]
load = [{region = "tip", force = ["-200 N", "0 N", "0 N"]}]
[[load_case]]
name = "pull"
fix = [{region = "root"}]
load = [{region = "tip", force = ["200 N", "0 N", "0 N"]}]
[limits]
part_buckling = [{least = 2.0, load_case = "press"}]
[lattice]
cell = "gyroid-sheet"
size = "4 mm"
density = [0.2, 0.6]
phases = ["lattice"]
size_effects = false
[run]
stop_after = "sizing"
[output]
formats = []
"""
#: Euler's force on the solid column, held at one end, N.
EULER = np.pi**2 * 70e3 * 6.0 * 4.0**3 / 12 / (2 * 60.0) ** 2


def limit(least=2.0, **others):
    return PartBucklingLimit(
        key=LimitKey(kind="part_buckling", load_case="press"), name="buckling of the part",
        allowed=least, **others,
    )  # fmt: skip


def test_a_case_file_limits_the_load_factor_and_sizing_holds_it(tmp_path):
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    result = gradedesign.run(gradedesign.load_case(tmp_path), folder=tmp_path / "run")
    (solid,) = result.solid
    # Shear takes 0.1 % of it.
    assert solid.value == pytest.approx(EULER / 200.0, rel=0.005)
    (row,) = result.limits
    assert (row.limit, row.unit, row.unfavourable) == (2.0, "times the loads", "low")
    assert row.measure == "linear buckling, lowest factor of all loads of the load case"
    assert result.measures["sizing"]["feasible"]
    # The lightest lattice uses it up: half a per cent may be lost to the smooth value.
    assert 2.0 <= row.value <= 2.0 * 1.01


@pytest.mark.parametrize(
    ("swap", "words"),
    [
        (("least = 2.0", 'least = "2 x solid"'), "limits.part_buckling[0].least: found"),
        (("least = 2.0", "least = 0.5"), "limits.part_buckling[0].least: found 0.5"),
        (("least = 2.0", "factor = 2.0"), "least"),
        (('load_case = "press"', 'load_case = "pres"'), 'did you mean "press"'),
        (("{least = 2.0, ", '{least = 2.0, component = "z", '), "component: unknown key"),
        (("part_buckling = [{", "buckling_load_factor = [{"), 'did you mean "part_buckling"'),
    ],
)  # fmt: skip
def test_what_cannot_be_meant_is_refused(tmp_path, swap, words):
    assert swap[0] in CASE
    (tmp_path / "case.toml").write_text(CASE.replace(*swap, 1), encoding="utf-8")
    with pytest.raises(gradedesign.CaseError) as error:
        gradedesign.load_case(tmp_path)
    assert words in " ".join(str(error.value).split())


def test_a_plane_of_symmetry_is_refused_before_any_mesh(cli, tmp_path):
    held = 'fix = [{region = "root"}]'
    mirrored = CASE.replace(
        held, 'fix = [{region = "root", symmetry = true}, {region = "tip", components = "yz"}]'
    )
    (tmp_path / "case.toml").write_text(mirrored, encoding="utf-8")
    answer = cli("check", tmp_path)
    assert answer.code == 2
    words = " ".join(answer.err.split())
    assert 'limits.part_buckling[0].least: load case "press" mirrors the part at "root"' in words


def test_a_load_that_compresses_nothing_is_refused(tmp_path):
    pulled = CASE.replace('load_case = "press"', 'load_case = "pull"', 1)
    (tmp_path / "case.toml").write_text(pulled, encoding="utf-8")
    with pytest.raises(SolverError, match="load case 'pull': its loads compress nothing"):
        gradedesign.run(gradedesign.load_case(tmp_path), folder=tmp_path / "run")


def test_check_states_the_limit(cli, tmp_path):
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    answer = cli("check", tmp_path, "--no-picture")
    assert answer.code == 0, answer.err
    words = " ".join(answer.out.split())
    assert "buckling of the part press at least 2 times the loads" in words


def test_an_analysis_without_the_factor_is_an_error_and_no_pass():
    found = limit_rows([limit()], SimpleNamespace(mode_values={limit().key: 2.1}), "test")
    assert [(row.value, row.passed) for row in found] == [(2.1, True)]
    with pytest.raises(SolverError, match="buckling of the part has no value by test"):
        limit_rows([limit()], SimpleNamespace(mode_values={}), "test")


def test_acceptance_is_expected_to_find_less_by_what_a_displacement_is_more():
    row = limit().row(2.1, "explicit")
    assert expected_factors([row], {"press": 0.1}) == {row.key: pytest.approx(1 - 0.18 * 0.1)}


def test_a_solid_part_that_buckles_is_no_end():
    weak = limit().row(1.5, "solid part")
    assert weak.broken
    assert not solid_breaks([weak])
    (words,) = unsure_words([weak])
    assert words.startswith(
        "buckling of the part (press) of the fully solid part is 1.5 times the loads, less than "
        "the 2 times the loads that it must be at least"
    )


def test_the_smooth_lowest_value_lies_just_below_the_lowest():
    factors = np.array([2.0, 2.0, 2.02, 3.0, 9.0])
    value, slopes = smooth_lowest(factors)
    assert 2.0 * (1 - 0.0102) < value < 2.0
    assert slopes[0] == slopes[1] > slopes[2] > slopes[3]
    # Of degree one in the factors: Euler's theorem.
    assert slopes @ factors == pytest.approx(value, rel=1e-12)
    ahead, back = (smooth_lowest(factors + s * np.eye(5)[2])[0] for s in (1e-6, -1e-6))
    assert slopes[2] == pytest.approx((ahead - back) / 2e-6, rel=1e-6)
