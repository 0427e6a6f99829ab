"""The loop over injected stages: what is iterated, judged and stored, and what ends it."""

import json
import time
import weakref
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gradedesign import pipeline
from gradedesign.common.system.limits import Deadline
from gradedesign.common.system.progress import ignore
from gradedesign.design.acceptance.acceptance import Acceptance, NoSubmodelError, nothing_meshed
from gradedesign.design.acceptance.meshed_anew import mesher_tets
from gradedesign.design.loop import accepted as accepting
from gradedesign.design.loop import accepted_rows, iteration_steps
from gradedesign.design.loop import ended as ending
from gradedesign.design.loop.announce import Announcer
from gradedesign.design.loop.bodies import Bodies
from gradedesign.design.loop.ended import TIGHT_END, Ended, NoTimeError, stuck
from gradedesign.design.loop.iteration import DesignIteration
from gradedesign.design.loop.iteration_row import Iteration
from gradedesign.design.loop.left_designs import is_ready
from gradedesign.design.loop.loop import Progress, run_loop
from gradedesign.design.loop.loop_stages import Judged, Stages
from gradedesign.design.loop.predicted_cost import RunWork
from gradedesign.design.loop.run_cost import RunCost
from gradedesign.design.verdict.reasons import why_not
from gradedesign.errors import MeshError, ResourceError
from gradedesign.mechanics.explicit.correction import Correction, Discrepancy
from gradedesign.mechanics.limits.banded import Banded
from gradedesign.mechanics.limits.displacement import DisplacementLimit
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.local_stress import StressLimit
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.verdict import all_hold, learned_factors, with_factors
from gradedesign.mechanics.sizing.members import MemberField
from gradedesign.mechanics.sizing.problem import SizingStep
from gradedesign.program.store.stages import iteration_from_stage, iteration_to_stage

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


def an_iteration(number, *values, mass=10.0, seconds=100.0, rho=None):
    """An iteration whose explicit values are given, one load case each."""
    rows = tuple(row(v, key) for v, key in zip(values, (PULL, SIDE), strict=False))
    iteration = Iteration(
        number=number,
        lattice_mass_g=mass,
        mass_g=mass,
        mean_density=0.3,
        limits=(),
        utilisation=max(values),
        passed=all(v <= 1.0 for v in values),
        dofs=1000,
        mesh_size_mm=1.0,
        spacing_mm=1.0,
        seconds=seconds,
        stiffness_factor=1.0,
        sizing_iterations=10,
        sizing_converged=False,
    )
    return DesignIteration(
        summary=iteration,
        rows=rows,
        correction=Correction(),
        variables=np.zeros(1),
        rho=np.full(3, number / 100 if rho is None else rho),
        at_lower_bound=False,
        discrepancy=Discrepancy(),
    )


def taught(factor):
    """Factor on the limit of an iteration with one load case."""
    return {row(1.0).key: factor}


class Faked:
    """Stages that take given iterations; `accepts` maps one to accepted over explicit values."""

    def __init__(self, designs, accepts=None, ends=None, unjudged=None, waiting=(), **start):
        self.left, self.accepts, self.unjudged = list(designs), accepts or {}, unjudged or {}
        self.waiting, self.stress_judged, self.fails = waiting, [], {}
        self.ends = ends or (lambda _: None)
        self.start = Progress(**start)
        self.judged, self.given, self.iterations_stored, self.saved = [], [], [], []

    def iterate(self, _, factors):
        self.given.append(dict(factors))
        done = self.left.pop(0)
        if isinstance(done, Exception):
            raise done
        return done, f"analysis of {done.summary.number}"

    def accept(self, done, analysed):
        number = done.summary.number
        self.judged.append((number, analysed))
        if number in self.fails:
            raise self.fails[number]
        ratios = self.accepts.get(number, (1.0, 1.0))
        rows = tuple(replace(r, value=r.value * f) for r, f in zip(done.rows, ratios, strict=False))
        return SimpleNamespace(
            iteration=done,
            rows=rows,
            holds=all_hold(rows) and number not in self.unjudged,
            factors=learned_factors(done.rows, rows),
            unjudged=self.unjudged.get(number, ""),
            postponed=number in self.waiting,
        )

    def judge_stress(self, accepted):
        self.stress_judged.append(accepted.iteration.summary.number)
        return SimpleNamespace(**{**vars(accepted), "postponed": False, "holds": False})

    def run(self):
        stages = Stages(
            iterate=self.iterate,
            accept=self.accept,
            judge_stress=self.judge_stress,
            why_ended=lambda iterations, _: self.ends(iterations),
            store_iteration=lambda iterations: self.iterations_stored.append(len(iterations)),
            store_acceptance=lambda *what: self.saved.append(what),
        )
        return run_loop(stages, self.start)


def after(number, by="iterations"):
    """Ends the loop after so many iterations."""
    return lambda iterations: Ended(by=by, words=by) if len(iterations) >= number else None


def test_an_accepted_design_that_uses_a_limit_ends_the_loop():
    faked = Faked([an_iteration(1, 1.2), an_iteration(2, 0.98)])
    outcome = faked.run()
    assert outcome.ended.by == "tight"
    # The miss is not judged, and the hit with the analysis that its iteration has just made.
    assert faked.judged == [(2, "analysis of 2")]
    assert faked.iterations_stored == [1, 2]


def test_the_last_design_is_judged_with_its_analysis_when_the_loop_ends():
    """0.8 of its limit is not near enough to be judged before time ends; nothing is done twice."""
    faked = Faked([an_iteration(1, 1.3), an_iteration(2, 0.8)], ends=after(2, by="time"))
    outcome = faked.run()
    assert outcome.accepted.holds
    assert faked.judged == [(2, "analysis of 2")]
    # An earlier one is analysed again: only the last analysis is kept.
    faked = Faked([an_iteration(1, 0.8), an_iteration(2, 1.3)], ends=after(2, by="time"))
    faked.run()
    assert faked.judged == [(1, None)]


def test_submodels_that_were_postponed_judge_the_last_design_alone():
    """0.9 and 0.95 wait; the second is the lightest when iterations end, and its stress decides."""
    designs = [an_iteration(1, 0.9), an_iteration(2, 0.95), an_iteration(3, 1.2)]
    designs = [
        replace(d, summary=replace(d.summary, mass_g=10.0 - i)) for i, d in enumerate(designs)
    ]
    faked = Faked(designs, waiting=(1, 2), ends=after(3))
    outcome = faked.run()
    assert [number for number, _ in faked.judged] == [2]
    assert faked.stress_judged == [2]
    assert not outcome.accepted.holds  # what the submodels say counts
    faked = Faked(designs[1:2], waiting=(), ends=after(1))
    faked.run()
    assert faked.stress_judged == []


