"""A parameter that changes from place to place: ends untouched, density exact between."""

from dataclasses import replace

import numpy as np
import pytest

from gradedesign.design.case.read_case import load_case
from gradedesign.errors import CaseError, DensityError
from gradedesign.geometry.cell.cells import cell_increments, row_weights
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.shape import spread_points
from gradedesign.pipeline import run
from gradedesign.program.host.registry import build_registry


def waving(u, amplitude=0.0, bars=1.0):
    """Distance, about, from struts along the axes that wave by an amplitude."""
    rows = []
    for i in range(3):
        along, a, b = u[i], u[i - 1], u[i - 2]
        off = a - amplitude * np.sin(2 * np.pi * along)
        rows.append(np.hypot(off - np.round(off), b - np.round(b)))
    return np.minimum.reduce(rows) * bars


WAVING = CellFamily(
    name="waving", shape=waving, parameters={"amplitude": 0.0, "bars": 1.0}, symmetry="none"
)
POINTS = spread_points(60_000)


@pytest.fixture(scope="module")
def steps():
    """Five increments from waving to straight bars."""
    return cell_increments(WAVING, None, "amplitude", (0.2, 0.0), 5)


def at(share):
    return np.concatenate([POINTS, row_weights(np.full(POINTS.shape[1], share), 5)])


def test_increments_are_the_family_itself(steps):
    for n, amplitude in enumerate([0.2, 0.15, 0.1, 0.05, 0.0]):
        cell = steps.members[n]
        assert cell.parameters == {"amplitude": pytest.approx(amplitude), "bars": 1.0}
        exact = waving(POINTS, **cell.parameters) <= cell.level_of(0.3)
        np.testing.assert_array_equal(steps.shape(at(n / 4)) <= 0.3, exact)


def test_the_density_between_increments_is_the_one_asked_for(steps):
    # 60,000 points: a standard deviation of 0.002 at most, less for evenly spread ones.
    for share in (0.07, 0.33, 0.5, 0.81):
        values = steps.shape(at(share))
        for rho in (0.15, 0.3, 0.5):
            assert np.mean(values <= rho) == pytest.approx(rho, abs=0.003)


def test_levels_are_densities_of_the_common_window(steps):
    low, high = steps.window
    assert low == max(c.window[0] for c in steps.members)
    assert float(steps.level_of(0.3)) == 0.3
    with pytest.raises(DensityError, match=r"for all amplitude from 0\.2 to 0 at relative"):
        steps.level_of(high + 0.01)


@pytest.mark.parametrize(
    ("name", "ends", "count", "words"),
    [
        ("radius", (0, 1), 3, "no parameter 'radius'; its parameters: amplitude, bars"),
        ("amplitude", (0.1, 0.1), 3, "expected two or more between different values"),
        ("amplitude", (0.0, 0.1), 1, "1 increments of 'amplitude'"),
    ],
)
def test_impossible_increments_are_refused(name, ends, count, words):
    with pytest.raises(CaseError, match=words):
        cell_increments(WAVING, None, name, ends, count)


CASE = """\
[case]
name = "waving"
[part]
box = ["30 mm", "6 mm", "6 mm"]
[lattice]
cell = "waving"
size = "6 mm"
origin = ["3 mm", "3 mm", "3 mm"]
"""
CONSTANT = "density = 0.3\n"
RAMP = '[lattice.density_map]\nformula = "0.2 + 0.2 * x / 30"\n'
TO_STRAIGHT = '[lattice.parameter_map]\nparameter = "amplitude"\nvalues = [0.2, 0.0]\n'


@pytest.fixture(scope="module")
def registry():
    known = build_registry()
    return replace(known, cell_families={**known.cell_families, "waving": WAVING})


def generated(folder, text, registry):
    (folder / "case.toml").write_text(CASE + text)
    return run(load_case(folder), registry, folder=folder / "out")


@pytest.mark.parametrize(
    "text",
    [
        CONSTANT + TO_STRAIGHT + 'formula = "0.2 - 0.2 * x / 30"\nincrements = 5\n',
        RAMP + TO_STRAIGHT + "increments = 5\n",
    ],
    ids=["by place", "by density"],
)
def test_every_slab_has_its_density(tmp_path, registry, text):
    result = generated(tmp_path, text, registry)
    slabs = result.measures["density"]["slabs"]["x"]
    wanted = [0.3] * 5 if "density = 0.3" in text else [0.22, 0.26, 0.3, 0.34, 0.38]
    np.testing.assert_allclose(slabs["target"], wanted, atol=1e-3)
    # The bar of the project for graded lattices.
    assert slabs["largest_error_of_field"] < 0.01
    assert slabs["largest_error_of_surface"] < 0.01
    assert result.measures["transition"]["parameter"] == "amplitude"
    assert result.measures["transition"]["values"] == pytest.approx([0.2, 0.15, 0.1, 0.05, 0])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (CONSTANT + TO_STRAIGHT, "follows the density without a formula"),
        (CONSTANT + TO_STRAIGHT.replace("amplitude", "radius") + 'formula = "x"\n', "radius"),
        (CONSTANT + TO_STRAIGHT + 'formula = "x / 30"\n', "asks for lowest -4 at"),
        (CONSTANT + TO_STRAIGHT.replace("[0.2, 0.0]", "[0.1, 0.1]"), "two different numbers"),
        ("parameters = {amplitude = 0.1}\n" + CONSTANT + TO_STRAIGHT + 'formula = "0"', "changes"),
        (
            CONSTANT + TO_STRAIGHT + 'formula = "0"\n[lattice.transition]\ncell = "bcc"\n'
            'weight = "0.5"\n',
            "does not go with",
        ),
    ],
)
def test_impossible_parameter_maps_are_refused(tmp_path, registry, text, words):
    with pytest.raises((CaseError, DensityError), match=words):
        generated(tmp_path, text, registry)
