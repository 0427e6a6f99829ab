"""What other bodies would weigh, as the verdict of a run states it."""

import time
from functools import partial
from types import SimpleNamespace

import pytest

from gradedesign import pipeline
from gradedesign.common.system.limits import Deadline
from gradedesign.common.system.progress import ignore
from gradedesign.design.check import lighter_phases as phases_module
from gradedesign.design.check.lighter_phases import lighter_phases
from gradedesign.design.check.price import PricedBody, asked_body, why_lattice
from gradedesign.design.loop.announce import Announcer
from gradedesign.errors import CaseError
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.program.store.run_folder import open_run_folder

NAMES = ("uniform lattice", "graded lattice")


@pytest.fixture
def priced(tmp_path):
    """Bodies that a run with some seconds left states, and how often any was sized so far."""
    sized = []

    def price(takes, why_not):
        bodies = []
        for name in NAMES:
            note = why_not()
            if not note:
                sized.append(name)
                time.sleep(takes)
            bodies.append(PricedBody(name=name, mass_g=None, largest_utilisation=None, note=note))
        return tuple(bodies)

    def call(*, seconds=1000.0, takes=0.0):
        announce, deadline = Announcer(ignore), Deadline(seconds)
        with open_run_folder(tmp_path / "run", "same", resume=True, overwrite=False) as out:
            bodies = pipeline._priced(partial(price, takes), out, "key", announce, deadline)
        return [body.note for body in bodies], len(sized)

    return call


def test_a_resumed_run_does_not_size_other_bodies_again(priced):
    assert priced() == (["", ""], 2)
    assert priced() == (["", ""], 2)


def test_without_time_they_are_left_out_and_a_resumed_run_sizes_them(priced):
    notes, count = priced(seconds=0.3, takes=0.2)
    assert notes == ["", "left out: 0 of 0 s of [run] time are left"]
    assert count == 1
    assert priced() == (["", ""], 3)


@pytest.mark.parametrize(
    ("stated", "asked"),
    [
        ({}, "lattice and solid"),
        ({"phases": ["lattice", "solid"], "grading": "thickness"}, "lattice and solid"),
        ({"phases": ["lattice"]}, "graded lattice"),
        ({"grading": "uniform"}, "uniform lattice"),
        ({"method": "stress-to-density"}, "stress mapped to density"),
    ],
)
def test_one_body_is_the_one_that_the_case_asks_for(stated, asked):
    lattice = LatticeSpec.model_validate({"cell": "bcc", "size": "8 mm", **stated})
    assert asked_body(lattice) == asked


def test_the_sentence_compares_with_bodies_that_hold():
    def body(name, mass, used=0.99, *, asked=False):
        return PricedBody(name=name, mass_g=mass, largest_utilisation=used, asked=asked)

    own = body("graded lattice", 10.0, asked=True)
    broken = body("lattice and solid", 8.0, 1.2)
    void = body("solid and void", 5.0)
    assert why_lattice([own, broken]) == (
        "no other body that was looked at is lighter at these limits."
    )
    assert why_lattice([own, body("lattice and solid", 8.0), void]) == (
        'lattice and solid would weigh 20% less: phases = ["lattice", "solid"]. Without cells, '
        "solid and void would weigh 50% less by stiffness alone, "
        'phases = ["solid", "void"] and least_member: lattice is there because the body is to '
        "stay filled."
    )


@pytest.mark.parametrize(
    ("filled", "empty", "made", "words"),
    [
        (
            (8.0, 1.0),
            (5.0, 1.004),
            "empty",
            "sized: lattice and solid 8 g; solid and void 5 g. The run makes solid and void",
        ),
        ((8.0, 1.0), (9.0, 0.98), "filled", "9 g. The run makes lattice and solid"),
        ((8.0, 1.0), (5.0, 1.1), "filled", "solid and void 5 g, a limit is broken. The run makes"),
        ((8.0, 1.2), (9.0, 0.98), "empty", "8 g, a limit is broken; solid and void 9 g. The run"),
        ((8.0, 1.2), (7.0, 1.1), "filled", "The run makes lattice and solid"),
        ((8.0, 1.0), None, "filled", "solid and void left out, buckling of cells: empty. The run"),
        (None, (5.0, 1.1), "empty", "left out, buckling of cells: filled; solid and void 5 g, a"),
    ],
)
def test_of_two_bodies_the_lighter_one_that_holds_is_made(monkeypatch, filled, empty, made, words):
    model, bodies, told = _lighter(monkeypatch, {"filled": filled, "empty": empty})
    assert model.homogenised == made
    assert [b.asked for b in bodies] == [made == "filled", made == "empty"]
    assert words in told


def test_where_no_body_can_be_sized_the_first_ones_error_is_raised(monkeypatch):
    with pytest.raises(CaseError, match="buckling of cells: filled"):
        _lighter(monkeypatch, {"filled": None, "empty": None})


def _lighter(monkeypatch, sizes):
    """`lighter_phases` of two bodies with these masses and utilisations; None cannot be made."""

    def body(name, model, _):
        mass, used = sizes[model]
        note = "a limit is broken" if used > 1.004 else ""
        return PricedBody(name=name, mass_g=mass, largest_utilisation=used, note=note)

    def made(name):
        if sizes[name] is None:
            raise CaseError(f"buckling of cells: {name}")
        return SimpleNamespace(homogenised=name)

    for name in ("size_design", "design_filter"):
        monkeypatch.setattr(phases_module, name, lambda *_: None)
    monkeypatch.setattr(phases_module, "sized_body", body)
    return lighter_phases(
        {
            ("lattice", "solid"): lambda: made("filled"),
            ("solid", "void"): lambda: made("empty"),
        }
    )