def test_a_refused_design_goes_round_with_what_it_taught():
    """Explicit 0.98 and 0.85; accepted 0.98 and 1.02: only the factor of the second is 1.2."""
    designs = [an_iteration(1, 0.98, 0.85), an_iteration(2, 0.98, 0.82)]
    faked = Faked(designs, accepts={1: (1.0, 1.2), 2: (1.0, 1.2)})
    assert faked.run().ended.by == "tight"
    first, second = (row.key for row in designs[0].rows)
    assert faked.given[1][first] == pytest.approx(1.0)
    assert faked.given[1][second] == pytest.approx(1.2)
    assert faked.saved == [((1,), faked.given[1], Judged(holds=False, factors=faked.given[1]))]


def test_the_error_of_the_elements_counts_until_an_acceptance_teaches_it():
    key = row(1.0).key
    designs = [
        replace(an_iteration(n, value), expected={key: 1.1})
        for n, value in ((1, 0.98), (2, 0.89), (3, 0.85))
    ]
    faked = Faked(designs, accepts={2: (1.15,), 3: (1.15,)})
    outcome = faked.run()
    # 1.1 times 0.98 breaks the limit of 1; accepted, the second uses 1.02 of it, not 0.98.
    assert [number for number, _ in faked.judged] == [2, 3]
    assert faked.given[0] == {}
    assert faked.given[1] == {key: 1.1}
    assert faked.given[2] == {key: pytest.approx(1.15)}
    assert outcome.ended.by == "tight"
    # A resumed run knows it too.
    again = Faked(designs[1:], accepts={2: (1.1,)}, iterations=(designs[0],))
    again.run()
    assert again.given[0] == {key: 1.1}
    assert [number for number, _ in again.judged] == [2]


def test_an_earlier_design_that_uses_a_limit_by_new_factors_is_judged_before_another_is_made():
    """As cells of graded size: 0.98 is accepted at 0.96, so 1.0 before it may hold at 0.98."""
    designs = [an_iteration(1, 1.005), an_iteration(2, 0.98), an_iteration(3, 0.9)]
    masses = (9.9, 10.0, 10.4)
    designs = [
        replace(d, summary=replace(d.summary, mass_g=m))
        for d, m in zip(designs, masses, strict=True)
    ]
    faked = Faked(designs, accepts={2: (0.979,), 1: (0.985,)})
    outcome = faked.run()
    # Its analysis is no longer at hand.
    assert faked.judged == [(2, "analysis of 2"), (1, None)]
    assert outcome.ended.by == "tight"
    assert outcome.accepted.iteration.summary.number == 1
    # Not where there is no time for another one, nor where it is heavier.
    faked = Faked(designs, accepts={2: (0.979,)}, ends=after(2, "time"))
    assert faked.run().accepted.iteration.summary.number == 2
    heavy = replace(designs[0], summary=replace(designs[0].summary, mass_g=10.1))
    faked = Faked([heavy, *designs[1:]], accepts={2: (0.979,)}, ends=after(3, "stuck"))
    faked.run()
    assert [number for number, _ in faked.judged] == [2]


def test_a_design_that_its_factors_break_is_not_judged_again():
    designs = [
        an_iteration(1, 0.98, 0.85),
        an_iteration(2, 0.97, 0.84),
        an_iteration(3, 0.97, 0.80),
    ]
    faked = Faked(designs, accepts={n: (1.0, 1.2) for n in (1, 2, 3)})
    faked.run()
    # 1.2 times 0.84 breaks the limit of 1: iteration 2 is never exported.
    assert [number for number, _ in faked.judged] == [1, 3]


def test_the_second_design_that_holds_teaches_before_one_is_tight():
    """Explicit 0.9 is judged at once, so that the next one knows its factor of 1.05."""
    designs = [an_iteration(1, 0.9), an_iteration(2, 0.9), an_iteration(3, 0.94)]
    faked = Faked(designs, accepts={n: (1.05,) for n in (2, 3)})
    outcome = faked.run()
    assert [number for number, _ in faked.judged] == [2, 3]
    assert faked.given[2] == {designs[0].rows[0].key: pytest.approx(1.05)}
    assert outcome.ended.by == "tight"
    # Later ones wait until they are tight, and one that uses little teaches nothing.
    little = Faked([an_iteration(n, 0.8) for n in (1, 2, 3)], ends=after(3))
    little.run()
    assert [number for number, _ in little.judged] == [1]  # the lightest left, at the end


def test_two_designs_at_one_resolution_only_end_the_loop():
    why = "displacement of tip at one resolution only: elements of 1 mm are out of budget"
    values = (0.98, 0.99, 0.955, 0.98)
    designs = [an_iteration(n, value) for n, value in enumerate(values, start=1)]
    faked = Faked(designs, unjudged={1: why, 2: why})
    outcome = faked.run()
    assert outcome.ended.by == "unjudged"
    assert why in outcome.ended.words
    assert "more [run] memory" in outcome.ended.words
    # Neither of them is judged again, and no other design is tried.
    assert [number for number, _ in faked.judged] == [1, 2]
    # One that can be judged in between starts the count again.
    faked = Faked(designs, accepts={2: (1.03,)}, unjudged={1: why, 3: why})
    assert faked.run().ended.by == "tight"
    assert [number for number, _ in faked.judged] == [1, 2, 3, 4]


def counted_fields():
    """Those that are alive of a class that stands for the fields of an analysis, and the class."""
    alive = weakref.WeakSet()

    class Fields:
        def __init__(self):
            alive.add(self)

    return alive, Fields


