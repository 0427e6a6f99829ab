"""STEP and IGES parts for gradedesign, by OpenCASCADE."""

from collections.abc import Iterable

from gradedesign import PartReader, hookimpl
from gradedesign_step.cad_reader import read_iges, read_step


@hookimpl
def gradedesign_readers() -> Iterable[PartReader]:
    """Register the readers."""
    yield PartReader(name="step", suffixes=(".step", ".stp"), read=read_step, exact=True)
    yield PartReader(name="iges", suffixes=(".iges", ".igs"), read=read_iges, exact=True)
