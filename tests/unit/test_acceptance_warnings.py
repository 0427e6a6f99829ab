"""Warnings about an acceptance: what the reader should act on, and nothing else."""

from types import SimpleNamespace

import pytest

from gradedesign.results.summary import _acceptance_warnings

FIRST = "all threads, surface simplified first: succeeded in 40.8 s"
FAILED = "all threads, surface simplified first: the worker timed out after 30 s"
RETRIED = "one thread, surface simplified first: succeeded in 12.0 s"


@pytest.mark.parametrize(
    ("attempts", "said"), [((FIRST,), []), ((FIRST, FIRST), []), ((FAILED, RETRIED), [FAILED])]
)
def test_only_a_mesher_that_had_to_be_asked_again_is_a_warning(attempts, said):
    accepted = SimpleNamespace(
        acceptance=SimpleNamespace(windows=(), attempts=attempts),
        second=SimpleNamespace(refused=(), mesh_size=0.5),
    )
    warnings = _acceptance_warnings(accepted)
    assert len(warnings) == len(said)
    assert all(text in warning for text, warning in zip(said, warnings, strict=True))