def test_fields_of_what_decides_no_more_are_freed():
    """Analyses of a thousand cells take gigabytes each: those before and a refused one go."""
    alive, fields = counted_fields()

    class Large(Faked):
        def iterate(self, iterations, factors):
            # Of a refused design both stay until another one is judged: it may be the last.
            assert len(alive) == (2 if self.judged else 0)
            return super().iterate(iterations, factors)[0], fields()

        def accept(self, done, analysed):
            assert list(alive) == [analysed]
            accepted = super().accept(done, None)
            accepted.fields = (analysed, fields())
            return accepted

    designs = [an_iteration(n, value) for n, value in enumerate((0.95, 0.98, 0.8, 0.89), start=1)]
    faked = Large(designs, accepts={2: (1.1,), 4: (1.1,)})
    assert faked.run().ended.by == "tight"
    assert [number for number, _ in faked.judged] == [2, 4]


@pytest.mark.parametrize("ratio", [1.0, 1.5])
def test_fields_of_a_refused_design_are_freed_before_those_left_are_judged(ratio):
    """Two designs are left when time ends the loop; the first may hold, or not either."""
    alive, fields = counted_fields()

    class Large(Faked):
        def accept(self, done, analysed):
            assert not alive
            accepted = super().accept(done, analysed)
            accepted.fields = fields()
            return accepted

    designs = [
        an_iteration(n, value, mass=10.0 - n) for n, value in enumerate((0.7, 0.8, 0.98), start=1)
    ]
    designs[2] = replace(designs[2], summary=replace(designs[2].summary, mass_g=6.0))
    accepts = {3: (1.1,), 2: (ratio,), 1: (ratio,)}
    faked = Large(designs, accepts=accepts, ends=after(3, "time"))
    outcome = faked.run()
    assert [number for number, _ in faked.judged] == ([3, 2] if ratio == 1.0 else [3, 2, 1])
    assert outcome.accepted.iteration is designs[faked.judged[-1][0] - 1]
    assert outcome.accepted.holds == (ratio == 1.0)


def test_where_a_budget_ends_the_loop_the_lightest_left_is_judged():
    designs = [
        an_iteration(1, 0.80, mass=9.0),
        an_iteration(2, 0.85, mass=8.0),
        an_iteration(3, 1.1, mass=7.0),
    ]
    faked = Faked(designs, ends=after(3))
    outcome = faked.run()
    assert outcome.ended.by == "iterations"
    assert faked.judged == [(2, None)]  # its analysis is gone: it is made again
    assert outcome.accepted.iteration is designs[1]


def test_the_last_design_is_judged_before_a_budget_ends_the_loop():
    faked = Faked(
        [], iterations=(an_iteration(1, 1.2), an_iteration(2, 0.94)), ends=after(0, "time")
    )
    assert faked.run().ended.by == "time"
    assert faked.judged == [(2, None)]


def test_of_two_accepted_designs_the_lighter_is_kept():
    light, heavy = an_iteration(1, 0.975, mass=8.0), an_iteration(2, 1.03, mass=9.0)
    # Accepted values of 0.93 and 0.95: held, not tight, so the loop goes on.
    designs = [light, heavy, an_iteration(3, 1.2)]
    faked = Faked(designs, accepts={1: (0.95,), 2: (0.92,)}, ends=after(3))
    assert faked.run().accepted.iteration is light
    assert [number for number, _ in faked.judged] == [1, 2]


def test_designs_that_enclose_the_next_teach_it_together():
    """Held at 95 %, refused at 102 %, held at 95 %, refused at 100.3 %, and tight at 97.5 %."""
    values = (0.5, 0.90, 0.935, 0.90, 0.92, 0.92)
    designs = [an_iteration(n, value) for n, value in enumerate(values, 1)]
    accepts = {2: (1.06,), 3: (1.09,), 4: (1.05,), 5: (1.09,), 6: (1.06,)}
    faked = Faked(designs, accepts=accepts)
    assert faked.run().ended.by == "tight"
    assert [number for number, _ in faked.judged] == [2, 3, 4, 5, 6]
    # The first refused one is believed alone; after it two that enclose the next together.
    between = pytest.approx((1.05 * 1.09) ** 0.5)
    heard = [given.get(PULL) for given in faked.given]
    assert heard == [None, None, pytest.approx(1.06), pytest.approx(1.09), between, between]
    # A run that was ended after its fourth design learns the same.
    refused, stored, last = faked.saved[2]
    again = Faked(
        designs[4:], accepts=accepts, iterations=tuple(designs[:4]),
        refused=refused, factors=stored, last=last,
    )  # fmt: skip
    again.run()
    assert [given[PULL] for given in again.given] == heard[4:]


@pytest.mark.parametrize(
    ("lighter", "ratio", "by"),
    [(9.95, 1.01, "enclosed"), (9.85, 1.01, "iterations"), (9.95, 0.9, "iterations")],
)
def test_a_refused_design_of_nearly_the_same_mass_ends_the_loop(lighter, ratio, by):
    """Displacements jump: 103 % of the limit, then 95 or 85 % with 0.5 or 1.5 % more mass."""
    designs = [an_iteration(1, 0.98, mass=lighter), an_iteration(2, 0.94, mass=10.0)]
    faked = Faked(designs, accepts={1: (1.05,), 2: (ratio,)}, ends=after(2))
    outcome = faked.run()
    assert [number for number, _ in faked.judged] == [1, 2]
    assert (outcome.ended.by, outcome.accepted.iteration.summary.number) == (by, 2)
    if by == "enclosed":
        assert outcome.ended.words == "a design of 0.50% less mass breaks a limit"


def test_an_earlier_design_of_nearly_the_same_mass_does_not_end_the_loop():
    """It was sized before anything was learned: 115 %, and 90 % with 0.5 % more mass."""
    designs = [an_iteration(1, 1.15, mass=9.95), an_iteration(2, 0.9, mass=10.0)]
    outcome = Faked([*designs, an_iteration(3, 0.98, mass=9.8)], ends=after(3)).run()
    assert (outcome.ended.by, outcome.accepted.iteration.summary.number) == ("tight", 3)


@pytest.mark.parametrize(
    ("lighter", "used", "ratio", "by", "kept", "judged"),
    [
        (9.95, 0.99, 1.05, "enclosed", 2, [2]),
        (9.85, 0.99, 1.05, "iterations", 2, [2]),
        (9.95, 0.96, 1.05, "enclosed", 2, [2, 3]),
        (9.95, 0.96, 1.03, "tight", 3, [2, 3]),
    ],
)
def test_a_design_of_nearly_the_same_mass_ends_the_loop(lighter, used, ratio, by, kept, judged):
    """Accepted at 94.5 %, a ratio of 1.05; by it the next has 104 %, or may hold with 101 %."""
    masses = (9.0, 10.0, lighter, 9.97)
    values = (0.8, 0.9, used, 0.99)
    designs = [
        an_iteration(n + 1, value, mass=mass)
        for n, (mass, value) in enumerate(zip(masses, values, strict=True))
    ]
    faked = Faked(designs, accepts={2: (1.05,), 3: (ratio,)}, ends=after(3))
    outcome = faked.run()
    assert [number for number, _ in faked.judged] == judged
    assert (outcome.ended.by, outcome.accepted.iteration.summary.number) == (by, kept)


