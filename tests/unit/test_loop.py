"""The loop with injected stages: what is played, judged and stored, and what ends it."""

import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gradedesign import pipeline
from gradedesign.ladder import accepted as accepting
from gradedesign.ladder import ended as ending
from gradedesign.ladder import round as sizing_round
from gradedesign.ladder.announce import Announcer
from gradedesign.ladder.result import Iteration, RunResult
from gradedesign.ladder.rounds import Round
from gradedesign.ladder.verdict import all_hold, learned_factors, with_factors
from gradedesign.limits.displacement import DisplacementLimit
from gradedesign.limits.key import LimitKey
from gradedesign.limits.local_stress import StressLimit
from gradedesign.limits.row import LimitRow
from gradedesign.verify.correction import Correction, Gap
from gradedesign.workspace.limits import Deadline
from gradedesign.workspace.progress import ignore

NAME = "displacement of tip magnitude"
PULL, SIDE = (
    LimitKey(kind="displacement", region="tip", component="magnitude", load_case=case)
    for case in ("pull", "side")
)
STRESS = LimitKey(kind="stress", region="lattice")


def row(value, key=PULL):
    """A limit of 1 mm."""
    return LimitRow(
        key=key, name=NAME, load_case=key.load_case, value=value, limit=1.0, unit="mm",
        judged_by="explicit analysis",
    )  # fmt: skip


def a_round(number, *values, mass=10.0, seconds=100.0, rho=None):
    """A played round whose explicit values are given, one load case each."""
    rows = tuple(row(v, key) for v, key in zip(values, (PULL, SIDE), strict=False))
    iteration = Iteration(
        round=number,
        lattice_mass_g=mass,
        mass_g=mass,
        mean_density=0.3,
        limits=(),
        use=max(values),
        passed=all(v <= 1.0 for v in values),
        dofs=1000,
        mesh_size_mm=1.0,
        seconds=seconds,
        stiffness_factor=1.0,
        sizing_iterations=10,
        sizing_converged=False,
    )
    return Round(
        iteration=iteration,
        rows=rows,
        correction=Correction(),
        variables=np.zeros(1),
        rho=np.full(3, number / 100 if rho is None else rho),
        at_lower_bound=False,
        gap=Gap(),
    )


class Stages:
    """Stands in for everything below the loop; `accepts` maps round to accepted over explicit."""

    def __init__(self, monkeypatch, play, accepts=None, stored=(), refused=(), factors=None):
        self.play, self.accepts = list(play), accepts or {}
        self.judged, self.given, self.saved = [], [], []
        self.left, self.setup = (
            1e6,
            SimpleNamespace(case=SimpleNamespace(run=SimpleNamespace(max_rounds=6, time=1200.0))),
        )
        replaced = {
            "load_rounds": lambda *_: tuple(stored),
            "load_acceptance": lambda *_: (tuple(refused), factors or {}),
            "save_round": lambda *_: None,
            "save_acceptance": lambda _out, _setup, *what: self.saved.append(what),
            "design_filter": lambda _: None,
            "analyse_design": lambda *_, **__: None,
            "play_round": self.play_round,
            "accept_design": self.accept,
            "verdict_result": self.verdict,
            "shown_design": lambda *_: None,
            "write_outputs": lambda _out, _setup, result, *_, **__: result,
        }
        for name, stage in replaced.items():
            monkeypatch.setattr(pipeline, name, stage)
        monkeypatch.setattr(ending, "saturated", lambda *_: None)

    def play_round(self, _setup, _previous, factors, *_, **__):
        self.given.append(dict(factors))
        return self.play.pop(0), None

    def accept(self, _setup, _out, done, *_):
        number = done.iteration.round
        self.judged.append(number)
        ratios = self.accepts.get(number, (1.0, 1.0))
        rows = tuple(replace(r, value=r.value * f) for r, f in zip(done.rows, ratios, strict=False))
        return SimpleNamespace(
            round=done, rows=rows, holds=all_hold(rows), factors=learned_factors(done.rows, rows)
        )

    def verdict(self, _setup, _registry, rounds, accepted, ended):
        self.rounds, self.accepted, self.ended = rounds, accepted, ended
        return RunResult(status="met", lightest=False, reason="", ended_by=ended.by)

    def loop(self, *, left=1e6):
        cost = SimpleNamespace(
            deadline=lambda _: Deadline(1200.0, start=time.monotonic() - (1200.0 - left)),
            learn=lambda *_: None,
            data=lambda: {},
        )
        return pipeline.loop(self.setup, None, None, Announcer(ignore), cost)


