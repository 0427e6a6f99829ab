"""Errors of single constants: their names, their file form, what laws and pages say of them."""

import json

import numpy as np
import pytest

from gradedesign import PluginError, read_property_table
from gradedesign.mechanics.material.property_table import PropertyTable, write_property_table
from gradedesign.mechanics.material.stiffness_constants import (
    constant_errors,
    independent_entries,
    relative_errors,
)
from gradedesign.mechanics.material.tabulated_law import tabulated_law


def cubic(c11, c12, c44):
    c = np.diag([c11 - c12] * 3 + [c44] * 3)
    c[:3, :3] += c12
    return c


def table(**change):
    settings = {
        "name": "cube-computed",
        "family": "cube",
        "parameters": {},
        "symmetry": "cubic",
        "poissons_ratio": 0.3,
        "density": [0.1, 0.3],
        "stiffness": [cubic(0.02, 0.01, 0.008), cubic(0.1, 0.04, 0.03)],
        "uncertainty": [cubic(4e-4, 1e-4, 4e-4), cubic(1e-3, 2e-4, 3e-4)],
        "stiffness_error": [0.03, 0.01],
        "strength": [0.02, 0.1],
        "strength_error": [0.05, 0.02],
        "resolution": [64, 64],
        "percentile": 99.5,
        "method": "m",
        "version": "v",
        "date": "d",
    }
    return PropertyTable(**settings | change)


def test_each_constant_has_an_error_of_its_own():
    # By hand: 4e-4 / 0.02, 1e-4 / 0.01, 4e-4 / 0.008, and so on.
    errors = constant_errors(table())
    assert list(errors) == ["C11", "C12", "C44"]
    np.testing.assert_allclose(errors["C11"], [0.02, 0.01])
    np.testing.assert_allclose(errors["C12"], [0.01, 0.005])
    np.testing.assert_allclose(errors["C44"], [0.05, 0.01])


def test_the_worst_of_equal_entries_counts_and_a_constant_of_zero_has_no_error():
    c, each = cubic(1.0, 1e-5, 0.2), cubic(0.01, 0.01, 0.01)
    each[4, 4] = 0.04
    errors = relative_errors(c[None], each[None], "cubic")
    assert set(errors) == {"C11", "C44"}
    assert errors["C44"][0] == pytest.approx(0.2)


def test_lower_symmetry_has_more_constants():
    assert len(independent_entries("orthotropic")) == 9
    assert len(independent_entries("none")) == 21


def test_the_errors_are_kept_in_the_file_and_reach_the_law():
    text = write_property_table(table())
    again = read_property_table(text)
    np.testing.assert_allclose(again.uncertainty, table().uncertainty, rtol=0.05)
    assert write_property_table(again) == text
    coefficients = dict(tabulated_law(again).coefficients)
    assert coefficients["C44_error"] == pytest.approx(0.05)
    assert coefficients["C12_error"] == pytest.approx(0.01)


def test_a_table_of_before_states_its_one_error():
    old = write_property_table(table(uncertainty=None))
    assert "uncertainty" not in old
    again = read_property_table(old)
    assert again.uncertainty is None
    assert constant_errors(again) == {}
    coefficients = dict(tabulated_law(again).coefficients)
    assert coefficients["stiffness_error"] == 0.03
    assert not any(name.startswith("C") for name in coefficients)


def test_a_table_that_lost_an_error_is_damaged():
    data = json.loads(write_property_table(table()))
    del data["rows"][1]["uncertainty"]
    with pytest.raises(PluginError, match="damaged"):
        read_property_table(json.dumps(data))
    data["rows"][1]["uncertainty"] = [0.1]
    with pytest.raises(PluginError, match="1 entries of a symmetric matrix"):
        read_property_table(json.dumps(data))
    with pytest.raises(ValueError, match="negative"):
        table(uncertainty=-np.ones((2, 6, 6)))