@pytest.mark.parametrize(
    ("ratio", "by", "kept"), [(1.0, "tight", 3), (1.05, "enclosed", 4), (0.9, "iterations", 3)]
)
def test_at_the_end_a_lighter_design_is_judged_by_what_was_learned_last(ratio, by, kept):
    """The first acceptance multiplies by 1.05, which breaks the third design; the last by 1.01."""
    designs = [
        replace(design, summary=replace(design.summary, mass_g=mass))
        for design, mass in (
            (an_iteration(1, 0.9), 9.0),
            (an_iteration(2, 0.9), 10.05),
            (an_iteration(3, 0.98), 9.9),
            (an_iteration(4, 0.93), 10.0),
        )
    ]
    accepts = {2: (1.05,), 3: (ratio,), 4: (1.01,)}
    # The fourth is ready by the first factor alone.
    faked = Faked(designs, accepts=accepts, ends=after(4))
    outcome = faked.run()
    assert [number for number, _ in faked.judged] == [2, 4, 3]
    assert outcome.ended.by == by
    assert outcome.accepted.iteration.summary.number == kept
    # Without time for another iteration nothing more is judged.
    late = Faked(designs, accepts=accepts)
    late.ends = lambda done: (
        Ended(by="time", words="") if len(late.judged) == 2 and len(done) < 4 else after(4)(done)
    )
    assert late.run().ended.by == "iterations"
    assert [number for number, _ in late.judged] == [2, 4]


@pytest.mark.parametrize(
    ("uses", "ratio", "kept", "judged"),
    [
        # The second design, at 0.985 times 1.03, may hold, and does by what acceptance finds.
        ((0.985, 1.3), 1.0, 2, [1, 2]),
        # Of two that are refused the later is shown.
        ((0.985, 1.3), 1.04, 2, [1, 2]),
        # 3 % over is out of reach.
        ((1.001, 1.3), 1.0, 1, [1]),
    ],
)
def test_at_the_end_the_design_nearest_to_its_limit_is_judged(uses, ratio, kept, judged):
    designs = [an_iteration(n, use) for n, use in enumerate((0.99, *uses), start=1)]
    faked = Faked(designs, accepts={1: (1.03,), 2: (ratio,)}, ends=after(3))
    outcome = faked.run()
    assert [number for number, _ in faked.judged] == judged
    assert outcome.accepted.iteration.summary.number == kept
    assert outcome.accepted.holds == (ratio == 1.0 and kept == 2)
    # Where time ends the run nothing more is judged.
    late = Faked(designs, accepts={1: (1.03,), 2: (ratio,)}, ends=after(3, "time"))
    late.run()
    assert [number for number, _ in late.judged] == [1]


def test_a_resumed_run_knows_what_acceptance_refused():
    faked = Faked(
        [an_iteration(2, 0.89)], accepts={2: (1.1,)},
        iterations=(an_iteration(1, 0.99),), refused=(1,), factors=taught(1.1),
        last=Judged(holds=False, factors=taught(1.1)),
    )  # fmt: skip
    faked.run()
    assert faked.given == [taught(1.1)]
    assert [number for number, _ in faked.judged] == [2]
    assert faked.iterations_stored == [2]


def test_a_refused_design_still_gives_the_rows_of_a_resumed_verdict():
    faked = Faked(
        [], accepts={1: (1.1,)}, ends=after(0, "time"),
        iterations=(an_iteration(1, 0.99),), refused=(1,), factors=taught(1.1),
    )  # fmt: skip
    outcome = faked.run()
    assert outcome.ended.by == "time"
    assert outcome.accepted.rows[0].value == pytest.approx(1.089)


def test_a_later_design_that_cannot_be_analysed_ends_the_loop():
    faked = Faked([an_iteration(1, 0.8), MeshError("open")])
    outcome = faked.run()
    assert (outcome.ended.by, len(outcome.iterations)) == ("refused", 1)
    assert "iteration 2 could not be analysed: open" in outcome.ended.words
    assert outcome.accepted.iteration is outcome.iterations[0]
    with pytest.raises(MeshError, match="open"):
        Faked([MeshError("open")]).run()


@pytest.mark.parametrize("error", [MeshError("volume 1.26 % off"), ResourceError("no memory")])
def test_an_acceptance_that_fails_loses_no_iteration(error):
    faked = Faked([an_iteration(1, 0.99)])
    faked.fails = {1: error}
    outcome = faked.run()
    assert (outcome.ended.by, len(outcome.iterations), outcome.accepted) == ("unaccepted", 1, None)
    assert outcome.ended.words == f"the printed surface could not be judged: {error}"
    # An earlier design that was held stays, with the submodels that it waited for.
    faked = Faked([an_iteration(1, 0.7), an_iteration(2, 0.9), an_iteration(3, 0.98)], waiting=(2,))
    faked.fails = {3: error}
    outcome = faked.run()
    assert [number for number, _ in faked.judged] == [2, 3]
    assert (outcome.ended.by, outcome.accepted.iteration.summary.number) == ("unaccepted", 2)
    assert faked.stress_judged == [2]


# --- what ends it ---------------------------------------------------------------------------------


def ended(monkeypatch, iterations, *, left=1e6, most=6, saturated=None, acceptance=0.0):
    """What ends the loop, with so many seconds left of 1200."""
    monkeypatch.setattr(ending, "saturated", lambda *_: saturated)
    case = SimpleNamespace(run=SimpleNamespace(max_iterations=most))
    setup = SimpleNamespace(plan=SimpleNamespace(case=case))
    deadline = Deadline(1200.0, start=time.monotonic() - (1200.0 - left))
    return ending.why_ended(setup, iterations, {}, deadline, acceptance)


