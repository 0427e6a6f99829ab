"""Sizing is found again where only grids or budgets change, and nowhere else."""

import shutil

import numpy as np
import pytest
from small_parts import box_part, held_bar

import gradedesign
from gradedesign.mechanics.sizing import stored_sizing as module

CASE = (
    held_bar(box_part(30, 10, 10, 5), name="bar", load_case="down", force="0 N, 0 N, -1 N")
    + """\
[limits]
displacement = [{region = "tip", magnitude = "0.05 mm"}]
[lattice]
cell = "primitive-network"
size = "5 mm"
phases = ["lattice"]
density = [0.2, 0.5]
size_effects = false
[run]
stop_after = "sizing"
[output]
formats = ["report"]
"""
)


def size_in(folder, patch, *swap):
    """Size the case with words replaced: result, how often it was computed, steps of sizing."""
    patch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
    calls, heard, size = [], [], module.size

    def counted(*args, **words):
        calls.append(1)
        return size(*args, **words)

    patch.setattr(module, "size", counted)
    path = folder / "case.toml"
    assert not swap or swap[0] in CASE
    path.write_text(CASE.replace(*swap) if swap else CASE, encoding="utf-8")
    run = folder / f"run-{len(list(folder.iterdir()))}"
    result = gradedesign.run(
        gradedesign.load_case(path), folder=run, on_event=lambda e: heard.append(e.stage)
    )
    patch.setattr(module, "size", size)
    return result, len(calls), heard.count("sizing")


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    """The first sizing: its folder with the cache, result and steps."""
    folder = tmp_path_factory.mktemp("first")
    with pytest.MonkeyPatch.context() as patch:
        result, count, heard = size_in(folder, patch)
    assert count == 1
    return folder, result, heard


@pytest.fixture
def sized(first, tmp_path, monkeypatch):
    """Size with words replaced after the first sizing."""
    shutil.copytree(first[0] / "cache", tmp_path / "cache")
    return lambda *swap: size_in(tmp_path, monkeypatch, *swap)


def test_another_grid_or_budget_finds_the_sizing_again(first, sized):
    _, result, heard = first
    for swap in (
        ("[run]", '[run]\nelements_per_wall = 2.5\ntime = "2 h"'),
        ('formats = ["report"]', 'formats = ["vtu"]'),
    ):
        again, count, steps = sized(*swap)
        assert count == 0
        assert steps == heard
        assert again.lattice_mass_g == pytest.approx(result.lattice_mass_g, rel=1e-12)
        assert again.measures["sizing"] == result.measures["sizing"]


@pytest.mark.parametrize(
    "swap",
    [
        ("-1 N", "-1.01 N"),
        ("0.05 mm", "0.0501 mm"),
        ("[0.2, 0.5]", "[0.2, 0.51]"),
        ("30 mm", "30.1 mm"),
        ('"PA12"', '"PA11"'),
        ("primitive-network", "gyroid-network"),
    ],
)
def test_what_sizing_depends_on_makes_it_anew(sized, swap):
    assert sized(*swap)[1] == 1


def test_a_result_survives_the_cache(first, sized):
    again, *_ = sized()
    assert np.isfinite(first[1].lattice_mass_g)
    assert again.limits == first[1].limits
