"""``gradedesign check``: what a run would do, in seconds; mesh and analysis on request only."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from gradedesign.common.system.progress import report_step
from gradedesign.design.case.schema import Case
from gradedesign.design.check.check_case import CaseCheck, check_case
from gradedesign.design.resolve.own_cell import with_own_cell
from gradedesign.design.resolve.registry import Registry
from gradedesign.errors import UNMET, CaseError
from gradedesign.geometry.part.file_faces import file_body_words
from gradedesign.mechanics.sizing.wall_cells import MOST_MINUTES
from gradedesign.program.commands.check_data import (
    check_data,
    kept_solids,
    stated_limits,
    zone_data,
)
from gradedesign.program.commands.check_stated import check_stated
from gradedesign.program.commands.plugins import registry_for
from gradedesign.program.commands.progress_lines import ProgressLines
from gradedesign.program.commands.show import (
    duration,
    print_json,
    print_table,
    print_text,
    print_warnings,
)
from gradedesign.program.commands.show_answer import answer_data, print_answer
from gradedesign.program.commands.show_part import (
    extent,
    part_words,
    point_words,
    print_file_faces,
    print_holes,
    print_regions,
    repair_words,
    triple,
)
from gradedesign.program.host.read_case import load_case
from gradedesign.program.pictures.marks import action_marks, loads_note, region_marks
from gradedesign.program.pictures.pictures import picture_loads
from gradedesign.program.store.stages import default_folder

if TYPE_CHECKING:
    from gradedesign.design.check.first_answer import FirstAnswer

PICTURE = "loads.png"


def check(
    path: Path,
    output: Path | None = None,
    *,
    estimate: bool,
    picture: bool,
    allow_outside: bool,
    strict_plugins: bool,
    as_json: bool,
) -> int:
    """Read, repair, select, predict; written is the picture of loads and supports.

    Returns the exit code: that of a run which ends infeasible where the estimate shows that the
    fully solid part breaks a limit.
    """
    registry = registry_for(strict_plugins=strict_plugins)
    case = load_case(path, allow_outside=allow_outside, registry=registry)
    registry = with_own_cell(case.lattice, registry, case.where)
    if case.lattice.stated:
        return check_stated(case, registry, estimate=estimate, as_json=as_json)
    with ProgressLines("check", err=True):
        checked = check_case(case, registry)
        warnings = list(checked.warnings)
        answer = estimated(case, checked, registry) if estimate else None
        broken = answer is not None and not answer.feasible
        warnings += () if answer is None else answer.yields
        drawn = None
        if picture:
            drawn = _picture_path(checked) if output is None else output
            drawn = drawn / PICTURE if drawn.is_dir() else drawn
            warnings += _draw_loads(checked, drawn)
    if as_json:
        data = check_data(checked, drawn, warnings)
        print_json(data if answer is None else {**data, "first_answer": answer_data(answer)})
        return UNMET if broken else 0
    print_check(checked)
    if answer is not None:
        print_answer(answer)
    if drawn is not None:
        print_text(f"picture: {drawn}", hang=2)
    print_warnings(warnings)
    return UNMET if broken else 0


def estimated(case: Case, checked: CaseCheck, registry: Registry) -> FirstAnswer:
    """Mesh and analyse the solid part as a run does, and size it once.

    ``checked``: the check of that case.
    """
    # Only here: a check without it needs no finite elements.
    from gradedesign.design.check.first_answer import first_answer
    from gradedesign.design.check.price import seconds_of_bodies
    from gradedesign.design.resolve.design_model import prepare
    from gradedesign.design.resolve.solid import solve_solid, with_solid

    model = prepare(case, registry)
    report_step("solid part")
    answer = first_answer(with_solid(model, solve_solid(model.homogenised)))
    return replace(answer, run_s=seconds_of_bodies(checked, registry))


def _picture_path(checked: CaseCheck) -> Path:
    """Path of the picture, beside the run folder, which stays as it is."""
    folder = default_folder(checked.plan.case.name)
    return folder.with_name(f"{folder.name}-check") / PICTURE


def _draw_loads(checked: CaseCheck, path: Path) -> tuple[str, ...]:
    """Draw supports, loads and solid regions as a run does; returns warnings.

    Raises CaseError if the folder cannot be made.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CaseError(
            f"cannot make {path.parent} for the picture: {error.strerror}; choose another file "
            f"with -o, or leave it out with --no-picture"
        ) from error
    plan, case = checked.plan, checked.plan.case
    return picture_loads(
        path,
        plan.part.surface,
        region_marks(case.load_case, plan.part, plan.domain, plan.support_zones),
        action_marks(case.load_case, plan.part),
        title=f"Loading of {case.name}",
        note=loads_note(case.load_case, plan.support_zones, checked.unjudged.part),
    )


def print_check(checked: CaseCheck) -> None:
    """Print a checked case for a person."""
    plan = checked.plan
    for line in _part_lines(checked):
        print_text(line, hang=2)
    print_regions(plan.part, plan.part.regions)
    if solids := kept_solids(checked):
        print_table(
            "Passive solids",
            ("solid", "thickness mm", "volume mm^3"),
            [(s["name"], f"{s['thickness_mm']:.4g}", f"{s['volume_mm3']:.4g}") for s in solids],
        )
    print_holes(plan.part, checked.holes)
    print_file_faces(plan.part)
    print_outlook(checked)


