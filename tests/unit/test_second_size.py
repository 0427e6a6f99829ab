"""A second mesh size: tried coarser, then finer, and its change beside the accepted value."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from gradedesign.errors import MeshError, ResourceError
from gradedesign.limits.key import LimitKey
from gradedesign.limits.row import LimitRow
from gradedesign.loop import second_size
from gradedesign.loop.second_size import analyse_second_size, unresolved_warnings, with_resolution


def row(name, case, value, judged_by="explicit"):
    return LimitRow(
        key=LimitKey(kind="any", region=name, load_case=case),
        name=name,
        load_case=case,
        value=value,
        limit=1.0,
        unit="mm",
        judged_by=judged_by,
    )


def test_change_is_that_of_the_explicit_value():
    # accepted values come from another mesher: 0.9 here, explicit 0.8 on the first grid
    accepted = [row("tip", "pull", 0.9), row("tip", "side", 0.5)]
    first = [row("tip", "pull", 0.8), row("tip", "side", 0.4)]
    second = [row("tip", "pull", 0.84), row("tip", "side", 0.38)]
    found = with_resolution(accepted, first, second)
    assert [r.value for r in found] == [0.9, 0.5]
    assert [r.resolution_error for r in found] == pytest.approx([0.05, -0.05])


def test_largest_values_are_compared_where_another_case_governs():
    key = LimitKey(kind="stress", region="lattice")
    accepted, first, second = (
        [replace(row("stress", case, value), key=key)]
        for case, value in (("pull", 0.9), ("pull", 0.8), ("side", 0.88))
    )
    found = with_resolution(accepted, first, second)
    assert found[0].resolution_error == pytest.approx(0.1)


def test_without_a_second_grid_the_error_is_unknown():
    assert (
        with_resolution([row("tip", "a", 0.9)], [row("tip", "a", 0.8)], [])[0].resolution_error
        is None
    )


@pytest.fixture
def grids(monkeypatch):
    """Grids that fail, by mm; others give a displacement of five times their size."""
    failing = {}
    tried = []

    def analyse(setup, rho, *, spacing):
        tried.append(spacing)
        if spacing in failing:
            raise failing[spacing]
        return SimpleNamespace(result=SimpleNamespace(mesh_size=spacing))

    monkeypatch.setattr(second_size, "analyse_design", analyse)
    monkeypatch.setattr(
        second_size,
        "limit_rows",
        lambda _, result, *_rest: (row("tip", "a", 5.0 * result.mesh_size),),
    )
    return SimpleNamespace(failing=failing, tried=tried)


def analyse():
    first = SimpleNamespace(result=SimpleNamespace(mesh_size=2.0))
    setup = SimpleNamespace(problem=SimpleNamespace(limits=()))
    return analyse_second_size(setup, SimpleNamespace(rho=None), first)


def test_coarser_first(grids):
    found = analyse()
    assert (found.mesh_size, found.refused, grids.tried) == (2.5, (), [2.5])
    assert found.rows[0].value == pytest.approx(12.5)


def test_finer_where_the_coarser_loses_walls(grids):
    grids.failing[2.5] = MeshError("lost 5 % of its volume")
    found = analyse()
    assert found.mesh_size == pytest.approx(1.6)
    assert found.rows[0].value == pytest.approx(8.0)
    assert found.refused == ("a second mesh of 2.5 mm was refused: lost 5 % of its volume",)


def test_both_refused_is_said(grids):
    grids.failing[2.5] = MeshError("walls")
    grids.failing[1.6] = ResourceError("9 GB")
    found = analyse()
    assert found.mesh_size is None
    assert [text.split(": ")[-1] for text in found.refused] == ["walls", "9 GB"]


def test_what_is_no_matter_of_the_grid_is_raised(grids):
    grids.failing[2.5] = ValueError("a defect")
    with pytest.raises(ValueError, match="a defect"):
        analyse()


def test_a_value_that_changes_with_the_grid_is_warned_of():
    near, far = (replace(row("tip", "pull", 0.9), resolution_error=e) for e in (-0.08, 0.37))
    assert unresolved_warnings([near, row("tip", "side", 0.9)]) == ()
    (warning,) = unresolved_warnings([near, far])
    assert "changes by +37% on the second mesh" in warning
