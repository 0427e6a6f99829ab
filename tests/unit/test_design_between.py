"""The mixture of two earlier designs that enclose the limits."""

import math

import pytest

from gradedesign.design.loop.design_between import design_between
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.row import LimitRow

PULL, SIDE = (LimitKey(kind="displacement", region=region) for region in ("tip", "side"))


def rows(**uses):
    keys = {"pull": PULL, "side": SIDE}
    return tuple(
        LimitRow(
            key=keys[name], name=name, load_case=name, value=2.0 * use, limit=2.0, unit="mm",
            judged_by="by hand",
        )
        for name, use in uses.items()
    )  # fmt: skip


def found(designs, factors=None):
    """``designs`` are (mass, utilisations) in order."""
    return design_between([m for m, _ in designs], [u for _, u in designs], factors or {})


BEFORE = (8.0, rows(pull=1.8))


def test_it_lies_where_the_logarithms_meet_the_aim():
    between = found([BEFORE, (10.3, rows(pull=0.92)), (10.0, rows(pull=1.05))])
    assert (between.lighter, between.heavier) == (2, 1)
    # By hand: ln(1.05 / 0.985) over ln(1.05 / 0.92), the aim of sizing being 98.5 %.
    assert between.way == pytest.approx(math.log(1.05 / 0.985) / math.log(1.05 / 0.92))
    assert 1.05 * (0.92 / 1.05) ** between.way == pytest.approx(0.985)
    # Values of a limit of 2 mm, explicit: what the next analysis is compared with.
    assert between.values == {PULL: pytest.approx(2.0 * 0.985)}


def test_factors_of_acceptance_count():
    designs = [BEFORE, (10.3, rows(pull=0.90)), (10.0, rows(pull=0.99))]
    assert found(designs) is None  # nothing is broken but a far lighter design
    between = found(designs, {PULL: 1.05})
    assert between.way == pytest.approx(math.log(0.99 * 1.05 / 0.985) / math.log(0.99 / 0.90))
    assert between.values == {PULL: pytest.approx(2.0 * 0.985 / 1.05)}


def test_the_limit_that_asks_for_most_decides():
    light, heavy = rows(pull=1.05, side=1.02), rows(pull=0.80, side=0.95)
    between = found([BEFORE, (10.3, heavy), (10.0, light)])
    assert between.way == pytest.approx(math.log(1.02 / 0.985) / math.log(1.02 / 0.95))


def test_the_nearest_designs_enclose_it():
    designs = [
        (9.9, rows(pull=1.1)), (10.5, rows(pull=0.90)), (10.0, rows(pull=1.04)),
        (10.2, rows(pull=0.95)),
    ]  # fmt: skip
    between = found(designs)
    assert (between.lighter, between.heavier) == (2, 3)


@pytest.mark.parametrize(
    "designs",
    [
        [(10.3, rows(pull=0.92)), (10.0, rows(pull=1.05))],  # the model has its chance first
        [BEFORE, (10.0, rows(pull=1.05)), (10.2, rows(pull=1.02))],  # none holds
        [BEFORE, (10.3, rows(pull=0.92)), (9.7, rows(pull=1.05))],  # 5.8 % of mass apart
        [BEFORE, (10.0, rows(pull=0.92)), (10.3, rows(pull=1.05))],  # the heavier one breaks it
        [BEFORE, (10.3, rows(pull=0.99)), (10.0, rows(pull=1.05))],  # that one is wanted itself
        [BEFORE, (10.3, rows(pull=0.0)), (10.0, rows(pull=1.05))],
        [BEFORE, (10.3, rows(pull=0.9)), (10.0, rows(pull=math.inf))],
    ],
)
def test_otherwise_sizing_goes_on(designs):
    assert found(designs) is None
