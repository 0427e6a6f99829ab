"""Sampling of cells, property tables, their file form and the cache."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gradedesign.errors import DensityError, PluginError, SolverError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.mechanics.homogenise import cached_table
from gradedesign.mechanics.homogenise import cell_properties as cell_properties_module
from gradedesign.mechanics.homogenise import table as table_module
from gradedesign.mechanics.homogenise.bounds import require_bounds
from gradedesign.mechanics.homogenise.cached_table import (
    ON_DEMAND_RESOLUTION,
    computed_law,
    on_demand_resolution,
    property_table,
)
from gradedesign.mechanics.homogenise.cell_properties import cell_properties, cubic_part
from gradedesign.mechanics.homogenise.sampling import cell_fill, require_resolved
from gradedesign.mechanics.homogenise.table import compute_table, table_densities
from gradedesign.mechanics.material.property_table import read_property_table, write_property_table
from gradedesign.mechanics.material.tabulated_law import tabulated_law


def skewed_gyroid(u, skew=0.0):
    x, y, z = 2 * np.pi * u
    return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + (1 + skew) * np.sin(z) * np.cos(x)


NETWORK = CellFamily(name="test-network", shape=skewed_gyroid, parameters={"skew": 0.0})
SHEET = CellFamily(name="test-sheet", shape=lambda u: np.abs(skewed_gyroid(u)), sides=2)
SKEWED = CellFamily(
    name="test-skewed", shape=skewed_gyroid, parameters={"skew": 0.4}, symmetry="none"
)


def test_fill_has_the_density_asked_for() -> None:
    fill = cell_fill(calibrate(NETWORK), 0.3, 20)
    assert fill.mean() == pytest.approx(0.3, abs=1e-3)
    assert set(np.round(np.unique(fill) * 81).astype(int)) <= set(range(82))
    np.testing.assert_array_equal(fill, fill.transpose(1, 2, 0))


def rods(u):
    """Distance to the nearest of three rods along the edges of the cell."""
    squares = np.square(u - np.round(u))
    return np.sqrt(squares.sum(axis=0) - squares.max(axis=0))


RODS = CellFamily(name="test-rods", shape=rods, distance=True)


@pytest.mark.parametrize(("rho", "voxels"), [(0.1, 24), (0.05, 32), (0.3, 16)])
def test_a_strut_cell_is_filled_to_the_density_exactly(rho, voxels) -> None:
    # Many samples of a strut lie at the level: counted in full, they are 1 to 4 % too much.
    assert cell_fill(calibrate(RODS), rho, voxels).mean() == pytest.approx(rho, rel=1e-9)
    whole = cell_fill(calibrate(RODS), rho, voxels, share_ties=False)
    assert whole.mean() > 1.002 * rho


def test_a_thin_strut_takes_twice_the_voxels_of_a_thin_wall(monkeypatch) -> None:
    asked = []

    def stop(cell, rho, resolution, edges):
        asked.append(resolution)
        raise DensityError("enough")

    monkeypatch.setattr(cell_properties_module, "require_resolved", stop)
    # By hand: a wall of 0.06 has 3.8 voxels of 1/64 and 6.7 of 1/112, one of 0.01 never has six.
    for family, wall in ((RODS, 0.06), (SHEET, 0.06), (RODS, 0.01)):
        monkeypatch.setattr(
            "gradedesign.mechanics.homogenise.sampling.wall_mm", lambda *_, w=wall: w
        )
        with pytest.raises(DensityError, match="enough"):
            cell_properties(calibrate(family), 0.1)
    assert asked == [112, 64, 128]


@given(rho=st.floats(0.2, 0.7))
@settings(max_examples=10, deadline=None)
def test_shared_ties_fill_to_the_density_and_no_further(rho) -> None:
    # Without symmetry no two samples tie: the last one alone is shared.
    def uneven(u, skew):
        x, y, z = 2 * np.pi * u
        return skewed_gyroid(u, skew) + 0.1 * np.sin(x + 0.3) + 0.07 * np.cos(y + 2 * z)

    skewed = replace(SKEWED, shape=uneven)
    for density, subsamples in ((rho, 1), (rho, 3), (0.25, 3), (0.5, 3)):
        fill = cell_fill(calibrate(skewed), density, 8, subsamples=subsamples, share_ties=True)
        assert fill.mean() == pytest.approx(density, rel=1e-9)
        assert 0 <= fill.min() <= fill.max() <= 1


def test_fill_of_one_sample_is_the_voxel_centre() -> None:
    fill = cell_fill(calibrate(NETWORK), 0.3, 12, subsamples=1)
    axis = (np.arange(12) + 0.5) / 12
    value = skewed_gyroid(np.stack(np.meshgrid(axis, axis, axis, indexing="ij")))
    inside = value[fill == 1.0]
    assert set(np.unique(fill)) == {0.0, 1.0}
    assert inside.max() <= value[fill == 0.0].min() + 1e-12


def test_density_below_the_percolation_floor_is_refused() -> None:
    with pytest.raises(DensityError, match="falls apart"):
        cell_fill(calibrate(NETWORK), 0.005, 16)


def test_a_wall_of_two_voxels_is_refused() -> None:
    # gyroid sheet at 0.1: area 3.09 per cell, so a mean wall of 0.032, 0.0287 where thinnest.
    with pytest.raises(DensityError, match=r"0\.92 voxels .* take resolution 108"):
        require_resolved(calibrate(SHEET), 0.1, 32)
    with pytest.raises(DensityError, match="voxels across its thinnest wall"):
        cell_properties(calibrate(SHEET), 0.1, resolution=32)


def test_odd_resolution_is_refused() -> None:
    with pytest.raises(SolverError, match="resolution 15"):
        cell_properties(calibrate(NETWORK), 0.3, resolution=15)


def test_declared_cubic_symmetry_is_checked() -> None:
    c = np.diag([3.0, 3.0, 3.0, 1.0, 1.0, 1.0])
    np.testing.assert_array_equal(cubic_part(c, "x"), c)
    c[0, 0] *= 1.2
    with pytest.raises(SolverError, match="departs by"):
        cubic_part(c, "x")


def test_densities_of_a_table() -> None:
    found = table_densities(calibrate(NETWORK), 64)
    assert found[0] == 0.05
    assert found[-1] == 0.8
    assert (np.diff(found) > 0).all()
    sheet = table_densities(calibrate(SHEET), 64)
    # 3 / 64 of a cell: 0.0469 over 0.2865 per unit of density.
    assert sheet[0] == pytest.approx(0.0469 / 0.2865, abs=0.003)


HEARD = []


@pytest.fixture(scope="module")
def small_table():
    def hear(row, number, count):
        HEARD.append((row.density, number, count))

    return compute_table(calibrate(SKEWED), densities=(0.25, 0.4, 0.6), resolution=16, on_row=hear)


def test_every_row_of_a_table_is_heard_of(small_table) -> None:
    assert HEARD == [(0.25, 1, 3), (0.4, 2, 3), (0.6, 3, 3)]


def test_table_round_trip(small_table) -> None:
    again = read_property_table(write_property_table(small_table))
    np.testing.assert_allclose(again.stiffness, small_table.stiffness, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(again.strength, small_table.strength, rtol=1e-4)
    assert again.family == "test-skewed"
    assert again.parameters == {"skew": 0.4}
    assert again.symmetry == "none"
    assert set(again.factors) == set(small_table.factors)
    assert "99.5" in again.method
    assert again.date.count("-") == 2
    assert write_property_table(again) == write_property_table(small_table)


def test_table_of_a_skewed_cell_keeps_its_anisotropy(small_table) -> None:
    for rho, c in zip(small_table.density, small_table.stiffness, strict=True):
        require_bounds(c, float(rho), 0.3)
    c = small_table.stiffness[0]
    assert abs(c[0, 0] - c[1, 1]) > 0.02 * c[0, 0]
    law = tabulated_law(small_table)
    np.testing.assert_allclose(law.stiffness(np.array(0.25)), c, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace('table": 1', 'table": 2'), "has format 2"),
        (lambda text: text[: len(text) // 2], "no property table"),
        (lambda text: f"[{len(text)}]", "no property table"),
        (lambda text: text.replace('"strength":', '"weakness":'), "damaged"),
        (lambda text: text.replace('"density": 0.4', '"density": 0.2'), "damaged"),
        (lambda text: text.replace('"density": 0.4', '"density": NaN'), "damaged"),
    ],
)
def test_damaged_tables_are_refused(small_table, change, message) -> None:
    with pytest.raises(PluginError, match=message):
        read_property_table(change(write_property_table(small_table)))


def test_tables_are_computed_once(small_table, monkeypatch, tmp_path, caplog) -> None:
    calls = []

    def compute(cell, **options):
        calls.append((cell.name, cell.parameters, options))
        return small_table

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(cached_table, "compute_table", compute)
    first = property_table(calibrate(SKEWED))
    second = property_table(calibrate(SKEWED))
    assert len(calls) == 1
    np.testing.assert_allclose(second.stiffness, first.stiffness, rtol=1e-6, atol=1e-9)
    # Anything that changes the numbers changes the key.
    property_table(calibrate(SKEWED, {"skew": 0.3}))
    property_table(calibrate(SKEWED), poissons_ratio=0.4)
    property_table(calibrate(SKEWED), resolution=32)
    changed = CellFamily(
        name="test-skewed",
        shape=lambda u, skew: skewed_gyroid(u, skew) + 0.1 * np.cos(2 * np.pi * u[0]),
        parameters={"skew": 0.4},
        symmetry="none",
    )
    property_table(calibrate(changed))
    assert len(calls) == 5
    # A damaged entry counts as absent.
    for entry in tmp_path.rglob("*.npz"):
        entry.write_bytes(entry.read_bytes()[:-20])
    with caplog.at_level(logging.WARNING):
        property_table(calibrate(SKEWED))
    assert len(calls) == 6


def test_a_law_on_demand_is_that_of_the_cached_table(small_table, monkeypatch, tmp_path) -> None:
    asked = []

    def compute(cell, **options):
        asked.append(options["resolution"])
        return small_table

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(cached_table, "compute_table", compute)
    law = computed_law(calibrate(SKEWED))
    assert asked == [ON_DEMAND_RESOLUTION]
    assert law.kind == "computed"
    assert law.families == ("test-skewed",)
    assert law.window == (0.25, 0.6)
    np.testing.assert_allclose(
        law.stiffness(np.array(0.4)), small_table.stiffness[1], rtol=1e-5, atol=1e-9
    )
    computed_law(calibrate(SKEWED))
    assert len(asked) == 1


def test_a_law_that_will_not_meet_the_densities_is_refused_before_it_is_computed(
    monkeypatch, tmp_path
) -> None:
    def compute(*_, **__):
        raise AssertionError("computed")

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(cached_table, "compute_table", compute)
    # A sheet of 48 voxels has three across its wall from 3 / 48 / 0.2865 = 0.218 on.
    with pytest.raises(DensityError, match=r"0\.05 to 0\.1: on 48\^3 voxels .* 0\.2\d+ to 0\.8"):
        computed_law(calibrate(SHEET), resolution=48, density=(0.05, 0.1))
    with pytest.raises(DensityError, match=r"the cell exists from 0\.\d+ to 0\.9"):
        computed_law(calibrate(SHEET), resolution=48, density=(0.85, 0.9))
    with pytest.raises(AssertionError, match="computed"):
        computed_law(calibrate(SHEET), resolution=48, density=(0.1, 0.4))


def test_a_thin_cell_takes_as_many_voxels_as_its_wall_needs(monkeypatch) -> None:
    # Origin: a wall of 0.054 cells has three voxels from 55.6 along the cell on.
    monkeypatch.setattr(table_module, "wall_mm", lambda *_: np.array(0.054))
    monkeypatch.setattr(table_module, "density_for_wall", lambda *_: 0.3)
    with pytest.raises(
        DensityError, match=r"2\.59 voxels.*at resolution 48.*resolution needed: 56"
    ):
        table_densities(calibrate(NETWORK), 48)
    assert on_demand_resolution(calibrate(NETWORK)) == 64
    monkeypatch.setattr(table_module, "wall_mm", lambda *_: np.array(0.0219))
    with pytest.raises(DensityError, match=r"at resolution 128.*resolution needed: 138"):
        on_demand_resolution(calibrate(NETWORK))
    monkeypatch.setattr(table_module, "wall_mm", lambda *_: np.array(0.0))
    with pytest.raises(DensityError, match="resolution needed: none will do"):
        table_densities(calibrate(NETWORK), 48)


def test_no_law_where_strength_falls_with_density(small_table, monkeypatch, tmp_path) -> None:
    falling = replace(small_table, strength=small_table.strength[::-1])
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(cached_table, "compute_table", lambda *_, **__: falling)
    with pytest.raises(SolverError, match="test-skewed"):
        computed_law(calibrate(SKEWED))


def test_a_cell_that_repeats_after_two_is_sampled_over_both() -> None:
    double = CellFamily(
        name="test-double", shape=lambda u: skewed_gyroid(u / 2), period=2, symmetry="none"
    )
    single = cell_fill(calibrate(NETWORK), 0.4, 12)
    np.testing.assert_allclose(cell_fill(calibrate(double), 0.4, 12), single)
