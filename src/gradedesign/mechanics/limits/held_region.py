"""Regions that supports hold whole: no lattice changes how they move, so no limit judges them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.values.locate import Where
from gradedesign.errors import CaseError
from gradedesign.geometry.part.regions import Region
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.fe.supports import Supports
from gradedesign.mechanics.limits.limit import PlacedModel
from gradedesign.mechanics.limits.limits_schema import DisplacementLimit


def judged_cases(
    placed: PlacedModel, entry: DisplacementLimit, place: str, name: str
) -> tuple[list[str], list[str]]:
    """Load cases in which a region may move, and a warning for each that holds it at rest.

    Raises `CaseError` if supports hold the whole region in every load case of the entry.

    ``place``: of the entry in ``[limits]``, such as ``displacement[0]``. ``name``: of the limit.
    """
    nodes = placed.nodes[entry.region]
    cases = {
        name: supports
        for name, supports in placed.supports.items()
        if entry.load_case in (None, name)
    }
    holding_cases = [name for name, s in cases.items() if _holds(s, nodes, entry.component)]
    if len(holding_cases) == len(cases):
        raise CaseError(_refusal(placed.where(f"limits.{place}.region"), entry, holding_cases))
    # A held region that is moved has a value in the load case, one at rest has none.
    resting = {
        case for case in holding_cases if not _prescribed(cases[case], nodes, entry.component).any()
    }
    warnings = [
        f"{name} is not judged in load case '{case}', whose supports hold the whole region"
        for case in cases
        if case in resting
    ]
    return [case for case in cases if case not in resting], warnings


def refuse_held_surfaces(
    load_cases: Sequence[LoadCaseSpec],
    entries: Sequence[DisplacementLimit],
    kind: str,
    regions: Mapping[str, Region],
    where: Where,
) -> None:
    """Refuse limits on regions that supports hold whole, by the part's surface: without a mesh.

    ``kind`` is the list's name in ``[limits]``. Raises `CaseError`.
    """
    for number, entry in enumerate(entries):
        limited = range(3) if entry.component is None else (entry.component,)
        wanted = set(regions[entry.region].triangles.tolist())
        cases = entry.judged(load_cases)
        holding_cases = [
            load.name
            for load in cases
            if all(wanted <= _held_triangles(load, regions, component) for component in limited)
        ]
        if cases and len(holding_cases) == len(cases):
            place = where(f"limits.{kind}[{number}].region")
            raise CaseError(_refusal(place, entry, holding_cases))


def _held_triangles(
    load_case: LoadCaseSpec, regions: Mapping[str, Region], component: int
) -> set[int]:
    """Triangles of the part's surface that a load case holds along one direction."""
    triangles: set[int] = set()
    for fix in load_case.fix:
        if fix.displacement[component] is not None:
            triangles.update(regions[fix.region].triangles.tolist())
    return triangles


def _holds(supports: Supports, nodes: IntArray, component: int | None) -> bool:
    """Whether the limited displacement is prescribed at every node of the region."""
    fixed = supports.fixed[:, nodes]
    return bool(np.all(fixed if component is None else fixed[component]))


def _prescribed(supports: Supports, nodes: IntArray, component: int | None) -> FloatArray:
    """Prescribed values of the limited displacement, mm."""
    value = supports.value[:, nodes]
    return value if component is None else value[component]


def _refusal(place: str, entry: DisplacementLimit, holding_cases: Sequence[str]) -> str:
    """Message for a limit that no design could change."""
    cases = f"load case{'s' if len(holding_cases) > 1 else ''} " + ", ".join(
        f"'{name}'" for name in holding_cases
    )
    way = "every direction" if entry.component is None else "xyz"[entry.component]
    return (
        f"{place}: the supports of {cases} hold the whole region '{entry.region}' in {way}, so its "
        f"displacement is what they prescribe, whatever the lattice; expected a region that is "
        f"free to move, such as the loaded one"
    )
