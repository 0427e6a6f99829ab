"""The part on its tetrahedra: mesh, facets of regions, supports and forces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gradedesign.arrays import IntArray
from gradedesign.common.values.locate import Where
from gradedesign.design.case.run_schema import RunSpec
from gradedesign.errors import CaseError, SolverError
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.part_mesh import (
    box_part_mesh,
    check_region_area,
    mesh_part,
    region_facets,
)
from gradedesign.geometry.part.part_schema import PartSpec
from gradedesign.geometry.tets.mesher import Mesher
from gradedesign.geometry.tets.tet_mesh import TetMesh
from gradedesign.mechanics.fe.free_pieces import require_held
from gradedesign.mechanics.fe.load_case import PartLoadCase, case_loads
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.limits.limit import StatedLimit


def held_loads(
    load_cases: Sequence[LoadCaseSpec],
    space: TetSpace,
    part: Part,
    facets: Mapping[str, IntArray],
    where: Where,
) -> tuple[PartLoadCase, ...]:
    """Supports and forces of every load case, each held against every rigid motion.

    Raises CaseError, naming the motions that the supports of a load case leave free.
    """
    loads = case_loads(space, load_cases, part.regions, facets)
    for number, load_case in enumerate(loads):
        try:
            require_held(space, load_case.supports.fixed, load_case.name)
        except SolverError as error:
            raise CaseError(f"{where(f'load_case[{number}].fix')}: {error}") from error
    return loads


def part_tets(spec: PartSpec, part: Part, mesher: Mesher, budget: RunSpec) -> TetMesh:
    """Tetrahedra of the part: of bricks for a box that names no mesher, else by the mesher."""
    if spec.bricks is not None:
        regions = [region.corners for region in part.regions.values()]
        return box_part_mesh(spec.bricks, spec.element_size, regions)
    return mesh_part(
        part.surface,
        spec.element_size,
        time_limit_s=budget.time,
        memory_limit_bytes=budget.memory,
        mesher=mesher,
    ).mesh


def used_regions(
    load_cases: Sequence[LoadCaseSpec], limits: Sequence[StatedLimit]
) -> tuple[str, ...]:
    """Regions that loads, supports or limits name."""
    names = {f.region for spec in load_cases for f in spec.fix}
    names |= {s.region for spec in load_cases for s in spec.load}
    names |= {limit.region for limit in limits if limit.region}
    return tuple(sorted(names))


def part_facets(
    part: Part, mesh: TetMesh, names: Sequence[str], size: float
) -> dict[str, IntArray]:
    """Facets of regions on the part's tetrahedra of a size, mm, with their areas checked."""
    facets = {}
    for name in names:
        region = part.regions[name]
        matched = region_facets(mesh, region.corners, tolerance=0.1 * size)
        check_region_area(matched, region.area, name=name, cut_length=region.cut_length)
        facets[name] = matched.facets
    return facets
