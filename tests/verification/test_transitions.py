"""Transitions between installed families at a relative density of 0.3.

Whatever the pair: one connected piece, the cells at both ends those of the pure family, the
density of every slab of one cell kept. The necks are measured, and none is zero.
"""

import itertools

import numpy as np
import pytest
from oracles.transition_density import density_error

from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cells import cell_pair
from gradedesign.geometry.cell.neck import joining_shift, measure_neck
from gradedesign.geometry.cell.shape import spread_points
from gradedesign.program.host.registry import build_registry

RHO = 0.3
TEN = (
    "gyroid-sheet", "gyroid-network", "diamond-sheet", "diamond-network", "primitive-sheet",
    "bcc", "fcc", "octet", "kelvin", "sc",
)  # fmt: skip
FEW = (("gyroid-sheet", "bcc"), ("diamond-network", "octet"), ("kelvin", "sc"))


@pytest.fixture(scope="module")
def families():
    return build_registry().cell_families


def require_transition(families, first, second):
    one, two = (calibrate(families[name]) for name in (first, second))
    shift = joining_shift(one, two, RHO)
    mixed = cell_pair(one, two, shift=shift)
    neck = measure_neck(mixed, RHO, resolution=24)
    assert neck.components == 1
    assert neck.floating < 0.005
    assert neck.width > 0
    assert neck.area > 0.1
    # Over two cells the weight changes much within one, so a slab need not keep its density.
    assert density_error(mixed, RHO) < 0.04
    u = spread_points(20_000)
    for weight, cell, moved in ((0.0, one, u), (1.0, two, u - np.array(shift)[:, None])):
        with_weight = np.concatenate([u, [np.full(u.shape[1], w) for w in (1 - weight, weight)]])
        exact = cell.family.shape(moved, **cell.parameters) <= cell.level_of(RHO)
        np.testing.assert_array_equal(mixed.shape(with_weight) <= RHO, exact)
    return shift, neck


@pytest.mark.parametrize(("first", "second"), FEW)
def test_few_pairs(families, first, second):
    require_transition(families, first, second)


@pytest.mark.slow
@pytest.mark.parametrize(("first", "second"), [*itertools.combinations(TEN, 2)])
def test_any_two_of_ten(families, first, second, record_property):
    shift, neck = require_transition(families, first, second)
    record_property("shift", shift)
    thinner = min(neck.first_width, neck.second_width)
    record_property("neck over the thinner family's", neck.width / thinner)
