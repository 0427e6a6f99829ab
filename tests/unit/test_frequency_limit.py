"""Least natural frequencies: from a case file, their rows, and what they say where they fail."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import gradedesign
from gradedesign.design.loop.ended import Ended
from gradedesign.design.verdict.reasons import why_not
from gradedesign.errors import SolverError
from gradedesign.mechanics.limits.banded import Banded
from gradedesign.mechanics.limits.frequency import FrequencyLimit
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.limit import mode_goals
from gradedesign.mechanics.limits.verdict import (
    expected_factors,
    learned_factors,
    limit_rows,
    solid_breaks,
    unsure_words,
)

CASE = """\
[case]
name = "bar"
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
name = "pull"
fix = [{region = "root"}]
load = [{region = "tip", force = ["200 N", "0 N", "0 N"]}]
[[load_case]]
name = "weight"
fix = [{region = "root", components = "zyx"}]
acceleration = ["0 m/s^2", "0 m/s^2", "-9.81 m/s^2"]
[[load_case]]
name = "both ends"
fix = [{region = "root"}, {region = "tip", components = "yz"}]
acceleration = ["0 m/s^2", "0 m/s^2", "-9.81 m/s^2"]
[limits]
frequency = [{least = "0.3 kHz"}, {least = "400 Hz", mode = 2, load_case = "weight"}]
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
#: First bending frequency of the solid bar, held at one end: 1.8751^2 / (2 pi) sqrt(E / rho) r /
#: L^2 by Euler and Bernoulli, with r = h / sqrt(12).
SLENDER = 1.875104**2 / (2 * np.pi) * np.sqrt(70e3 / 2.7e-9) / np.sqrt(12) / 60.0**2


def limit(least=300.0, number=1, load_case="pull", **others):
    return FrequencyLimit(
        key=LimitKey(kind="frequency", component=f"mode {number}", load_case=load_case),
        name="lowest natural frequency", allowed=least, number=number, **others,
    )  # fmt: skip


def analysis(found):
    """An analysis that found frequencies, Hz, by keys."""
    return SimpleNamespace(mode_values=found)


def test_a_case_file_limits_frequencies_for_every_set_of_supports_once(tmp_path):
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    result = gradedesign.run(gradedesign.load_case(tmp_path), folder=tmp_path / "run")
    rows = {(row.key.load_case, row.key.component): row for row in result.solid}
    # "pull" and "weight" hold the same region in the same directions.
    assert set(rows) == {("pull", "mode 1"), ("both ends", "mode 1"), ("weight", "mode 2")}
    # Shear and rotation of the sections take 0.4 %.
    assert rows["pull", "mode 1"].value == pytest.approx(4.0 * SLENDER, rel=0.005)
    assert rows["weight", "mode 2"].value == pytest.approx(6.0 * SLENDER, rel=0.01)
    # Clamped and propped: 3.926602^2 (Leissa and Qatu, Vibrations of Continuous Systems, 2011).
    propped = 4.0 * SLENDER * (3.926602 / 1.875104) ** 2
    assert rows["both ends", "mode 1"].value == pytest.approx(propped, rel=0.02)
    sized = {(row.key.load_case, row.key.component): row for row in result.limits}
    assert sized["weight", "mode 2"].limit == 400.0
    first = sized["pull", "mode 1"]
    assert (first.limit, first.unit, first.unfavourable) == (300.0, "Hz", "low")
    assert first.measure == "undamped natural frequency, without prestress"
    assert result.measures["sizing"]["feasible"]
    # The lightest lattice uses one of them up, unless the least density is enough.
    assert all(row.value >= row.limit for row in result.limits)


@pytest.mark.parametrize(
    ("swap", "words"),
    [
        (('"0.3 kHz"', '"0.3 mm"'), "limits.frequency[0].least: found"),
        (('"0.3 kHz"', '"2 x solid"'), "limits.frequency[0].least: found"),
        (("mode = 2", "mode = 0"), "limits.frequency[1].mode: found 0"),
        (("mode = 2", "mode = 2.5"), "expected a whole number"),
        (('least = "0.3 kHz"', 'min = "0.3 kHz"'), "least"),
        (('load_case = "weight"', 'load_case = "wieght"'), 'did you mean "weight"'),
        (("mode = 2, load_case", "load_case"), "of the same quantity"),
        (("{least = ", '{component = "z", least = '), "frequency[0].component: unknown key"),
    ],
)  # fmt: skip
def test_what_cannot_be_meant_is_refused(tmp_path, swap, words):
    assert swap[0] in CASE
    (tmp_path / "case.toml").write_text(CASE.replace(*swap, 1), encoding="utf-8")
    with pytest.raises(gradedesign.CaseError) as error:
        gradedesign.load_case(tmp_path)
    assert words in " ".join(str(error.value).split())