def test_rounds_end_the_loop(monkeypatch):
    assert ended(monkeypatch, [an_iteration(1, 1.2)], most=2) is None
    found = ended(monkeypatch, [an_iteration(1, 1.2), an_iteration(2, 1.1)], most=2)
    assert found.by == "iterations"
    assert "max_iterations of 2" in found.words
    assert "about 100 s" in found.words  # what the last iteration took


def test_time_ends_the_loop_and_says_what_more_of_it_brings(monkeypatch):
    """55 s are left, an iteration of 100 s asks for 130 s: 75 s are missing, told in tens."""
    found = ended(monkeypatch, [an_iteration(1, 1.2), an_iteration(2, 0.94)], left=55.0)
    assert (found.by, found.words) == (
        "time",
        "[run] time of 1200 s ended the run after 2 iterations; about 80 s more allow another "
        "iteration",
    )
    # The first iteration is run whatever the clock says.
    assert ended(monkeypatch, [], left=0.0) is None


def test_time_for_the_acceptance_stays_when_another_iteration_is_begun(monkeypatch):
    """200 s are left: 130 for an iteration of 100 s and 70 for an acceptance, but not 71."""
    done = [an_iteration(1, 1.2), an_iteration(2, 0.94)]
    assert ended(monkeypatch, done, left=200.0, acceptance=69.0) is None
    found = ended(monkeypatch, done, left=200.0, acceptance=85.0)
    assert found.by == "time"
    assert found.words.endswith("about 20 s more allow another iteration and its acceptance")


def test_an_acceptance_that_cannot_end_in_time_is_not_begun(monkeypatch):
    said = []
    announce = Announcer(lambda event: said.append(event.message))
    cost = RunCost(budget=SimpleNamespace(time=1200.0))
    cost.work = RunWork(
        part_dofs=1000, load_cases=1, adjoint_solves=1, explicit_dofs=1000, explicit_memory=1,
        explicit_mesh_s=1.0, explicit_solve_s=10.0, whole_s=100.0, mesher_tets=0, iterations=6,
    )  # fmt: skip

    def begin(left, took):
        done = an_iteration(1, 0.98)
        done = replace(done, summary=replace(done.summary, timing_s={"explicit solve": took}))
        cost.begin_acceptance(
            done, Deadline(1200.0, start=time.monotonic() - (1200.0 - left)), announce
        )

    begin(250.0, 20.0)  # 100 s on the idle machine, 200 on one that is twice as slow
    assert said == []
    begin(150.0, 20.0)
    assert "acceptance of iteration 1 is predicted to take 200 s, more than the 150 s" in said[0]
    with pytest.raises(NoTimeError, match=r"takes about 100 s where 9[0-9] s are left; about 10 s"):
        begin(95.0, 20.0)
    begin(95.0, 5.0)  # one that is twice as fast takes 50 s
    assert len(said) == 1
    # After an acceptance its own time counts, and the loop keeps it free.
    cost.timed(lambda: SimpleNamespace(acceptance=SimpleNamespace(scope="whole")))
    assert 0.0 < cost.judged_s < 1.0
    assert cost.remeshed
    cost.judged_s = 400.0
    done = [an_iteration(1, 0.98), an_iteration(2, 0.98)]
    assert cost.reserved(done) == 400.0
    # Of one that needed no other mesh the time of that is predicted in addition: here none.
    cost.work = replace(cost.work, mesher_tets=10**6)
    assert cost.reserved(done) == 400.0
    cost.timed(lambda: SimpleNamespace(acceptance=SimpleNamespace(scope="none")))
    assert not cost.remeshed
    assert cost.reserved(done) > 10.0 + cost.judged_s
    # The loop ends by its time, with what iterations found.
    faked = Faked([an_iteration(1, 0.99)])
    faked.fails = {1: NoTimeError("no time")}
    outcome = faked.run()
    assert (outcome.ended.by, outcome.ended.words) == ("time", "no time")
    assert (len(outcome.iterations), outcome.accepted) == (1, None)


def test_the_same_design_twice_ends_the_loop(monkeypatch):
    same = [an_iteration(1, 1.2, rho=0.5), an_iteration(2, 1.2, rho=0.5)]
    assert ended(monkeypatch, same).by == "stuck"
    assert (
        ended(monkeypatch, [an_iteration(1, 1.2, rho=0.5), an_iteration(2, 1.2, rho=0.4)]) is None
    )


def test_a_held_design_three_times_ends_the_loop(monkeypatch):
    """Twice may be chance: an acceptance may have changed what the next one aims at."""
    held = [an_iteration(n, 0.8, mass=10.0 + n * 1e-4) for n in range(1, 4)]
    found = ended(monkeypatch, held)
    assert found.by == "stuck"
    assert "a smaller [lattice] least_member" in found.words
    assert ended(monkeypatch, held[:2]) is None
    assert ended(monkeypatch, [*held[:2], an_iteration(3, 0.81)]) is None
    assert ended(monkeypatch, [*held[:2], an_iteration(3, 0.8, mass=10.1)]) is None


def test_a_lattice_that_cannot_reach_a_limit_ends_the_loop(monkeypatch):
    found = ended(monkeypatch, [an_iteration(1, 1.2)], saturated="out of reach")
    assert (found.by, found.words) == ("saturated", "out of reach")


# --- the judge ------------------------------------------------------------------------------------


def a_stress_limit():
    return StressLimit(
        key=STRESS, name="stress in lattice", allowed=100.0, percentile=99.5,
        evaluated=np.ones(1, dtype=bool),
    )  # fmt: skip


