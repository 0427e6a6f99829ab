"""What a verdict says of the end of its run, and when a stored one is the last word."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gradedesign.design.check.price import PricedBody
from gradedesign.design.loop import saturation
from gradedesign.design.loop.ended import TIGHT_END, Ended, enclosed_end
from gradedesign.design.loop.iteration_row import Iteration, LimitIteration
from gradedesign.design.loop.saturation import density_gain, never_held, sentence
from gradedesign.design.verdict import summary
from gradedesign.design.verdict.at_lower_density import at_lower_density
from gradedesign.design.verdict.result import RunResult, as_json, from_json
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.program.outputs.files import write_result
from gradedesign.program.outputs.finished import finished_result
from gradedesign.program.store.run_folder import open_run_folder

BY_TIME = Ended(
    by="time", words="[run] time of 1200 s ended the run after 2 iterations; 300 s more"
)


def row(value):
    return LimitRow(
        key=LimitKey(kind="displacement", region="tip", load_case="pull"),
        name="displacement of tip magnitude",
        load_case="pull",
        value=value,
        limit=1.0,
        unit="mm",
        judged_by="explicit analysis",
    )


@pytest.fixture
def verdict(monkeypatch):
    """Verdict of a design with one limit used to the given share."""
    monkeypatch.setattr(summary, "common_entries", lambda *_: {"warnings": (), "yields": ()})
    for name in ("solid_mass", "latticed_mass"):
        monkeypatch.setattr(summary, name, lambda _: 100.0)
    monkeypatch.setattr(summary, "_acceptance_warnings", lambda *_: [])
    monkeypatch.setattr(summary, "stress_warnings", lambda *_: ((), []))
    monkeypatch.setattr(summary, "mapping_data", lambda *_: {})
    for name in ("acceptance_data", "measure_data"):
        monkeypatch.setattr(summary, name, lambda _: {})
    for name in ("printed_data", "comparison_warnings"):
        monkeypatch.setattr(summary, name, lambda *_: {})
    iteration = SimpleNamespace(mass_g=20.0, lattice_mass_g=10.0, utilisation=1.0)
    printed = SimpleNamespace(
        thickness=None,
        mass_g=lambda density, phase=None: density * (11.0 if phase == "lattice" else 22.0),
        comparison=SimpleNamespace(
            printed=SimpleNamespace(cavities=0, cavities_mm3=0.0, volume_mm3=1.0)
        ),
    )
    setup = SimpleNamespace(
        plan=SimpleNamespace(
            material=SimpleNamespace(density=1.0),
            case=SimpleNamespace(
                print=None,
                lattice=SimpleNamespace(least_member=None, by_stress=False),
                part=SimpleNamespace(file=None),
            ),
            part=SimpleNamespace(surface=None),
        ),
        cells=SimpleNamespace(zoning=None, bounds=(0.2, 0.6)),
        homogenised=SimpleNamespace(lattice_volumes=np.array([3.0, 1.0, 4.0])),
        limits=(),
        solid=(),
    )

    def call(use, ended, rho=(0.2, 0.5, 0.3)):
        layout = SimpleNamespace(report={})
        last = SimpleNamespace(
            summary=iteration, rho=np.array(rho), variables=np.zeros(1), at_lower_bound=False,
            rows=(row(use),), members=None,
        )  # fmt: skip
        analysed = SimpleNamespace(
            layout=layout,
            design=SimpleNamespace(domain=SimpleNamespace(facts=dict)),
            result=SimpleNamespace(
                solved=SimpleNamespace(
                    division=SimpleNamespace(refused=("a grid of 1 mm was refined",))
                )
            ),
        )
        accepted = SimpleNamespace(
            iteration=last,
            rows=(row(use),),
            holds=use <= 1.0,
            analysed=analysed,
            acceptance=SimpleNamespace(whole=analysed.result),
            factors={},
        )
        shown = SimpleNamespace(printed=printed, analysed=analysed)
        return summary.verdict_result(setup, None, [last], accepted, ended, shown)

    return call


@pytest.mark.parametrize(("second", "told"), [(0.3, False), (0.2001, True)])
def test_a_lattice_at_its_lower_density_says_what_a_lower_one_would_save(verdict, second, told):
    """Volumes of 3, 1 and 4; with the second two 4 of 8 are at most at it, which is no more."""
    rho = (0.3, second, 0.2) if told else (0.2, second, 0.3)
    found = verdict(0.99, BY_TIME, rho).warnings[1:]
    if not told:
        assert found == ()
        return
    # (1 + 4) / 8 of the volume, and 1 of (0.9 + 0.2 + 0.8) of the 11 g of lattice.
    assert found == (
        "62% of the lattice lies at its lower density of 0.2, with 5.79 g: if that fell by a "
        "tenth, by larger cells, a smaller [lattice] density or more [run] memory and time, the "
        "part would be up to 0.579 g lighter",
    )


def test_void_is_no_lattice_that_could_be_lighter():
    every = np.ones(2)
    assert at_lower_density(0.2 * every, np.array(0.2), every, 1.0)
    assert at_lower_density(0.2 * every, np.array(0.2), every, 0.0) == []


def test_a_design_that_is_not_the_lightest_says_so_in_the_verdict(verdict):
    found = verdict(0.94, BY_TIME)
    assert (found.status, found.lightest, found.ended_by) == ("met", False, "time")
    assert found.reason == (
        "every limit holds at the unfavourable end of its band; the most used one to 94.0%; "
        "not the lightest: "
        f"{BY_TIME.words}, and a lighter design may exist"
    )
    assert found.warnings == ("a grid of 1 mm was refined",)
    # Of the file, not of the analysed mesh with its 20 g and 10 g.
    masses = found.mass_g, found.lattice_mass_g, found.relative_density, found.lattice_density
    assert masses == (22.0, 11.0, 0.22, 0.11)


def test_a_used_limit_is_the_end_whatever_ended_the_iterations(verdict):
    found = verdict(0.98, BY_TIME)
    assert (found.status, found.lightest, found.ended_by) == ("met", True, "tight")
    assert "lighter" not in found.reason
    assert verdict(0.98, TIGHT_END).ended_by == "tight"


def test_a_refused_design_of_hardly_less_mass_makes_the_lightest(verdict):
    found = verdict(0.95, enclosed_end(10.0, [9.95]))
    assert (found.status, found.lightest, found.ended_by) == ("met", True, "enclosed")
    assert found.reason.endswith("one to 95.0%; a design of 0.50% less mass breaks a limit")


def test_a_miss_names_the_limit_and_the_end(verdict):
    found = verdict(1.075, BY_TIME)
    assert (found.status, found.ended_by) == ("not_met", "time")
    assert found.reason == (
        "displacement of tip magnitude (pull) is 1.075 mm, 107.5% of the allowed 1 mm; "
        f"{BY_TIME.words}"
    )


# --- out of reach ---------------------------------------------------------------------------------


def test_what_densities_at_their_bounds_could_gain():
    """Three densities of 0.4, 0.5 and 0.3 between 0.2 and 0.6, by hand.

    0.5 * 0.2 + 1.0 * 0.1 for the two that stiffen, 0.2 * 0.1 for the one whose weight bends.
    """
    slope = np.array([-0.5, -1.0, 0.2])
    rho = np.array([0.4, 0.5, 0.3])
    assert density_gain(slope, rho, (0.2, 0.6)) == pytest.approx(0.22)
    assert density_gain(-np.ones(2), np.full(2, 0.6), (0.2, 0.6)) == 0.0


def test_the_first_order_overrates_what_a_bar_can_gain():
    """A bar of n like pieces in series, u = sum rho^-2: relative slope -2 / (n rho)."""
    rho = np.full(4, 0.3)
    gain = density_gain(np.full(4, -2.0 / (4 * 0.3)), rho, (0.1, 0.4))
    assert gain > 1.0 - (0.3 / 0.4) ** 2


def lattice(skin=(), window=0.8):
    return SimpleNamespace(
        plan=SimpleNamespace(
            case=SimpleNamespace(load_case=()),
            part=None,
            domain=SimpleNamespace(ties_faces=bool(skin)),
        ),
        cells=SimpleNamespace(
            bounds=(0.2, 0.6),
            zoning=None,
            layout=SimpleNamespace(typical=6.0),
            cell=SimpleNamespace(window=(0.1, 0.9)),
            law=SimpleNamespace(window=(0.1, window)),
        ),
        homogenised=None,
    )


def test_the_sentence_names_what_would_help():
    assert sentence(lattice(), row(1.3), 0.0) == (
        "this lattice cannot reach the limit on displacement of tip magnitude (pull): every "
        "density that matters for it stands at the upper bound of 0.6; [lattice] density up to "
        "0.8, another cell, a skin or smaller cells would help"
    )
    told = sentence(lattice(skin=("1 mm",), window=0.6), row(1.3), 0.05)
    assert "would take about 5% of it away" in told
    assert told.endswith("; another cell or smaller cells would help")


def test_below_a_load_on_open_lattice_a_plate_would_help_first(monkeypatch):
    monkeypatch.setattr(saturation, "open_regions", lambda *_: {"tip": 1.0})
    told = sentence(lattice(window=0.6), row(1.3), 0.05)
    assert told.endswith(
        '; [[keep]] region = "tip" with a margin of 1 mm or more, another cell, a skin or smaller '
        "cells would help"
    )


def test_a_limit_that_an_earlier_design_held_is_within_reach():
    """A loose rim may make a light design break what a heavier one and a lighter one held."""
    other = replace(row(2.0), key=LimitKey(kind="displacement", region="head", load_case="pull"))
    last = (row(36.0), other)
    assert never_held([last], {}) == list(last)
    assert never_held([(row(0.5), other), last], {}) == [other]
    # The factor of acceptance breaks the limit there too.
    factors = {row(1.0).key: 3.0}
    assert never_held([(row(0.5), other), last], factors) == [row(108.0), other]


def test_no_sentence_is_made_of_a_limit_that_an_earlier_design_held(monkeypatch):
    solved = SimpleNamespace(limits={row(1.0).key: None}, state=SimpleNamespace(rho=None))
    monkeypatch.setattr(saturation, "_solved", lambda *_: solved)
    monkeypatch.setattr(saturation, "_relative_slope", lambda *_: None)
    monkeypatch.setattr(saturation, "density_gain", lambda *_: 0.0)
    monkeypatch.setattr(saturation, "element_bounds", lambda _: None)
    setup = lattice()
    setup.limits = (SimpleNamespace(key=row(1.0).key, scatter=1.0),)
    held, broken = (SimpleNamespace(rows=(row(value),), members=None) for value in (0.5, 36.0))
    assert "cannot reach the limit" in saturation.saturated(setup, [broken], {})
    assert "cannot reach the limit" in saturation.saturated(setup, [broken, broken], {})
    assert saturation.saturated(setup, [held, broken], {}) is None
    assert saturation.saturated(setup, [broken, held], {}) is None
    # Members can become as solid as the part.
    with_members = SimpleNamespace(rows=broken.rows, members=object())
    assert saturation.saturated(setup, [with_members], {}) is None


# --- resuming -------------------------------------------------------------------------------------


STORED = RunResult(
    status="met",
    lightest=False,
    reason="by iterations",
    ended_by="iterations",
    limits=(row(0.94),),
    mass_g=12.5,
    iterations=(
        Iteration(
            number=1,
            lattice_mass_g=1.0,
            mass_g=2.0,
            mean_density=0.3,
            limits=(
                LimitIteration(
                    key=LimitKey(kind="displacement", region="tip", load_case="pull"),
                    name="displacement of tip magnitude",
                    unit="mm",
                    predicted=0.9,
                    explicit=0.94,
                    discrepancy=0.04,
                    factor=1.0,
                ),
            ),
            utilisation=0.94,
            passed=True,
            dofs=10,
            mesh_size_mm=1.0,
            spacing_mm=1.0,
            seconds=3.0,
            stiffness_factor=1.0,
            sizing_iterations=10,
            sizing_converged=False,
            timing_s={"sizing": 1.0},
        ),
    ),
    warnings=("a", "b"),
    plugins=("p 1.0",),
    timing_s={"iteration": 3.0},
    budget={"time_s": 1200.0, "max_iterations": 1},
    bodies=(PricedBody(name="uniform lattice", mass_g=3.5, largest_utilisation=0.99),),
    why_lattice="it fills the part",
    case_hash="same",
    case_name="bar",
)


def test_a_result_survives_its_file(tmp_path):
    assert from_json(as_json(replace(STORED, folder=tmp_path))) == replace(STORED, folder=tmp_path)


@pytest.fixture
def resumed(tmp_path):
    """What resuming a folder with a stored result returns, for a case with these budgets."""

    def call(stored, *, time=1200.0, max_iterations=1, spoil=None):
        folder = tmp_path / "run"
        with open_run_folder(folder, "same", resume=False, overwrite=True) as out:
            write_result(out, replace(stored, folder=out.path))
            if spoil is not None:
                (folder / "result.json").write_text(spoil, encoding="utf-8")
            run = SimpleNamespace(time=time, max_iterations=max_iterations)
            return finished_result(out, run)

    return call


@pytest.mark.parametrize("end", ["tight", "stuck", "saturated", "solid", "stop_after"])
def test_a_finished_run_returns_its_result(resumed, end):
    found = resumed(replace(STORED, ended_by=end), time=9e9, max_iterations=99)
    assert (found.ended_by, found.limits, found.iterations) == (
        end,
        STORED.limits,
        STORED.iterations,
    )


def test_a_run_ended_by_iterations_goes_on_with_more_of_them(resumed):
    assert resumed(STORED).reason == "by iterations"
    assert resumed(STORED, time=9e9).reason == "by iterations"
    assert resumed(STORED, max_iterations=2) is None


def test_a_run_ended_by_time_goes_on_with_more_of_it(resumed):
    by_time = replace(STORED, ended_by="time")
    assert resumed(by_time, max_iterations=6).ended_by == "time"
    assert resumed(by_time, time=1500.0) is None


def test_a_failed_or_damaged_run_goes_on(resumed):
    assert resumed(replace(STORED, status="failed", ended_by="error")) is None
    assert resumed(replace(STORED, ended_by="tight"), spoil="{}") is None
