"""Warnings about an acceptance: what the reader should act on, and nothing else."""

from types import SimpleNamespace

import pytest

from gradedesign.design.verdict.summary import _acceptance_warnings
from gradedesign.mechanics.limits.banded import Banded

FIRST = "all threads, surface simplified first: succeeded in 40.8 s"
FAILED = "all threads, surface simplified first: the worker timed out after 30 s"
RETRIED = "one thread, surface simplified first: succeeded in 12.0 s"


def layered(skin=None, kept=None):
    """A solid with a skin and a kept plate of these thicknesses, mm, where they are given."""
    stated = {"the skin": skin, "region 'tip'": kept}
    components = [SimpleNamespace(name=n, least=t) for n, t in stated.items() if t is not None]
    return SimpleNamespace(design=SimpleNamespace(domain=SimpleNamespace(components=components)))


@pytest.mark.parametrize(
    ("attempts", "said"), [((FIRST,), []), ((FIRST, FIRST), []), ((FAILED, RETRIED), [FAILED])]
)
def test_only_a_mesher_that_had_to_be_asked_again_is_a_warning(attempts, said):
    accepted = SimpleNamespace(
        acceptance=SimpleNamespace(submodels=(), attempts=attempts, refused=()),
        whole=SimpleNamespace(refused=(), undecided={}, result=SimpleNamespace(mesh_size=0.5)),
        analysed=SimpleNamespace(solid=layered()),
        islands=SimpleNamespace(filled_words=()),
        rows=(),
    )
    warnings = _acceptance_warnings(accepted)
    assert len(warnings) == len(said)
    assert all(text in warning for text, warning in zip(said, warnings, strict=True))


def a_row(name, band, use=1.0, *, converges=True):
    return SimpleNamespace(
        name=name, load_case="pull", unit="mm", band=band, homogenised=False, utilisation=use,
        key=name, undecided=name == "far", converges=converges,
    )  # fmt: skip


def test_a_plate_with_few_elements_through_it_is_named_beside_a_band_that_it_widens():
    """5 % to either side: said where the thinnest layer has fewer than three elements."""
    five = Banded(value=1.0, low=0.95, high=1.05)

    def said(size, *, converges=True, use=1.0, skin=None, kept=None):
        accepted = SimpleNamespace(
            acceptance=SimpleNamespace(submodels=(), attempts=(), refused=()),
            whole=SimpleNamespace(refused=(), undecided={}, result=SimpleNamespace(mesh_size=size)),
            analysed=SimpleNamespace(solid=layered(skin, kept)),
            islands=SimpleNamespace(filled_words=()),
            rows=(a_row("dent", five, use, converges=converges),),
        )
        return _acceptance_warnings(accepted)

    (words,) = said(1.0, skin=2.0, kept=1.5)
    assert "1.5 finite cells of 1 mm go through region 'tip', 1.5 mm thick" in words
    (words,) = said(1.0, skin=1.2, kept=1.5)
    assert "1.2 finite cells of 1 mm go through the skin, 1.2 mm thick" in words
    assert said(0.5, kept=1.5) == said(1.0) == []
    # Percentiles of stress take at least 4 %, and a limit that is hardly used is not said.
    assert said(1.0, kept=1.5, converges=False) == said(1.0, kept=1.5, use=0.5) == []


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
            result=SimpleNamespace(mesh_size=0.5),
        ),
        analysed=SimpleNamespace(solid=layered()),
        islands=SimpleNamespace(filled_words=()),
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


def test_closed_pores_that_were_filled_are_said():
    accepted = SimpleNamespace(
        acceptance=SimpleNamespace(submodels=(), attempts=(), refused=()),
        whole=SimpleNamespace(refused=(), undecided={}, result=SimpleNamespace(mesh_size=0.5)),
        analysed=SimpleNamespace(solid=layered()),
        islands=SimpleNamespace(filled_words=("2 closed pores were filled",)),
        rows=(),
    )
    assert _acceptance_warnings(accepted) == ["2 closed pores were filled"]