class Judge:
    """Stands in for what `accept_design` calls; the explicit mesh has ``tets`` tetrahedra.

    The whole printed surface gives ``found``, within 2 %; its mesh 0.98 and 1.02, its submodels 1.2
    and 0.9 times the stress that drives them.
    """

    def __init__(self, monkeypatch, tets=1000, asked="auto", found=(), matches=True):
        self.limits_s, self.matches, self.left_out = [], matches, 0
        self.found = tuple(
            one.banded(Banded(value=one.value, low=0.98 * one.value, high=1.02 * one.value))
            for one in found
        )
        self.analysed = SimpleNamespace(
            solid=None,
            layout=SimpleNamespace(typical=1.0),
            result=SimpleNamespace(
                solved=SimpleNamespace(division=SimpleNamespace(surface_size=1.0)),
                mesh_size=1.0,
                volume=tets / mesher_tets(1.0, 1.0),
            ),
            remeshed_size=1.0,
        )
        self.setup = SimpleNamespace(
            plan=SimpleNamespace(
                process=None,
                part=SimpleNamespace(surface=None),
                case=SimpleNamespace(
                    run=SimpleNamespace(acceptance=asked, time=1200.0, submodel_count=2)
                ),
            ),
            limits=(a_stress_limit(),),
        )
        replaced = {
            "export_surface": lambda *_: (None, None, "0"),
            "printed_stage": lambda *_: None,
            "as_built_body": lambda *_: None,
            "judge_bodies": lambda *_: Bodies(
                judged="nominal",
                surface=None,
                solid=None,
                whole=SimpleNamespace(
                    rows=self.found,
                    result=SimpleNamespace(yields=None),
                    refused=("elements of 5 mm need 9 GB",),
                ),
            ),
            "accept_whole": self.whole,
            "accept_submodels": self.submodels,
        }
        for name, stage in replaced.items():
            monkeypatch.setattr(accepting, name, stage)
        monkeypatch.setattr(
            accepted_rows,
            "limit_rows",
            lambda _limits, found, judge: tuple(
                replace(row(v, key), judged_by=judge)
                for v, key in zip(found.values, (PULL, SIDE), strict=False)
            ),
        )

    def whole(self, *_, size, time_limit_s):
        assert size == 1.0
        self.limits_s.append(time_limit_s)
        found = SimpleNamespace(values=(0.98, 1.02))
        return Acceptance(
            scope="whole", whole=found, submodels=(), volume=1.0, share=1.0, attempts=()
        )

    def submodels(self, *_, time_limit_s, **__):
        self.limits_s.append(time_limit_s)
        submodels = tuple(
            SimpleNamespace(value=v, driving_value=1.0, matches=self.matches) for v in (1.2, 0.9)
        )
        return Acceptance(
            scope="submodels", whole=None, submodels=submodels[self.left_out :], volume=1.0,
            share=0.1, attempts=(), left_out=self.left_out,
            refused=("the submodel at (1, 1, 1) mm was left out: volume",) * self.left_out,
        )  # fmt: skip

    def accept(self, done):
        return accepting.accept_design(self.setup, None, done, self.analysed, Announcer(ignore))


def test_what_is_judged_does_not_depend_on_the_clock(monkeypatch):
    judge = Judge(monkeypatch)
    early = judge.accept(an_iteration(1, 0.98, 0.85))
    hours = time.monotonic() + 1e5
    monkeypatch.setattr(time, "monotonic", lambda: hours)
    late = judge.accept(an_iteration(1, 0.98, 0.85))
    assert early.acceptance.scope == late.acceptance.scope == "whole"
    assert judge.limits_s == [1200.0, 1200.0]


def judged(*values):
    """Rows of the whole printed surface: two displacements, and stress."""
    rows = (moved(v, key) for v, key in zip(values, (PULL, SIDE), strict=False))
    return (*rows, *(row(v, STRESS) for v in values[2:]))


def moved(value, key):
    """A row that converges."""
    return replace(row(value, key), converges=True)


# 1.728 million tetrahedra are a million of the mesher's, 2500 s at 400 in a second.
LARGE = 1_728_000


def test_a_large_lattice_has_its_stress_judged_by_submodels(monkeypatch):
    done = replace(
        an_iteration(1, 0.98, 0.5), rows=(*an_iteration(1, 0.98, 0.5).rows, row(0.7, STRESS))
    )
    found = Judge(monkeypatch, tets=LARGE, found=judged(0.9, 0.5, 0.7)).accept(done)
    assert found.acceptance.scope == "submodels"
    # Displacements are those of the printed surface, stress carries the ratio of the submodels.
    assert [r.value for r in found.rows] == pytest.approx([0.9, 0.5, 0.84])
    assert [r.decisive for r in found.rows] == pytest.approx([0.918, 0.51, 0.8568])
    assert found.rows[2].judged_by == "explicit analysis times the ratio of 2 submodels"
    assert (found.fitted, found.holds) == ({STRESS}, True)
    # The next design is held where the unfavourable ends are.
    assert found.factors[PULL] == pytest.approx(0.918 / 0.98)
    assert found.factors[STRESS] == pytest.approx(0.8568 / 0.7)


def test_submodels_are_left_out_where_no_limit_is_on_stress(monkeypatch):
    judge = Judge(monkeypatch, tets=LARGE, found=judged(0.96, 0.5))
    judge.setup.limits = ()
    found = judge.accept(an_iteration(1, 0.96, 0.5))
    assert (found.acceptance.scope, found.acceptance.failed, found.holds) == ("none", False, True)
    assert judge.limits_s == []
    # Asked for by name they are made all the same.
    judge = Judge(monkeypatch, tets=LARGE, asked="submodels", found=judged(0.96, 0.5))
    judge.setup.limits = ()
    assert judge.accept(an_iteration(1, 0.96, 0.5)).acceptance.scope == "submodels"


def test_a_lattice_without_room_for_submodels_is_meshed_whole(monkeypatch):
    def none(*_, **__):
        raise NoSubmodelError("no submodel can be chosen")

    judge = Judge(monkeypatch, tets=LARGE, found=judged(0.96, 0.5))
    monkeypatch.setattr(accepting, "accept_submodels", none)
    found = judge.accept(an_iteration(1, 0.98))
    assert found.acceptance.scope == "whole"
    assert found.acceptance.refused == (
        "the whole surface was meshed again: no submodel can be chosen",
    )
    # Asked for by name, they are not replaced by something that may take hours.
    judge = Judge(monkeypatch, tets=LARGE, asked="submodels", found=judged(0.96, 0.5))
    monkeypatch.setattr(accepting, "accept_submodels", none)
    with pytest.raises(NoSubmodelError):
        judge.accept(an_iteration(1, 0.98))


@pytest.mark.parametrize(
    ("values", "scope"),
    [
        ((1.05, 0.5, 0.5), "none"),
        # Displacement holds, or its band reaches the limit while stress is nearly used up.
        ((0.97, 0.5, 0.5), "submodels"),
        ((1.05, 0.5, 0.84), "submodels"),
    ],
)
def test_submodels_are_left_out_where_they_change_nothing(monkeypatch, values, scope):
    judge = Judge(monkeypatch, tets=LARGE, found=judged(*values))
    found = judge.accept(an_iteration(1, 0.98))
    assert found.acceptance.scope == scope
    assert len(judge.limits_s) == (scope == "submodels")
    assert found.holds == (values[0] < 1)
    assert found.factors[PULL] == pytest.approx(1.02 * values[0] / 0.98)


