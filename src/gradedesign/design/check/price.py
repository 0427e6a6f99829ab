"""The price of lattice: predicted masses of other bodies that hold the same limits.

Each body is the case with other keys of ``[lattice]``, sized on the same homogenised part. Of solid
and void nothing is built: its void is a lattice of hardly any stiffness and mass.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

from gradedesign.common.system.progress import report_step
from gradedesign.design.check.check_case import CaseCheck
from gradedesign.design.check.predicted_run import predicted_run
from gradedesign.design.loop.iteration_steps import (
    SizingPlan,
    design_filter,
    size_design,
)
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.design.resolve.member_size import with_member_size
from gradedesign.design.resolve.own_cell import with_own_cell
from gradedesign.design.resolve.plan import resolve_case, with_acceptance
from gradedesign.design.resolve.registry import Registry
from gradedesign.errors import GradeDesignError
from gradedesign.geometry.lattice.lattice_schema import PHASES, LatticeSpec
from gradedesign.geometry.lattice.part_room import inner_points
from gradedesign.mechanics.explicit.correction import Correction
from gradedesign.mechanics.material.law_field import LawField
from gradedesign.mechanics.material.void_law import VOID_DENSITY, VOID_LAW
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel
from gradedesign.mechanics.sizing.size import SizingResult

#: Sizing iterations of every body: as in the second one of the loop, whose mass changes little
#: after.
SIZING_ITERATIONS = 20
#: Utilisation up to which a body holds its limits: as near to them as sizing comes.
_HOLDS = 1.004
#: A body is lighter than another where its mass is by this share less: less is scatter.
_LIGHTER = 0.02

#: Keys of ``[lattice]`` of bodies.
_SIZE = "least_member"
_ALONE = {"method": "lightest", "phases": PHASES[:1], _SIZE: None}
#: Names of bodies with members.
_FILLED_BODY, _VOID_BODY = (" and ".join(phases) for phases in (PHASES[:2], PHASES[1:]))
_BODIES: dict[str, dict[str, Any]] = {
    "uniform lattice": {**_ALONE, "grading": "uniform"},
    "stress mapped to density": {**_ALONE, "method": "stress-to-density"},
    "graded lattice": _ALONE,
    _FILLED_BODY: {"method": "lightest", "phases": PHASES[:2]},
    _VOID_BODY: {"method": "lightest", "phases": PHASES[1:]},
}
_NOTES = {
    _FILLED_BODY: "before it is cut into members that print",
    _VOID_BODY: "by stiffness alone, before it is cut into members that print",
}
#: Keys by which a case asks for them.
_KEYS = {
    "uniform lattice": 'grading = "uniform"',
    "stress mapped to density": 'method = "stress-to-density"',
    "graded lattice": 'method = "lightest" with grading = "level" and phases = ["lattice"]',
    _FILLED_BODY: 'phases = ["lattice", "solid"]',
    _VOID_BODY: 'phases = ["solid", "void"] and least_member',
}


@dataclass(frozen=True, slots=True, kw_only=True)
class PricedBody:
    """A body that holds the limits of a case, as the homogenised part predicts it."""

    name: str
    mass_g: float | None  #: With what is solid in any case; None where there is none.
    largest_utilisation: float | None  #: Of the most used limit.
    asked: bool = False  #: Whether it is the one that the case asks for.
    note: str = ""  #: Why there is none, or what it leaves out.

    @property
    def holds(self) -> bool:
        """Whether there is one, which holds the limits."""
        return self.mass_g is not None and not (self.largest_utilisation or 0) > _HOLDS

    @property
    def words(self) -> str:
        """Whether it is asked for, and its note."""
        return "; ".join(filter(None, ("asked for" if self.asked else "", self.note)))


def price_of_lattice(
    model: DesignModel, why_not: Callable[[], str] = str
) -> tuple[PricedBody, ...]:
    """Predicted masses of other bodies, and of the one that the case asks for, at its limits.

    ``model``: with its size effects. ``why_not``: asked before every body: why it is left out,
    empty where it is not.
    """
    part, plan, case = model.homogenised, model.plan, model.plan.case
    density = part.material.density * 1e6
    used = max((row.utilisation for row in model.solid), default=None)
    solid = density * float(part.volumes.sum())
    # Cells that hold nothing, without limits on their stress.
    void = replace(
        model,
        homogenised=replace(
            part, law=LawField(laws=(VOID_LAW,)), walls=None, effective=None, cut_share=None
        ),
        cells=replace(model.cells, bounds=(0.9 * VOID_DENSITY, VOID_DENSITY), zoning=None),
        limits=tuple(limit for limit in model.limits if not limit.needs_stress),
    )
    bodies = [PricedBody(name="part as modelled", mass_g=solid, largest_utilisation=used)]
    if not case.lattice.cells:
        why = 'phases = ["solid", "void"] names no cell'
        others = [left_out(name, why) for name in _BODIES if name != _VOID_BODY]
        return (*bodies, *others, left_out(_VOID_BODY, "", asked=True))
    asked_for = asked_body(case.lattice)
    for name, keys in _BODIES.items():
        if case.lattice.grading == "uniform":
            keys = {"grading": "level", **keys}
        asked = name == asked_for or (case.lattice.any_phase and name == _VOID_BODY)
        if reason := why_not():
            bodies.append(left_out(name, reason, asked=asked))
            continue
        report_step(f"sizing: {name}")
        try:
            other = model if name != _VOID_BODY else void
            # The loop began with the same sizing of the body that is asked for: it is stored.
            if name != asked_for:
                lattice = case.lattice.model_copy(update=keys)
                lattice = with_member_size(lattice, case.part, case.print, case.where)
                case_of_it = case.model_copy(update={"lattice": lattice})
                other = replace(other, plan=replace(plan, case=case_of_it))
            settings = SizingPlan(most_iterations=SIZING_ITERATIONS, bodies=False)
            sized = size_design(other, Correction(), {}, design_filter(other), settings)
        except GradeDesignError as error:
            bodies.append(left_out(name, str(error), asked=asked))
            continue
        bodies.append(sized_body(name, part, sized, asked=asked, note=_NOTES.get(name, "")))
    return tuple(bodies)


def sized_body(
    name: str, part: HomogenisedModel, sized: SizingResult, *, asked: bool = False, note: str = ""
) -> PricedBody:
    """A body as it was sized, with what is solid in any case."""
    last = sized.history[-1]
    passive = part.material.density * 1e6 * float(part.volumes @ part.solid_fraction)
    if last.utilisation > _HOLDS:
        note = "a limit is broken"
    return PricedBody(
        name=name,
        mass_g=passive + last.mass_g,
        largest_utilisation=last.utilisation,
        asked=asked,
        note=note,
    )


def asked_body(lattice: LatticeSpec) -> str:
    """Name of the body that a case with this lattice asks for."""
    if lattice.by_stress:
        return "stress mapped to density"
    if lattice.grading == "uniform":
        return "uniform lattice"
    if not lattice.cells:
        return _VOID_BODY
    return _FILLED_BODY if lattice.members else "graded lattice"


def seconds_of_bodies(checked: CaseCheck, registry: Registry) -> dict[str, float]:
    """Seconds that a run is predicted to take by body; none of one that no run can make."""
    case, found = checked.plan.case, {}
    if not case.lattice.cells:
        return {_VOID_BODY: checked.run.run_s}
    for name, keys in _BODIES.items():
        with suppress(GradeDesignError):
            lattice, plan = case.lattice.model_copy(update=keys), checked.plan
            if name == _VOID_BODY:
                lattice = with_member_size(lattice, case.part, case.print, case.where)
                lattice = lattice.without_cells()
                cells = with_own_cell(lattice, registry, case.where)
                plan = resolve_case(case.model_copy(update={"lattice": lattice}), cells)
            other = with_acceptance(case.model_copy(update={"lattice": lattice}))
            inside = inner_points(plan.domain).shape[1]
            found[name] = predicted_run(replace(plan, case=other), inside).run_s
    return found


def left_out(name: str, why: str, *, asked: bool = False) -> PricedBody:
    """A body that was not sized, and why."""
    return PricedBody(name=name, mass_g=None, largest_utilisation=None, asked=asked, note=why)


def why_lattice(bodies: Sequence[PricedBody]) -> str:
    """One sentence on the body that the case asks for beside the lightest that holds."""
    holding = {body.name: body for body in bodies if body.holds}
    own = next((body for body in bodies if body.asked), None)
    if own is None or own.mass_g is None:
        return ""
    filled = [b for name, b in holding.items() if name != _VOID_BODY and not b.asked]
    lightest = min(filled, key=lambda b: b.mass_g or 0.0, default=own)
    words = ""
    if lightest.mass_g is not None and lightest.mass_g < (1 - _LIGHTER) * own.mass_g:
        words = (
            f"{lightest.name} would weigh {1 - lightest.mass_g / own.mass_g:.0%} less: "
            f"{_KEYS[lightest.name]}. "
        )
    void = holding.get(_VOID_BODY)
    if void is not None and void.mass_g is not None and void.mass_g < own.mass_g:
        words += (
            f"Without cells, solid and void would weigh {1 - void.mass_g / own.mass_g:.0%} less by "
            f"stiffness alone, "
        )
        words += (
            "and a run sizes both, cut into members, to make the lighter."
            if void.asked
            else f"{_KEYS[_VOID_BODY]}: lattice is there because the body is to stay filled."
        )
    return words or "no other body that was looked at is lighter at these limits."