def print_outlook(checked: CaseCheck) -> None:
    """Print what a run of a checked case is about and will take."""
    _print_loads(checked)
    print_text("free rigid motions: none")
    print_table("Limits", ("limit", "load case", "allowed"), stated_limits(checked))
    print_text(checked.unjudged.words, hang=2)
    for line in (*_lattice_lines(checked), *_cost_lines(checked)):
        print_text(line, hang=2)


def _part_lines(checked: CaseCheck) -> Iterator[str]:
    plan = checked.plan
    mass = plan.material.density * plan.part.volume * 1e6
    yield f"case: {plan.case.name}"
    yield f"{part_words(plan.part)}, {mass:.4g} g if solid in {plan.material.name}"
    yield from file_body_words(plan.part.file_bodies)
    yield repair_words(plan.part)
    if checked.symmetry:
        yield (
            f"symmetry: mirrored on {', '.join(checked.symmetry['planes'])}: the whole part is "
            f"{checked.symmetry['copies']} times this one, "
            f"{checked.symmetry['solid_mass_g']:.4g} g if solid; loads and masses are those of the "
            f"modelled one"
        )


def _print_loads(checked: CaseCheck) -> None:
    rows, size = [], extent(checked.plan.part)
    for balance in checked.plan.balances:
        acting = [(row.source, row.force, row.moment, row.gross, "") for row in balance.rows]
        gross, about = sum(row.gross for row in balance.rows), point_words(balance.about, size)
        acting.append(("sum", balance.force, balance.moment, gross, about))
        rows += [
            (balance.load_case, source, triple(force, acts), triple(moment, acts * size), centre)
            for source, force, moment, acts, centre in acting
        ]
        if balance.temperature_change:
            heat = f"temperature change {balance.temperature_change:+g} K"
            # Above the sum.
            rows.insert(-1, (balance.load_case, heat, "-", "-", ""))
    columns = ("load case", "on", "force N", "moment N mm", "about the held regions' centre, mm")
    print_table("Loads", columns, rows)


def _zone_lines(checked: CaseCheck) -> Iterator[str]:
    zones = zone_data(checked)
    made = {phase for zone in zones.values() for phase in zone["phases"]}
    for name, zone in zones.items():
        low, high = zone["density_window"]
        yield (
            f"zone {name}: {zone['cell']}, {zone['share_of_lattice']:.0%} of the lattice, density "
            f"{low:.3g} to {high:.3g}, law {zone['law']}"
            + (" (to be computed)" if zone["to_be_computed"] else "")
            + ("" if made == {*zone["phases"]} else ", without solid members")
        )


def _lattice_lines(checked: CaseCheck) -> Iterator[str]:
    plan, law, spec = checked.plan, checked.plan.law, checked.plan.case.lattice
    low, high = checked.run.bounds
    if not spec.cells:
        yield f"cells: none; solid members of about {spec.least_member:.3g} mm or more, and void"
        return
    yield (
        f"cell: {plan.cell.name}, {spec.size_words}; it exists from density "
        f"{plan.cell.window[0]:.3g} to {plan.cell.window[1]:.3g}"
    )
    thick = checked.thickness
    if thick.thickness:
        walls = zip(thick.shares, thick.thickness, thick.cells, strict=True)
        yield "thickness of the part: " + ", ".join(
            f"{share} % of it up to {value:.3g} mm ({cells:.2g} cells)"
            for share, value, cells in walls
        )
    yield f"density window: {low:.3g} to {high:.3g}"
    if thickness := spec.least_member:
        yield f"solid members: where they are lighter, about {thickness:.3g} mm thick or more"
    yield from _zone_lines(checked)
    holds = f"for densities {law.window[0]:.3g} to {law.window[1]:.3g}"
    if law.known is not None:
        origin = "installed" if law.kind not in ("fitted", "stated") else law.known.source
        yield f"law: {law.name}, {origin}, {holds}"
    elif law.tabulated:
        yield f"law: {law.name}, computed before, in the cache, {holds}"
    else:
        least, most = law.minutes
        yield (
            f"law: {law.name}, to be computed on {law.voxels}^3 voxels: {least:.0f} to "
            f"{most:.0f} min the first time ({law.why})"
        )
    yield "size effects: " + (
        f"none, since {checked.periodic}"
        if checked.periodic
        else "of the walls of few cells that the run finds, from the cache or computed in up to "
        f"{MOST_MINUTES} min"
    )


def _cost_lines(checked: CaseCheck) -> Iterator[str]:
    case = checked.plan.case
    run, budget = checked.run, case.run
    cost = run.cost
    exact = "" if case.part.bricks is not None else "about "
    yield f"mesh of the part: {exact}{cost.part_dofs} unknowns at {_mesh_size(checked)}"
    yield f"explicit grid: {run.grid.spacing:.3g} mm, set by {run.grid.set_by}"
    if run.explicit:
        yield (
            f"explicit lattice: about {cost.explicit_dofs / 1e6:.2g} M unknowns at mean density "
            f"{run.density:.2g}"
        )
        yield (
            f"memory: about {cost.memory_bytes / 1e9:.2g} GB of {budget.memory / 1e9:.3g} GB "
            f"allowed"
        )
    else:
        yield f'explicit lattice: none, [run] stop_after = "{budget.stop_after}"'
    yield (
        f"time: about {duration(run.run_s)} of {duration(budget.time)} allowed, "
        f"{duration(run.iteration_s)} an iteration on two idle cores"
    )


def _mesh_size(checked: CaseCheck) -> str:
    return f"{checked.plan.case.part.element_size:g} mm"