@pytest.mark.parametrize(
    ("values", "at_lower_bound", "waits"),
    [
        ((0.9, 0.5, 0.3), False, True),
        ((0.9, 0.5, 0.52), False, False),  # stress is used to more than half
        ((0.96, 0.5, 0.3), False, False),  # used to 97 % and more: the last design
        ((0.9, 0.5, 0.3), True, False),  # no density can fall further: the last design
    ],
)
def test_submodels_wait_for_the_last_design_where_stress_is_far(
    monkeypatch, values, at_lower_bound, waits
):
    judge = Judge(monkeypatch, tets=LARGE, found=judged(*values))
    done = an_iteration(1, 0.98)
    rows = (*done.rows, row(0.3, STRESS))
    done = replace(done, rows=rows, at_lower_bound=at_lower_bound)
    found = judge.accept(done)
    assert (found.postponed, found.holds) == (waits, True)
    assert len(judge.limits_s) == (not waits)
    if waits:
        assert (found.acceptance.scope, found.rows[2].value) == ("none", values[2])
        found = accepting.judge_stress(
            judge.setup.limits, judge.setup.plan.case.run, found, Announcer(ignore)
        )
    # 1.2 times the stress of the finite cells, whenever they are asked.
    assert (found.postponed, found.acceptance.scope) == (False, "submodels")
    assert found.rows[2].value == pytest.approx(1.2 * values[2])
    assert found.factors[STRESS] == pytest.approx(1.2 * 1.02 * values[2] / 0.3)
    assert len(judge.limits_s) == 1
    # A whole mesh, whose displacements the bands include, never waits.
    assert not Judge(monkeypatch, found=judged(*values)).accept(an_iteration(1, 0.98)).postponed


def test_a_whole_mesh_is_made_though_the_design_is_refused(monkeypatch):
    """Its displacements widen the bands from which the next design learns."""
    found = Judge(monkeypatch, found=judged(1.05, 0.5)).accept(an_iteration(1, 0.98))
    assert found.acceptance.scope == "whole"


def test_no_limit_is_met_by_a_window_that_misses_its_criterion(monkeypatch):
    """Submodels of 1.2 and 0.9: a match takes the larger ratio, a miss spans from 1 to 1.2."""
    found = Judge(monkeypatch, tets=LARGE, found=judged(0.9, 0.5, 0.7), matches=False).accept(
        an_iteration(1, 0.98)
    )
    stress = found.rows[2]
    assert stress.value == pytest.approx(0.84)
    assert (stress.band.low, stress.band.high) == pytest.approx((0.98 * 0.7, 1.02 * 0.84))
    # A submodel of less stress than drives it does not relieve the limit.
    limit = a_stress_limit()
    low = SimpleNamespace(value=0.5, driving_value=1.0, matches=False)
    factor = limit.submodel_factor([low])
    assert (factor.low, factor.value, factor.high) == (0.5, 1.0, 1.0)


def test_where_a_window_is_left_out_the_finite_cells_judge_alone(monkeypatch):
    """Submodels of 1.2 and 0.9: without the first, the other relieves nothing."""
    judge = Judge(monkeypatch, tets=LARGE, found=judged(0.9, 0.5, 0.7))
    judge.left_out = 1
    found = judge.accept(an_iteration(1, 0.98))
    stress = found.rows[2]
    assert (stress.value, stress.remeshed, stress.word) == (pytest.approx(0.7), 0.5, "holds")
    assert stress.judged_by.endswith("times the ratio of 1 submodels, 1 left out")
    assert (found.holds, found.unjudged) == (True, "")
    assert found.acceptance.refused == ("the submodel at (1, 1, 1) mm was left out: volume",)


@pytest.mark.parametrize(
    ("asked", "tets", "mended", "scope"),
    [
        ("auto", 1000, True, "submodels"),  # the whole cannot be meshed: submodels judge
        ("auto", 1000, False, "none"),
        ("whole", 1000, True, "none"),  # asked for by name, it is not replaced
    ],
)
def test_stress_that_no_mesh_judges_does_not_hold_and_keeps_its_value(
    monkeypatch, asked, tets, mended, scope
):
    def refuses(*_, **__):
        raise MeshError("volume 1.26 % off")

    judge = Judge(monkeypatch, tets=tets, asked=asked, found=judged(0.9, 0.5, 0.7))
    monkeypatch.setattr(accepting, "accept_whole", refuses)
    if not mended:
        monkeypatch.setattr(accepting, "accept_submodels", lambda *_, **__: nothing_meshed("no"))
    found = judge.accept(an_iteration(1, 0.98))
    assert found.acceptance.scope == scope
    assert (
        "the whole surface was not analysed in a mesh of its own: volume 1.26"
        in (found.acceptance.refused[0])
    )
    assert [row.passed for row in found.rows[:2]] == [True, True]  # displacements: finite cells
    if scope == "none":
        assert (found.rows[2].value, found.rows[2].word) == (0.7, "UNJUDGED")
        assert not found.holds
        assert found.unjudged.startswith(f"{found.rows[2].name} without an independent mesh: the")
        assert "an independent mesh could be made and solved for 0% of what" in why_not(
            found.rows, TIGHT_END
        )
    else:
        assert found.holds


def test_a_limit_without_a_band_does_not_hold(monkeypatch):
    judge = Judge(monkeypatch, tets=LARGE)
    judge.found = (moved(0.9, PULL),)
    found = judge.accept(an_iteration(1, 0.98))
    assert (all_hold(found.rows), found.holds) == (True, False)
    assert (
        found.unjudged == f"{found.rows[0].name} at one resolution only: elements of 5 mm need 9 GB"
    )


def test_bands_hold_what_the_mesh_of_the_whole_lattice_shows(monkeypatch):
    """Explicit 0.98 and 0.85, by finite cells 0.98 and 0.9, by the mesh 0.98 and 1.02."""
    done = an_iteration(1, 0.98, 0.85)
    found = Judge(monkeypatch, found=judged(0.98, 0.9)).accept(done)
    assert not found.holds
    assert [r.decisive for r in found.rows] == pytest.approx([0.9996, 1.02])
    assert found.rows[1].value == 0.9
    assert found.rows[1].judged_by.endswith("1.02 mm by re-meshed whole lattice")
    assert [r.value for r in with_factors(done.rows, found.factors)] == pytest.approx(
        [0.9996, 1.02]
    )
    assert not is_ready(done, found.factors)