def test_a_plane_of_symmetry_is_refused_before_any_mesh(cli, tmp_path):
    # All load cases mirror the part, or none does.
    mirrored = re.sub(
        "^fix = .*$",
        'fix = [{region = "root", symmetry = true}, {region = "tip", components = "yz"}]',
        CASE,
        flags=re.MULTILINE,
    )
    (tmp_path / "case.toml").write_text(mirrored, encoding="utf-8")
    answer = cli("check", tmp_path)
    words = " ".join(answer.err.split())
    assert answer.code == 2
    assert 'limits.frequency[0].least: load case "pull" mirrors the part at "root"' in words
    assert "expected the whole part" in words


def test_a_free_part_has_no_frequency_to_limit(cli, tmp_path):
    loose = CASE.replace('fix = [{region = "root"}]', 'fix = [{region = "root", components = "x"}]')
    (tmp_path / "case.toml").write_text(loose, encoding="utf-8")
    answer = cli("check", tmp_path)
    assert answer.code == 2
    assert "the supports leave rigid motions free" in " ".join(answer.err.split())


def test_check_states_the_limit(cli, tmp_path):
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    answer = cli("check", tmp_path, "--no-picture")
    assert answer.code == 0, answer.err
    words = " ".join(answer.out.split())
    assert "lowest natural frequency pull at least 300 Hz" in words
    assert "natural frequency 2 weight at least 400 Hz" in words


def test_an_analysis_without_the_frequency_is_an_error_and_no_pass():
    found = limit_rows([limit()], analysis({limit().key: 310.0}), "test")
    assert [(row.value, row.passed) for row in found] == [(310.0, True)]
    with pytest.raises(SolverError, match="lowest natural frequency has no value by test"):
        limit_rows([limit()], analysis({limit(number=2).key: 310.0}), "test")


def test_the_low_end_of_the_band_decides():
    row = limit().row(310.0, "test").banded(Banded(value=310.0, low=298.0, high=320.0))
    assert row.utilisation == pytest.approx(300.0 / 298.0)
    assert (row.word, row.broken) == ("UNSURE", False)
    assert replace(row, band=Banded(value=290.0, low=280.0, high=299.0)).broken
    assert limit().utilisation(298.0) == row.utilisation
    ahead, back = (limit().utilisation(298.0 + step) for step in (1e-4, -1e-4))
    assert limit().utilisation_slope(298.0) == pytest.approx((ahead - back) / 2e-4, rel=1e-6)


def test_a_slow_solid_part_is_no_end_for_a_lattice_may_be_faster():
    slow = limit().row(200.0, "solid part")
    assert slow.broken
    assert not solid_breaks([slow])
    assert solid_breaks([slow, replace(slow, solid_is_best=True)])
    (words,) = unsure_words([slow, limit().row(310.0, "solid part")])
    assert words == (
        "lowest natural frequency (pull) of the fully solid part is 200 Hz, less than the 300 Hz "
        "that it must be at least: only a lattice that is light or soft in the right places can "
        "hold that"
    )


def test_a_limit_out_of_reach_names_the_frequency_of_the_solid_part():
    row = limit().row(200.0, "test")
    words = why_not(
        [row], Ended(by="iterations", words="iterations are used up"), [limit().row(250.0, "solid")]
    )
    assert words == (
        "lowest natural frequency (pull) is 200 Hz, less than the 300 Hz that it must be at least, "
        "the fully solid part has 250; iterations are used up"
    )


def test_acceptance_is_expected_to_find_less_and_tightens_the_limit():
    row = limit().row(310.0, "explicit")
    # Of displacements 0.18 of the residual is missing, of a frequency half as much is too much.
    assert expected_factors([row], {"pull": 0.1}) == {row.key: pytest.approx(1 - 0.09 * 0.1)}
    accepted = row.banded(Banded(value=306.0, low=304.0, high=310.0))
    assert learned_factors([row], [accepted]) == {row.key: pytest.approx(304.0 / 310.0)}


def test_several_modes_of_one_load_case_are_goals_of_their_own():
    goals = mode_goals([limit(), limit(number=3), limit(load_case="weight")])
    assert [(goal.load_case, goal.number) for goal in goals.values()] == [
        ("pull", 1), ("pull", 3), ("weight", 1),
    ]  # fmt: skip
