"""Warnings about an acceptance: what the reader should act on, and nothing else."""

from types import SimpleNamespace

import pytest

from gradedesign.limits.banded import Banded
from gradedesign.results.summary import _acceptance_warnings

FIRST = "all threads, surface simplified first: succeeded in 40.8 s"
FAILED = "all threads, surface simplified first: the worker timed out after 30 s"
RETRIED = "one thread, surface simplified first: succeeded in 12.0 s"


@pytest.mark.parametrize(
    ("attempts", "said"), [((FIRST,), []), ((FIRST, FIRST), []), ((FAILED, RETRIED), [FAILED])]
)
def test_only_a_mesher_that_had_to_be_asked_again_is_a_warning(attempts, said):
    accepted = SimpleNamespace(
        acceptance=SimpleNamespace(submodels=(), attempts=attempts, refused=()),
        whole=SimpleNamespace(refused=(), undecided={}),
        rows=(),
    )
    warnings = _acceptance_warnings(accepted)
    assert len(warnings) == len(said)
    assert all(text in warning for text, warning in zip(said, warnings, strict=True))


def a_row(name, band, use=1.0):
    return SimpleNamespace(
        name=name, load_case="pull", unit="mm", band=band, homogenised=False, utilisation=use,
        key=name, undecided=name == "far",
    )  # fmt: skip


def test_bands_windows_and_what_is_undecided_are_said():
    missed = SimpleNamespace(
        matches=False, force_discrepancy=0.04, energy_discrepancy=0.01,
        submodel=SimpleNamespace(centre=(1.0, 2.0, 3.0), enlarged=True),
    )  # fmt: skip
    accepted = SimpleNamespace(
        acceptance=SimpleNamespace(submodels=(missed,), attempts=(), refused=("not enlarged",)),
        whole=SimpleNamespace(
            refused=("0.5 mm is out of budget",),
            undecided={("far", "pull"): "far: undecided", ("near", "pull"): "decided since"},
        ),
        rows=(
            a_row("near", Banded(value=1.0, low=0.95, high=1.05)),
            a_row("far", Banded(value=1.0, low=0.8, high=1.2)),
            a_row("idle", Banded(value=1.0, low=0.8, high=1.2), use=0.1),
            a_row("alone", None),
        ),
    )
    far, undecided, alone, refused, submodel, kept = _acceptance_warnings(accepted)
    assert "the band of far (pull) is 0.8 to 1.2 mm, 20% to either side" in far
    assert undecided == "far: undecided"
    assert alone.startswith("alone: no second resolution could be analysed")
    assert refused == "0.5 mm is out of budget"
    assert "enlarged too: stress is judged on the worse of the two" in submodel
    assert kept == "not enlarged"