def test_stress_of_the_whole_lattice_is_that_of_its_mesh(monkeypatch):
    """Percentiles of finite cells give the band alone: 2 % about 0.98 of the mesh."""
    judge = Judge(monkeypatch, found=(row(0.8, PULL),))
    found = judge.accept(an_iteration(1, 0.9))
    assert (found.rows[0].value, found.rows[0].band.high) == pytest.approx((0.98, 0.9996))
    assert found.fitted == {PULL}


# --- sizing ---------------------------------------------------------------------------------------


def test_sizing_leaves_the_room_that_each_load_case_asks_for(monkeypatch):
    """A limit of 2 mm in two load cases, accepted 1.25 times the explicit value in one."""
    limits = tuple(
        DisplacementLimit(key=key, name=NAME, nodes=np.arange(3), component=None, allowed=2.0)
        for key in (PULL, SIDE)
    )
    setup = SimpleNamespace(
        plan=SimpleNamespace(
            case=SimpleNamespace(
                lattice=SimpleNamespace(by_stress=False, least_member=None),
                model_dump_json=lambda **_: "",
                part=SimpleNamespace(element_size=1.0),
            )
        ),
        limits=(*limits, a_stress_limit()),
        cells=SimpleNamespace(
            cell=SimpleNamespace(name="", parameters={}), bounds=(0.2, 0.6), zoning=None
        ),
        homogenised=None,
    )
    monkeypatch.setattr(iteration_steps, "corrected_model", lambda *_: None)
    monkeypatch.setattr(iteration_steps, "stored_sizing", lambda problem, _stated, **__: problem)
    problem = iteration_steps.size_design(
        setup,
        Correction(),
        {SIDE: 1.25, STRESS: 1.6},
        None,
        iteration_steps.SizingPlan(most_iterations=1),
    )
    assert [one.allowed for one in problem.limits] == pytest.approx([2.0, 1.6, 62.5])


def test_a_limit_without_a_second_resolution_says_why_it_is_not_accepted(monkeypatch):
    key = LimitKey(kind="displacement", region="tip", load_case="pull")
    row = LimitRow(
        key=key, name="tip", load_case="pull", value=0.9, limit=1.0, unit="mm",
        judged_by="finite cells", converges=True,
    )  # fmt: skip
    why = "elements of 5 mm were refused: they need 9 GB"
    once = SimpleNamespace(rows=(row,), unjudged=f"tip at one resolution only: {why}")
    band = Banded(value=0.9, low=0.89, high=0.91, sizes_mm=(1.0, 0.7))
    twice = SimpleNamespace(rows=(replace(row, band=band),), unjudged="")
    said = []
    announce = Announcer(lambda event: said.append(event.message or ""))
    for accepted, words in ((once, f"tip at one resolution only: {why}"), (twice, None)):
        said.clear()
        monkeypatch.setattr(pipeline, "accept_design", lambda *_, a=accepted: a)
        assert pipeline.judge(None, None, announce, None, object()) is accepted
        assert ("not accepted" in " ".join(said)) == (words is not None)
        assert words is None or words in said[-1]


def test_sizing_counts_from_one_as_the_loop_does():
    said = []
    step = SizingStep(iteration=0, mass_g=1.0, mean_density=0.3, utilisations=(0.9,), change=0.1)
    Announcer(lambda event: said.append(event.message or "")).sizing_step(step)
    assert said[0].startswith("iteration 1: ")


@pytest.mark.parametrize(("mass", "kept"), [(10.2, 2), (10.0, 3), (9.9, 3)])
def test_of_a_lighter_design_and_a_tight_one_the_lighter_is_kept_and_said(mass, kept):
    """Held at 95 % with 10 g; the next design uses 98 % and weighs more, the same, or less."""
    faked = Faked([an_iteration(1, 0.9), an_iteration(2, 0.95), an_iteration(3, 0.98, mass=mass)])
    outcome = faked.run()
    assert outcome.ended.by == "tight"
    assert outcome.accepted.iteration.summary.number == kept
    assert outcome.ended.words.startswith("a design of 2.00% more mass") == (kept == 2)


@pytest.mark.parametrize(
    ("expected", "converges", "said"),
    [
        ({}, True, False),
        ({row(1.0).key: 1.11}, True, True),
        ({row(1.0).key: 1.11}, False, False),  # the band of a percentile, no error of stiffness
    ],
)
def test_the_error_of_the_elements_is_said(expected, converges, said):
    told = []
    done = an_iteration(1, 0.98)
    rows = tuple(replace(each, converges=converges) for each in done.rows)
    Announcer(told.append).iteration(replace(done, rows=rows, expected=expected))
    (line,) = [event.message for event in told if event.stage == "iteration"]
    assert ("utilisation 98.0%, elements too stiff by up to 11%," in line) == said
    assert ("too stiff" in line) == said


def test_a_stored_iteration_comes_back_whole():
    done = replace(an_iteration(3, 0.98, 0.85), expected={row(1.0).key: 1.1})
    arrays, meta = iteration_to_stage(done)
    back = iteration_from_stage(arrays, json.loads(json.dumps(meta)))
    assert back.expected == done.expected
    assert back.rows == done.rows
    assert (back.correction, back.discrepancy) == (done.correction, done.discrepancy)
    assert np.array_equal(back.rho, done.rho)
    assert back.members is None
    members = MemberField(np.array([0.0, 0.4, 1.0]), 3.0, offset=-0.2)
    arrays, meta = iteration_to_stage(replace(done, members=members))
    back = iteration_from_stage(arrays, json.loads(json.dumps(meta)))
    assert np.array_equal(back.members.variables, members.variables)
    assert (back.members.radius, back.members.offset) == (3.0, -0.2)


def test_a_design_is_another_one_when_its_members_change():
    one = replace(
        an_iteration(1, 1.2, rho=0.3), members=MemberField(np.array([0.0, 0.4, 1.0]), 3.0)
    )
    other = replace(one.members, variables=np.array([0.0, 0.5, 1.0]))
    assert stuck([one, one])
    assert not stuck([one, replace(one, members=other)])
    assert not stuck([one, replace(one, members=replace(one.members, offset=0.1))])
