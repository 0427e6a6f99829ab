"""Sizing is found again where only grids or budgets change, and nowhere else."""

import numpy as np
import pytest
from small_parts import box_part, held_bar

import gradedesign
from gradedesign.loop import stored_sizing as module

CASE = (
    held_bar(box_part(30, 10, 10, 5), name="bar", load_case="down", force="0 N, 0 N, -1 N")
    + """\
[limits]
displacement = [{region = "tip", magnitude = "0.05 mm"}]
[lattice]
cell = "primitive-network"
size = "5 mm"
density = [0.2, 0.5]
size_effects = false
[run]
stop_after = "sizing"
[output]
formats = ["report"]
"""
)


@pytest.fixture
def sized(tmp_path, monkeypatch):
    """Size a case with words replaced: the density found and how often it was computed."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    calls, size = [], module.size

    def counted(*args, **words):
        calls.append(1)
        return size(*args, **words)

    monkeypatch.setattr(module, "size", counted)

    def call(*swap):
        path = tmp_path / "case.toml"
        assert not swap or swap[0] in CASE
        path.write_text(CASE.replace(*swap) if swap else CASE, encoding="utf-8")
        folder = tmp_path / f"run-{len(list(tmp_path.iterdir()))}"
        heard = []
        result = gradedesign.run(
            gradedesign.load_case(path), folder=folder, on_event=lambda e: heard.append(e.stage)
        )
        return result, len(calls), heard.count("sizing")

    return call


def test_another_grid_or_budget_finds_the_sizing_again(sized):
    first, count, heard = sized()
    assert count == 1
    for swap in (
        ("[run]", '[run]\nelements_per_wall = 2.5\ntime = "2 h"'),
        ('formats = ["report"]', 'formats = ["vtu"]'),
    ):
        again, count, steps = sized(*swap)
        assert count == 1
        assert steps == heard
        assert again.lattice_mass_g == pytest.approx(first.lattice_mass_g, rel=1e-12)
        assert again.measures["sizing"] == first.measures["sizing"]


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
    sized()
    assert sized(*swap)[1] == 2


def test_a_result_survives_the_cache(sized):
    first, *_ = sized()
    again, *_ = sized()
    assert np.isfinite(first.lattice_mass_g)
    assert again.limits == first.limits