def test_an_accepted_design_that_uses_a_limit_ends_the_loop(monkeypatch):
    stages = Stages(monkeypatch, [a_round(1, 1.2), a_round(2, 0.98)])
    assert stages.loop().ended_by == "tight"
    assert (stages.judged, len(stages.rounds)) == ([2], 2)


def test_a_miss_in_the_second_load_case_is_learned(monkeypatch):
    """Explicit 0.98 and 0.85; accepted 0.98 and 1.02: only the factor of the second is 1.2."""
    plays = [a_round(1, 0.98, 0.85), a_round(2, 0.98, 0.82)]
    stages = Stages(monkeypatch, plays, accepts={1: (1.0, 1.2), 2: (1.0, 1.2)})
    assert stages.loop().ended_by == "tight"
    assert stages.given[1][PULL] == pytest.approx(1.0)
    assert stages.given[1][SIDE] == pytest.approx(1.2)
    assert stages.saved == [((1,), stages.given[1])]


def test_a_design_that_its_factors_break_is_not_judged_again(monkeypatch):
    plays = [a_round(1, 0.98, 0.85), a_round(2, 0.97, 0.84), a_round(3, 0.97, 0.80)]
    stages = Stages(monkeypatch, plays, accepts={n: (1.0, 1.2) for n in (1, 2, 3)})
    stages.loop()
    # 1.2 times 0.84 breaks the limit of 1: round 2 is never exported.
    assert stages.judged == [1, 3]


def test_rounds_end_the_loop_and_the_lightest_left_is_judged(monkeypatch):
    plays = [a_round(1, 0.80, mass=9.0), a_round(2, 0.85, mass=8.0), a_round(3, 1.1, mass=7.0)]
    stages = Stages(monkeypatch, plays)
    stages.setup.case.run.max_rounds = 3
    assert stages.loop().ended_by == "rounds"
    assert stages.judged == [2]
    assert "max_rounds of 3" in stages.ended.words
    assert "about 100 s" in stages.ended.words  # what the last round took


def test_time_ends_the_loop_and_says_what_more_of_it_brings(monkeypatch):
    """55 s are left, a round of 100 s asks for 130 s: 75 s are missing, told in tens."""
    stages = Stages(monkeypatch, [], stored=[a_round(1, 1.2), a_round(2, 0.94)])
    assert stages.loop(left=55.0).ended_by == "time"
    assert stages.ended.words == (
        "[run] time of 1200 s ended the run after 2 rounds; about 80 s more allow another round"
    )
    assert stages.judged == [2]  # the clock does not keep the last design from its judge


def test_the_first_round_is_played_whatever_the_clock_says(monkeypatch):
    stages = Stages(monkeypatch, [a_round(1, 0.98)])
    assert stages.loop(left=0.0).ended_by == "tight"


def test_the_same_design_twice_ends_the_loop(monkeypatch):
    stages = Stages(monkeypatch, [a_round(1, 1.2, rho=0.5), a_round(2, 1.2, rho=0.5)])
    assert stages.loop().ended_by == "stuck"


def test_a_lattice_that_cannot_reach_a_limit_ends_the_loop(monkeypatch):
    stages = Stages(monkeypatch, [a_round(1, 1.2)])
    monkeypatch.setattr(ending, "saturated", lambda *_: "out of reach")
    assert stages.loop().ended_by == "saturated"
    assert stages.ended.words == "out of reach"


def test_a_resumed_run_knows_what_acceptance_refused(monkeypatch):
    factors = {PULL: 1.1}
    stages = Stages(
        monkeypatch,
        [a_round(2, 0.89)],
        stored=[a_round(1, 0.99)],
        refused=[1],
        factors=factors,
        accepts={2: (1.1,)},
    )
    stages.loop()
    assert stages.given == [factors]
    assert stages.judged == [2]


def test_a_refused_design_still_gives_the_rows_of_a_resumed_verdict(monkeypatch):
    stages = Stages(
        monkeypatch,
        [],
        stored=[a_round(1, 0.99)],
        refused=[1],
        factors={PULL: 1.1},
        accepts={1: (1.1,)},
    )
    assert stages.loop(left=0.0).ended_by == "time"
    assert stages.accepted.rows[0].value == pytest.approx(1.089)


def test_of_two_accepted_designs_the_lighter_is_kept(monkeypatch):
    light = a_round(1, 0.975, mass=8.0)
    heavy = a_round(2, 0.975, mass=9.0)
    # Accepted values of 0.93: held, not tight, so the loop goes on.
    stages = Stages(monkeypatch, [light, heavy, a_round(3, 1.2)], accepts={1: (0.95,), 2: (0.96,)})
    stages.setup.case.run.max_rounds = 3
    assert stages.loop().ended_by == "rounds"
    assert stages.accepted.round is light


