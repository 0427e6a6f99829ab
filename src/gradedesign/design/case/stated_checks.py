"""Requests for an analysis beside a stated density, which is not analysed."""

from __future__ import annotations

from collections.abc import Iterator

from gradedesign.common.values.problems import Problem
from gradedesign.design.case.schema import CaseFile

#: Keys of ``[run]`` that matter where the density is stated.
_OF_STATED = {"memory", "time", "stop_after"}


def stated_problems(file: CaseFile) -> Iterator[Problem]:
    """Find what asks for an analysis beside a stated density, which is not analysed."""
    run = file.run
    for key in sorted(run.model_fields_set - _OF_STATED):
        yield Problem(
            key=("run", key),
            message="belongs to an analysis, and the lattice of a stated density is not analysed: "
            "its surface is as fine as the density needs; leave it out, or state density = "
            "[lowest, highest]",
        )
    if "stop_after" in run.model_fields_set and run.stop_after != "lattice":
        yield Problem(
            key=("run", "stop_after"),
            message=f'found "{run.stop_after}", but the run of a stated density ends with its '
            'lattice; leave it out, expected "lattice", or state density = [lowest, highest]',
        )
    orientation = file.lattice.orientation
    if orientation is not None and orientation.load_case is not None:
        yield Problem(
            key=("lattice", "orientation", "load_case"),
            message="needs the stress of an analysis, which the run of a stated density has not; "
            "expected direction or vtu",
        )
    if any(skin.follows for skin in file.lattice.skin):
        yield Problem(
            key=("lattice", "skin"),
            message="found follows, which needs the stress of an analysis, and the run of a stated "
            "density has none; expected a formula or one thickness",
        )
    for k, zone in enumerate(file.zone):
        if zone.density is not None:
            yield Problem(
                key=("zone", k, "density"),
                message="found beside the stated density of the whole lattice; leave it out: a "
                "density that differs from place to place stands in [lattice.density_map]",
            )
