"""The result record of a body made elsewhere."""

from __future__ import annotations

from gradedesign.design.loop.announce import Announcer
from gradedesign.design.loop.judged_body import judge_body
from gradedesign.design.printing.print_checks import check_printed
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.verdict.common import common_entries, solid_mass
from gradedesign.design.verdict.printable import thickness_data, with_print_limits
from gradedesign.design.verdict.reasons import why_judged
from gradedesign.design.verdict.result import RunResult
from gradedesign.geometry.part.file_faces import file_body_data
from gradedesign.geometry.part.part import Part
from gradedesign.mechanics.limits.verdict import unsure_words


def judged_result(
    model: DesignModel, registry: Registry, body: Part, announce: Announcer
) -> RunResult:
    """Judge a body, see `judge_body`, and how it is printed, and say so as a run its verdict."""
    case, found = model.plan.case, judge_body(model, body, announce)
    with announce.stage("printed"):
        printability = check_printed(
            case.print, model.plan.part.surface, body.surface, found.thickness
        )
    mass, whole = body.volume * model.plan.material.density * 1e6, solid_mass(model.homogenised)
    # Warnings on the model are on cells that the body need not have.
    entries = {
        **common_entries(model, registry),
        "repairs": body.report.changes,
        "file_bodies": file_body_data(body.file_bodies),
        "yields": found.yields,
        "warnings": (*registry.notes, *unsure_words(model.solid), *found.warnings),
    }
    result = RunResult(
        status="met" if found.holds else "not_met",
        lightest=False,
        reason=why_judged(found.rows, found.ended, model.solid, holds=found.holds),
        ended_by=found.ended.by,
        limits=found.rows,
        mass_g=mass,
        relative_density=mass / whole,
        printed={**thickness_data(found.thickness), "elements_mm": found.element},
        timing_s=announce.timing(),
        **entries,
    )
    return with_print_limits(result, case.print, printability, designed=False)
