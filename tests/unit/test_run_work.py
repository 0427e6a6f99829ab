"""Unknowns and tetrahedra of a run, predicted from its prepared case."""

from dataclasses import replace
from pathlib import Path

import pytest

import gradedesign
from gradedesign.design.loop.predicted_cost import WITHIN
from gradedesign.design.loop.run_work import guessed_density, run_work
from gradedesign.design.resolve.design_model import prepare
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.program.host.registry import build_registry

MINI = Path(__file__).parents[2] / "cases" / "mini"


@pytest.fixture(scope="module")
def setup():
    return prepare(gradedesign.load_case(MINI), build_registry())


def solid(use, kind="displacement"):
    return LimitRow(
        key=LimitKey(kind=kind), name="any", load_case="shear", value=use, limit=1.0, unit="any",
        judged_by="solid part",
    )  # fmt: skip


def test_the_explicit_lattice_of_mini_is_predicted(setup):
    # Two iterations of the case: 84 549 and 86 259 unknowns; the solid part uses 19.0 % of its
    # displacement, 5.4 % of its stress.
    work = run_work(replace(setup, solid=(solid(0.19), solid(0.054, "stress"))))
    for measured in (84_549, 86_259):
        assert measured / WITHIN < work.explicit_dofs < measured * WITHIN
    assert (work.part_dofs, work.load_cases, work.adjoint_solves) == (4131, 1, 3)
    # The case asks for the whole lattice: 30 034 tetrahedra by the mesher.
    assert 30_034 / WITHIN < work.mesher_tets < 30_034 * WITHIN


def test_density_follows_what_the_solid_part_can_spare(setup):
    low, high = setup.cells.bounds

    def guessed(*rows):
        return guessed_density(setup.cells, setup.limits, rows)

    assert guessed() == pytest.approx(low + (high - low) / 3)
    assert guessed(solid(1e-6)) == pytest.approx(low)
    assert guessed(solid(0.999)) == pytest.approx(high)
    assert guessed(solid(0.999, "stress")) == pytest.approx(high)
    some = [guessed(solid(use)) for use in (0.2, 0.25, 0.3)]
    assert some == sorted(some)
