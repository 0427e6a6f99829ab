"""``gradedesign judge``: a body made elsewhere against the limits of a case."""

from __future__ import annotations

from pathlib import Path

from gradedesign.common.values.suggest import instead, shown
from gradedesign.design.case.read_case import part_files
from gradedesign.design.check.draft_case import part_of_file
from gradedesign.design.loop.announce import Announcer
from gradedesign.design.resolve.design_model import prepare
from gradedesign.design.resolve.own_cell import with_own_cell
from gradedesign.design.resolve.solid import solve_solid, with_solid
from gradedesign.design.verdict.judged import judged_result
from gradedesign.design.verdict.result import as_json as plain
from gradedesign.errors import UNMET, CaseError
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.geometry.part.part_schema import UNITS
from gradedesign.program.commands.plugins import registry_for
from gradedesign.program.commands.progress_lines import ProgressLines
from gradedesign.program.commands.run import print_verdict
from gradedesign.program.commands.show import print_json
from gradedesign.program.host.read_case import load_case
from gradedesign.program.outputs.provenance import stamped

#: Keys of a lattice whose density is looked for.
_SOUGHT = {"density": LatticeSpec.model_fields["density"].default, "density_map": None}


def judge(
    path: Path,
    body: Path,
    *,
    units: str | None,
    allow_outside: bool,
    strict_plugins: bool,
    as_json: bool,
) -> int:
    """Judge a body, print the verdict and return the exit code: that of a run with that status."""
    registry = registry_for(strict_plugins=strict_plugins)
    case = load_case(path, allow_outside=allow_outside, registry=registry)
    if case.limits.empty:
        raise CaseError(
            f"{case.where('limits')}: the case has no limits, by which a body is judged; expected "
            f"e.g. safety_factor = 2 in [limits]"
        )
    if case.lattice.stated:
        # What is judged has its density in its surface.
        case = case.model_copy(update={"lattice": case.lattice.model_copy(update=_SOUGHT)})
    if units is not None and units not in UNITS:
        raise CaseError(f"--units: found {shown(units)}; {instead(units, UNITS)}")
    registry = with_own_cell(case.lattice, registry, case.where)
    known = case.part.units in (None, "mm")
    lines = ProgressLines(budget_s=case.run.time, err=as_json, events=not as_json)
    with lines as progress:
        announce = Announcer(progress)
        with announce.stage("part"):
            read = part_of_file(
                body, registry, {} if units is None else {"units": units}, "mm" if known else None
            )
            model = prepare(case, registry, progress)
        with announce.stage("solid"):
            model = with_solid(model, solve_solid(model.homogenised))
        result = stamped(
            judged_result(model, registry, read, announce), [body, *part_files(case.part)]
        )
    if as_json:
        print_json(plain(result))
    else:
        print_verdict(result)
    return UNMET if result.status == "not_met" else 0
