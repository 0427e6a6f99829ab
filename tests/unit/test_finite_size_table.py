"""Tables of finite-size ratios: strict reading, interpolation, and the ones that are shipped."""

import json
import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from gradedesign import PluginError, read_finite_size_table
from gradedesign.cell.calibration import calibrate
from gradedesign.homogenise.finite_size import finite_size
from gradedesign.homogenise.finite_size_rows import finite_size_row, finite_size_table
from gradedesign.homogenise.sampling import LEAST_VOXELS, voxels_in_wall
from gradedesign.material.finite_size_table import (
    FiniteRatio,
    FiniteSizeRow,
    FiniteSizeTable,
    ratio_at,
    write_finite_size_table,
)
from gradedesign.plugin.registry import build_registry

DOCS = Path(__file__).parents[2] / "docs" / "homogenisation.md"
REGISTRY = build_registry()
SHIPPED = REGISTRY.finite_size_tables


def ratios(*values):
    return tuple(
        FiniteRatio(cells=n, value=v, error=0.01, spread=0.002) for n, v in enumerate(values, 1)
    )


def table(**changes):
    rows = tuple(
        FiniteSizeRow(
            density=rho,
            resolution=24,
            block=ratios(0.5 + rho, 0.95),
            wall=ratios(0.8, 0.9),
            wall_shear=ratios(0.95),
        )
        for rho in (0.2, 0.4)
    )
    values = {
        "family": "test",
        "parameters": {"a": 0.5},
        "poissons_ratio": 0.3,
        "rows": rows,
        "method": "none",
        "version": "1",
        "date": "2026-11-21",
    }
    return FiniteSizeTable(**{**values, **changes})


def test_what_was_written_is_read_again():
    text = write_finite_size_table(table())
    again = read_finite_size_table(text)
    assert again.rows == table().rows
    assert dict(again.parameters) == {"a": 0.5}
    assert (again.name, again.family, again.poissons_ratio) == ("test", "test", 0.3)
    assert (again.method, again.version, again.date) == ("none", "1", "2026-11-21")
    assert write_finite_size_table(again) == text


def damaged(change):
    data = json.loads(write_finite_size_table(table()))
    change(data)
    return json.dumps(data)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lambda d: d.update({"gradedesign finite size table": 2}), "format 2"),
        (lambda d: d.update({"gradedesign finite size table": True}), "format True"),
        (lambda d: d.update(more=1), "keys"),
        (lambda d: d.pop("date"), "keys"),
        (lambda d: d["rows"][0].pop("wall"), "keys"),
        (lambda d: d["rows"].reverse(), "increasing"),
        (lambda d: d["rows"].pop(), "two or more"),
        (lambda d: d["rows"][0].update(density="0.2"), "number"),
        (lambda d: d["rows"][0].update(density=True), "number"),
        (lambda d: d["rows"][0].update(resolution=24.0), "whole"),
        (lambda d: d["rows"][1]["block"].pop(0), "from 1 on"),
        (lambda d: d["rows"][1]["block"].reverse(), "from 1 on"),
        (lambda d: d["rows"][1]["wall"][0].pop(), "damaged"),
        (lambda d: d["rows"][1]["wall"][0].__setitem__(1, 0), "no ratio"),
        (lambda d: d["rows"][1]["wall"][0].__setitem__(1, float("nan")), "NaN"),
        (lambda d: d["rows"][1]["wall"][0].__setitem__(2, -0.1), "no ratio"),
        (lambda d: d.update(rows=3), "damaged"),
        (lambda d: d.update(family=3), "text"),
    ],
)
def test_damaged_tables_are_refused(change, match):
    with pytest.raises(PluginError, match=match):
        read_finite_size_table(damaged(change))


@pytest.mark.parametrize("text", ["", "[]", "3", "{}", "not json", '{"family": "x"}'])
def test_other_files_are_refused(text):
    with pytest.raises(PluginError, match="no finite size table"):
        read_finite_size_table(text)


def test_ratios_run_to_one_for_endlessly_many_cells():
    series = ratios(0.6, 0.7)
    # By hand: linear in 1/n through (1, 0.6), (1/2, 0.7), (0, 1).
    found = ratio_at(series, np.array([1.0, 0.75, 0.5, 0.25, 0.0]))
    np.testing.assert_allclose(found, [0.6, 0.65, 0.7, 0.85, 1.0], rtol=1e-12)
    np.testing.assert_allclose(ratio_at(ratios(0.6), np.array([0.5])), [0.8], rtol=1e-12)
    for wrong in (1.01, -0.01, np.nan):
        with pytest.raises(ValueError, match="from one cell on"):
            ratio_at(series, np.array([wrong]))


@pytest.mark.slow
def test_solid_cells_lose_nothing():
    found = finite_size(np.ones((4, 4, 4)), (1, 2), walls=(1, 2), rtol=1e-8)
    for values in (found.block, found.wall_youngs, found.wall_shear):
        np.testing.assert_allclose(values, 1.0, atol=1e-9)


def test_cells_that_no_grid_resolves_are_refused():
    families = REGISTRY.cell_families
    with pytest.raises(Exception, match="expected two"):
        finite_size_table(families["gyroid-sheet"], densities=(0.05, 0.1))
    with pytest.raises(Exception, match="expected cubic"):
        finite_size_table(families["bccz"])
    with pytest.raises(Exception, match="multiple of 12"):
        finite_size_row(families["sc"], 0.3, 16)


@pytest.mark.parametrize("name", sorted(SHIPPED))
def test_shipped_tables_hold_what_they_say(name):
    found = SHIPPED[name]
    family = REGISTRY.cell_families[name]
    assert dict(found.parameters) == dict(family.parameters)
    assert found.date
    assert "gradedesign" not in found.method
    for row in found.rows:
        assert voxels_in_wall(calibrate(family), row.density, row.resolution) >= LEAST_VOXELS
        for series in (row.block, row.wall, row.wall_shear):
            # More cells are nearer to endlessly many, within the error bars of both.
            for few, more in pairwise(series):
                slack = few.error + more.error
                assert abs(more.value - 1) <= abs(few.value - 1) + slack
            # Free faces stiffen only by where they cut; nothing gains more than 5 % and its error.
            assert all(r.spread < r.value < 1.05 + r.error - r.spread for r in series)


def documented():
    """Rows of the table in the docs: cell, density, and the other columns."""
    text = DOCS.read_text(encoding="utf-8").partition("<!-- finite size -->")[2]
    text = text.partition("<!-- end -->")[0]
    return [
        [part.strip() for part in line.strip("|").split("|")]
        for line in text.splitlines()
        if re.match(r"\| [a-z-]+ \| 0", line)
    ]


def shown(series):
    return ", ".join(f"{r.value:.2f}" for r in series)


def test_the_docs_show_the_shipped_tables():
    expected = [
        [
            name,
            f"{row.density:g}",
            shown(row.block),
            shown(row.wall),
            shown(row.wall_shear),
            f"{max(r.error for s in (row.block, row.wall, row.wall_shear) for r in s):.2f}",
            f"{max(r.spread for s in (row.block, row.wall, row.wall_shear) for r in s):.2f}",
        ]
        for name in sorted(SHIPPED)
        for row in SHIPPED[name].rows
    ]
    assert expected
    assert documented() == expected
