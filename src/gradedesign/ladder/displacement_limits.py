"""The displacement limits of a case on the tetrahedra of its part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.case.schema import Case, LoadCaseSpec
from gradedesign.errors import CaseError
from gradedesign.fe.load_case import PartLoadCase, region_nodes
from gradedesign.fe.space import TetSpace
from gradedesign.fe.supports import Supports
from gradedesign.part.regions import Region
from gradedesign.sizing.responses import DisplacementLimit


def displacement_limits(
    case: Case, space: TetSpace, facets: Mapping[str, IntArray], loads: Sequence[PartLoadCase]
) -> tuple[tuple[DisplacementLimit, ...], tuple[str, ...]]:
    """One limit per region, direction and load case it holds for, and warnings.

    Parameters
    ----------
    case : Case
    space : TetSpace
    facets : mapping of region to (k, 3) int array
    loads : sequence of PartLoadCase
        With their supports.

    Returns
    -------
    limits : tuple of DisplacementLimit
        Without those of load cases that hold the whole region at rest; a warning names them.
    warnings : tuple of str

    Raises
    ------
    CaseError
        If supports hold the whole region in every load case its limit is for: the value is then
        what they prescribe, whatever the lattice.
    """
    limits: list[DisplacementLimit] = []
    warnings: list[str] = []
    for number, spec in enumerate(case.limits.displacement):
        what = "magnitude" if spec.component is None else "xyz"[spec.component]
        name = f"{spec.region} {what}"
        nodes = region_nodes(space, facets[spec.region])
        judged = [load for load in loads if spec.load_case in (None, load.name)]
        held = [load.name for load in judged if _holds(load.supports, nodes, spec.component)]
        if len(held) == len(judged):
            raise CaseError(_refusal(case, number, held))
        for load in judged:
            if load.name in held and not _prescribed(load.supports, nodes, spec.component).any():
                warnings.append(
                    f"displacement of {name} is not judged in load case '{load.name}', whose "
                    f"supports hold the whole region"
                )
                continue
            limits.append(
                DisplacementLimit(
                    name=name,
                    load_case=load.name,
                    nodes=nodes,
                    component=spec.component,
                    limit=float("nan") if spec.value is None else spec.value,
                    region=spec.region,
                    times_solid=spec.times_solid,
                )
            )
    return tuple(limits), tuple(warnings)


def require_movable(case: Case, regions: Mapping[str, Region]) -> None:
    """Refuse limits on regions that supports hold whole, by the part's surface: without a mesh.

    Raises
    ------
    CaseError
        As `displacement_limits`.
    """
    for number, spec in enumerate(case.limits.displacement):
        limited = range(3) if spec.component is None else (spec.component,)
        wanted = set(regions[spec.region].triangles.tolist())
        judged = [one for one in case.load_case if spec.load_case in (None, one.name)]
        held = [
            one.name
            for one in judged
            if all(wanted <= _held_triangles(one, regions, component) for component in limited)
        ]
        if judged and len(held) == len(judged):
            raise CaseError(_refusal(case, number, held))


def _held_triangles(spec: LoadCaseSpec, regions: Mapping[str, Region], component: int) -> set[int]:
    """Triangles of the part's surface that a load case holds along one direction."""
    held: set[int] = set()
    for fix in spec.fix:
        if fix.displacement[component] is not None:
            held.update(regions[fix.region].triangles.tolist())
    return held


def limit_key(case: Case, limit: DisplacementLimit) -> str:
    """Key of the case file that states a limit, such as ``limits.displacement[0].magnitude``."""
    number = next(
        k
        for k, spec in enumerate(case.limits.displacement)
        if (spec.region, spec.component) == (limit.region, limit.component)
        and spec.load_case in (None, limit.load_case)
    )
    return f"limits.displacement[{number}].magnitude"


def _holds(supports: Supports, nodes: IntArray, component: int | None) -> bool:
    """Whether what is limited is prescribed at every node of the region."""
    fixed = supports.fixed[:, nodes]
    return bool(np.all(fixed if component is None else fixed[component]))


def _prescribed(supports: Supports, nodes: IntArray, component: int | None) -> FloatArray:
    """What supports prescribe of what is limited, mm."""
    value = supports.value[:, nodes]
    return value if component is None else value[component]


def _refusal(case: Case, number: int, held: Sequence[str]) -> str:
    """Message for a limit that no design could change."""
    spec = case.limits.displacement[number]
    cases = f"load case{'s' if len(held) > 1 else ''} " + ", ".join(f"'{name}'" for name in held)
    way = "every direction" if spec.component is None else f"{'xyz'[spec.component]}"
    return (
        f"{case.where(f'limits.displacement[{number}].region')}: the supports of {cases} hold the "
        f"whole region '{spec.region}' in {way}, so its displacement is what they prescribe, "
        f"whatever the lattice; expected a region that is free to move, such as the loaded one"
    )