# --- the judge ------------------------------------------------------------------------------------


def a_stress_limit():
    return StressLimit(
        key=STRESS, name="stress in lattice", allowed=100.0, percentile=99.5,
        considered=np.ones(1, dtype=bool),
    )  # fmt: skip


class Judge:
    """Stands in for what `accept_design` calls; the explicit mesh has ``tets`` tetrahedra."""

    def __init__(self, monkeypatch, tets=1000, asked="auto"):
        self.limits_s = []
        self.analysed = SimpleNamespace(
            judged=None,
            result=SimpleNamespace(space=SimpleNamespace(element_count=tets), mesh_size=1.0),
        )
        self.setup = SimpleNamespace(
            case=SimpleNamespace(run=SimpleNamespace(acceptance=asked, time=1200.0)),
            limits=(a_stress_limit(),),
        )
        replaced = {
            "export_surface": lambda *_: (None, None),
            "analyse_second_size": lambda *_: SimpleNamespace(rows=()),
            "accept_whole": self.whole,
            "accept_windows": self.windows,
            "limit_rows": lambda _limits, found, judge: tuple(
                replace(row(v, key), judged_by=judge)
                for v, key in zip(found.values, (PULL, SIDE), strict=False)
            ),
        }
        for name, stage in replaced.items():
            monkeypatch.setattr(accepting, name, stage)

    def whole(self, *_, time_limit_s):
        self.limits_s.append(time_limit_s)
        found = SimpleNamespace(values=(0.98, 1.02))
        return SimpleNamespace(scope="whole", whole=found)

    def windows(self, *_, time_limit_s, **__):
        self.limits_s.append(time_limit_s)
        windows = tuple(SimpleNamespace(value=v, driving_value=1.0) for v in (1.2, 0.9))
        return SimpleNamespace(scope="windows", whole=None, windows=windows)

    def accept(self, done):
        return accepting.accept_design(self.setup, None, done, self.analysed, Announcer(ignore))


def test_what_is_judged_does_not_depend_on_the_clock(monkeypatch):
    judge = Judge(monkeypatch)
    early = judge.accept(a_round(1, 0.98, 0.85))
    hours = time.monotonic() + 1e5
    monkeypatch.setattr(time, "monotonic", lambda: hours)
    late = judge.accept(a_round(1, 0.98, 0.85))
    assert early.acceptance.scope == late.acceptance.scope == "whole"
    assert judge.limits_s == [1200.0, 1200.0]


def test_a_large_lattice_is_judged_in_windows(monkeypatch):
    # 1.728 million tetrahedra are a million of the mesher's, 2500 s at 400 in a second.
    judge = Judge(monkeypatch, tets=1_728_000)
    done = a_round(1, 0.98)
    done = replace(done, rows=(*done.rows, row(0.7, STRESS)))
    found = judge.accept(done)
    assert found.acceptance.scope == "windows"
    # Displacements are the explicit ones, stress carries the ratio of the windows.
    assert [r.value for r in found.rows] == pytest.approx([0.98, 0.84])
    assert found.rows[1].judged_by == "explicit analysis times the ratio of 2 windows"


def test_both_load_cases_of_a_region_learn_from_the_whole_lattice(monkeypatch):
    """Explicit 0.98 and 0.85, accepted 0.98 and 1.02: the design misses in the second only."""
    done = a_round(1, 0.98, 0.85)
    found = Judge(monkeypatch).accept(done)
    assert not found.holds
    assert [r.value for r in with_factors(done.rows, found.factors)] == pytest.approx([0.98, 1.02])
    assert not pipeline._ready(done, found.factors)


# --- sizing ---------------------------------------------------------------------------------------


def test_sizing_leaves_the_room_that_each_load_case_asks_for(monkeypatch):
    """A limit of 2 mm in two load cases, accepted 1.25 times the explicit value in one."""
    limits = tuple(
        DisplacementLimit(key=key, name=NAME, nodes=np.arange(3), component=None, allowed=2.0)
        for key in (PULL, SIDE)
    )
    setup = SimpleNamespace(
        limits=(*limits, a_stress_limit()),
        bounds=(0.2, 0.6),
    )
    monkeypatch.setattr(sizing_round, "corrected_model", lambda *_: None)
    monkeypatch.setattr(sizing_round, "stored_sizing", lambda _, problem, **__: problem)
    problem = sizing_round.size_round(
        setup,
        Correction(),
        {SIDE: 1.25, STRESS: 1.6},
        None,
        start=None,
        most_iterations=1,
    )
    assert [one.allowed for one in problem.limits] == pytest.approx([2.0, 1.6, 62.5])
