"""A case as it can be shown before a run: all of it, or as far as its mistakes let it be read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

from pydantic import ValidationError

from gradedesign.arrays import Field
from gradedesign.common.values.locate import Where
from gradedesign.design.case.run_schema import RunSpec
from gradedesign.design.case.schema import Case
from gradedesign.design.resolve.fitting_part import fitting_part, installed_part
from gradedesign.design.resolve.load_balance import LoadBalance, load_balances
from gradedesign.design.resolve.own_cell import with_own_cell
from gradedesign.design.resolve.part_readers import part_readers
from gradedesign.design.resolve.plan import Plan, resolve_case
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.resolve import case_material
from gradedesign.design.resolve.stated_lattice import StatedLattice, stated_lattice
from gradedesign.errors import GradeDesignError
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.part.part import Part, read_part
from gradedesign.geometry.part.part_schema import PartSpec
from gradedesign.geometry.part.regions import select_regions
from gradedesign.geometry.part.regions_schema import RegionSpec
from gradedesign.mechanics.explicit.support_zones import SupportZone
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.material.material import Material


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CaseShown:
    """A case as it is shown."""

    part: Part
    load_cases: Sequence[LoadCaseSpec] = ()
    #: Resultants of these load cases; empty where they are not known.
    balances: Sequence[LoadBalance] = ()
    material: Material | None = None
    domain: DesignDomain | None = None  #: The part with what stays solid in it.
    support_zones: Sequence[SupportZone] = ()  #: In which stress is not judged.
    #: Points ``(3, n)`` mm to cell coordinates; None where they follow from a run.
    cell_map: Field | None = None
    cells: str = ""  #: The cells in words; empty where there are none, but solid and void.
    mistake: GradeDesignError | None = None  #: Why the case cannot run.


def shown_plan(plan: Plan, cell_map: Field | None = None) -> CaseShown:
    """A resolved case as it is shown, with the map of its cells where a design has placed them."""
    case = plan.case
    spec = case.lattice
    if cell_map is None and not spec.graded_size and spec.orientation is None:
        cell_map = plan.layout.cell_map
    return CaseShown(
        part=plan.part,
        load_cases=case.load_case,
        balances=plan.balances,
        material=plan.material,
        domain=plan.domain,
        support_zones=plan.support_zones,
        cell_map=cell_map if spec.cells else None,
        cells=f"{spec.cell}, {spec.size_words}" if spec.cells else "",
    )


def shown_stated(stated: StatedLattice) -> CaseShown:
    """A case with a stated density as it is shown."""
    case = stated.case
    spec = case.lattice
    return CaseShown(
        part=stated.part,
        material=stated.material,
        domain=stated.design.domain,
        cell_map=stated.design.cell_map,
        cells=f"{spec.cell}, {spec.size_words}",
    )


def shown_case(case: Case, registry: Registry) -> CaseShown:
    """A case that was read, as far as it can be shown.

    Of one with a mistake: its part with the regions that are found, and the loads on these.

    Raises GradeDesignError if not even the part can be read.
    """
    try:
        registry = with_own_cell(case.lattice, registry, case.where)
        if not case.lattice.stated:
            return shown_plan(resolve_case(case, registry))
        return shown_stated(stated_lattice(case, registry, fitting_part(case, registry)[1]))
    except GradeDesignError as error:
        mistake = error
    try:
        part = installed_part(case, registry)
    except GradeDesignError:
        alone = _read_alone(case.part, registry, case.where)
        part = _with_regions(alone, case.region)
    loads = [
        each
        for each in case.load_case
        if {fix.region for fix in each.fix} <= set(part.regions)
        and {load.region for load in each.load} <= set(part.regions)
    ]
    balances: tuple[LoadBalance, ...] = ()
    with suppress(GradeDesignError):
        density = case_material(case.material, registry, case.where).density
        balances = load_balances(loads, part, density, case.where)
    return CaseShown(part=part, load_cases=loads, balances=balances, mistake=mistake)


def part_alone(
    data: Mapping[str, Any], context: Mapping[str, Any], registry: Registry, where: Where
) -> tuple[PartSpec, Part] | None:
    """The part of a case that cannot be read, with those of its regions that can; None without one.

    ``data``: the case file as TOML has it. ``context``: of its validation: the case's folder, and
    whether files may lie outside.
    """
    try:
        spec = PartSpec.model_validate(data.get("part"), context=dict(context))
        part = _read_alone(spec, registry, where)
    except (GradeDesignError, ValidationError):
        return None
    stated, regions = data.get("region"), dict[str, RegionSpec]()
    for name, keys in stated.items() if isinstance(stated, dict) else ():
        with suppress(ValidationError):
            regions[name] = RegionSpec.model_validate(keys)
    return spec, _with_regions(part, regions)


def _read_alone(spec: PartSpec, registry: Registry, where: Where) -> Part:
    """A part without regions."""
    return read_part(spec, {}, part_readers(spec, RunSpec().memory, registry), where)


def _with_regions(part: Part, specs: Mapping[str, RegionSpec]) -> Part:
    """The part with those of its regions that can be found."""
    found = {}
    for name in specs:
        with suppress(GradeDesignError):
            needed = {name}
            while more := {each for n in needed & set(specs) for each in specs[n].names} - needed:
                needed |= more
            chosen = {each: specs[each] for each in specs if each in needed}
            regions = select_regions(part.surface, part.faces, chosen, part.file_faces)
            found[name] = regions[name]
    return replace(part, regions=found)
