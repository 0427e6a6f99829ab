"""``gradedesign check``: what a run would do, in seconds; mesh and analysis on request only."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.case.schema import Case
from gradedesign.check.check_case import CaseCheck, check_case
from gradedesign.cli.check_data import (
    check_data,
    file_faces,
    passive_solids,
    stated_limits,
    zone_data,
)
from gradedesign.cli.plugins import registry_for
from gradedesign.cli.progress_lines import ProgressLines
from gradedesign.cli.show import print_json, print_table, print_text, print_warnings, without_noise
from gradedesign.cli.show_answer import answer_data, print_answer
from gradedesign.errors import CaseError
from gradedesign.loop.stages import default_folder
from gradedesign.output.pictures import picture_loads
from gradedesign.plugin.read_case import load_case
from gradedesign.plugin.registry import Registry
from gradedesign.resolve.own_cell import with_own_cell
from gradedesign.results.marks import action_marks, region_marks, warming_note
from gradedesign.size_effects.wall_cells import MOST_MINUTES
from gradedesign.workspace.progress import report_step

if TYPE_CHECKING:
    from gradedesign.check.first_answer import FirstAnswer

PICTURE = "loads.png"
#: Groups of cylinders that are printed; ``--json`` has all.
_MOST_HOLES = 12
#: Faces of the file that are printed; ``--json`` has all.
_MOST_FILE_FACES = 24
#: Points of one group that are printed.
_MOST_POINTS = 4


def check(
    path: Path,
    output: Path | None = None,
    *,
    estimate: bool,
    picture: bool,
    allow_outside: bool,
    strict_plugins: bool,
    as_json: bool,
) -> None:
    """Read, repair, select, predict; written is the picture of loads and supports."""
    registry = registry_for(strict_plugins=strict_plugins)
    case = load_case(path, allow_outside=allow_outside, registry=registry)
    registry = with_own_cell(case, registry)
    with ProgressLines("check", err=True):
        checked = check_case(case, registry)
        warnings = list(checked.warnings)
        answer = estimated(case, registry) if estimate else None
        drawn = None
        if picture:
            drawn = picture_path(checked) if output is None else output
            drawn = drawn / PICTURE if drawn.is_dir() else drawn
            warnings += draw_loads(checked, drawn)
    if as_json:
        data = check_data(checked, drawn, warnings)
        print_json(data if answer is None else {**data, "first_answer": answer_data(answer)})
        return
    print_check(checked)
    if answer is not None:
        print_answer(answer)
    if drawn is not None:
        print_text(f"picture: {drawn}", hang=2)
    print_warnings(warnings)


def estimated(case: Case, registry: Registry) -> FirstAnswer:
    """Mesh and analyse the solid part as a run does, and size it once."""
    # Only here: a check without it needs no finite elements.
    from gradedesign.check.first_answer import first_answer
    from gradedesign.resolve.setup import prepare
    from gradedesign.resolve.solid import solve_solid, with_solid

    setup = prepare(case, registry)
    report_step("solid part")
    solutions = solve_solid(setup.problem)
    return first_answer(with_solid(setup, solutions), solutions)


def picture_path(checked: CaseCheck) -> Path:
    """Path of the picture, beside the run folder, which stays as it is."""
    folder = default_folder(checked.resolved.case)
    return folder.with_name(f"{folder.name}-check") / PICTURE


def draw_loads(checked: CaseCheck, path: Path) -> tuple[str, ...]:
    """Draw supports, loads and solid regions as a run does; returns warnings.

    Raises
    ------
    CaseError
        If the folder cannot be made.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CaseError(
            f"cannot make {path.parent} for the picture: {error.strerror}; choose another file "
            f"with -o, or leave it out with --no-picture"
        ) from error
    resolved = checked.resolved
    return picture_loads(
        path,
        resolved.part.surface,
        region_marks(resolved.case, resolved.part, resolved.domain),
        action_marks(resolved.case, resolved.part),
        title=f"Loading of {resolved.case.name}",
        note=warming_note(resolved.case),
    )


def print_check(checked: CaseCheck) -> None:
    """Print a checked case for a person."""
    resolved = checked.resolved
    for line in _part_lines(checked):
        print_text(line, hang=2)
    regions, size = sorted(resolved.part.regions.items()), _extent(checked)
    print_table(
        "Regions",
        ("region", "faces", "area mm^2", "centroid mm"),
        [(n, str(len(r.faces)), f"{r.area:.4g}", _triple(r.centroid, size)) for n, r in regions],
    )
    if solids := passive_solids(checked):
        print_table(
            "Passive solids",
            ("solid", "thickness mm", "volume mm^3"),
            [(s["name"], f"{s['thickness_mm']:.4g}", f"{s['volume_mm3']:.4g}") for s in solids],
        )
    if checked.holes:
        _print_holes(checked)
    _print_file_faces(checked)
    _print_loads(checked)
    print_text("free rigid motions: none")
    print_table("Limits", ("limit", "load case", "allowed"), stated_limits(checked))
    for line in (*_lattice_lines(checked), *_cost_lines(checked)):
        print_text(line, hang=2)


def _part_lines(checked: CaseCheck) -> Iterator[str]:
    resolved = checked.resolved
    part = resolved.part
    edges = np.ptp(part.surface.vertices, axis=0)
    unit = "" if part.units is None else f", read in {part.units}"
    if part.chord_tolerance is not None:
        unit += f", triangles within {part.chord_tolerance:.2g} mm of its faces"
    mass = resolved.material.density * part.volume * 1e6
    yield f"case: {resolved.case.name}"
    yield (
        f"part: {part.source}{unit}, {' x '.join(f'{edge:.4g}' for edge in edges)} mm, "
        f"{part.volume:.6g} mm^3, {mass:.4g} g if solid in {resolved.material.name}"
    )
    made = part.report.changes
    yield "repairs: " + (", ".join(f"{key} {count}" for key, count in made.items()) or "none")


def _print_file_faces(checked: CaseCheck) -> None:
    rows = file_faces(checked.resolved.part)
    if not rows:
        return
    print_table(
        "Faces of the file",
        ("face", "name", "color", "area mm^2", "surface", "centroid mm"),
        [
            (
                str(row["face"]),
                row["name"] or "",
                row["color"] or "",
                f"{row['area_mm2']:.4g}",
                _surface_words(row),
                _triple(np.array(row["centroid_mm"]), _extent(checked)),
            )
            for row in rows[:_MOST_FILE_FACES]
        ],
    )
    more = len(rows) - _MOST_FILE_FACES
    if more > 0:
        print_text(f"  and {more} more; --json lists all")


def _surface_words(row: dict[str, Any]) -> str:
    diameter = row["diameter_mm"]
    return (row["surface"] or "") + ("" if diameter is None else f" of {diameter:.4g} mm")


def _print_holes(checked: CaseCheck) -> None:
    print_table(
        "Holes and bosses",
        ("kind", "faces", "to select them", "on their axes, mm"),
        [
            (
                "hole" if group.concave else "boss or rounding",
                str(group.count),
                group.selector,
                _points(group.points, _extent(checked)),
            )
            for group in checked.holes[:_MOST_HOLES]
        ],
    )
    more = len(checked.holes) - _MOST_HOLES
    if more > 0:
        print_text(f"  and {more} more; --json lists all")


def _print_loads(checked: CaseCheck) -> None:
    rows = []
    for balance in checked.resolved.balances:
        rows += [
            (balance.load_case, row.source, _triple(row.force), _triple(row.moment), "")
            for row in balance.rows
        ]
        about = _triple(balance.about, _extent(checked))
        total = (_triple(balance.force), _triple(balance.moment), about)
        rows.append((balance.load_case, "sum", *total))
    columns = ("load case", "on", "force N", "moment N mm", "about the held regions' centre, mm")
    print_table("Loads", columns, rows)


def _zone_lines(checked: CaseCheck) -> Iterator[str]:
    for name, zone in zone_data(checked).items():
        low, high = zone["density_window"]
        yield (
            f"zone {name}: {zone['cell']}, {zone['share_of_lattice']:.0%} of the lattice, density "
            f"{low:.3g} to {high:.3g}, law {zone['law']}"
            + (" (to be computed)" if zone["to_be_computed"] else "")
        )


def _lattice_lines(checked: CaseCheck) -> Iterator[str]:
    resolved, plan = checked.resolved, checked.resolved.law
    low, high = checked.run.bounds
    yield (
        f"cell: {resolved.cell.name}, {resolved.case.lattice.size_words}; it exists from density "
        f"{resolved.cell.window[0]:.3g} to {resolved.cell.window[1]:.3g}"
    )
    thick = checked.thickness
    if thick.thickness:
        walls = zip(thick.shares, thick.thickness, thick.cells, strict=True)
        yield "thickness of the part: " + ", ".join(
            f"{share} % of it up to {value:.3g} mm ({cells:.2g} cells)"
            for share, value, cells in walls
        )
    yield f"density window: {low:.3g} to {high:.3g}"
    yield from _zone_lines(checked)
    holds = f"for densities {plan.window[0]:.3g} to {plan.window[1]:.3g}"
    if not plan.voxels:
        yield f"law: {plan.name}, installed, {holds}"
    elif plan.tabulated:
        yield f"law: {plan.name}, computed before, in the cache, {holds}"
    else:
        least, most = plan.minutes
        yield (
            f"law: {plan.name}, to be computed on {plan.voxels}^3 voxels: {least:.0f} to "
            f"{most:.0f} min the first time ({plan.why})"
        )
    yield "size effects: " + (
        f"none, since {checked.periodic}"
        if checked.periodic
        else "of the walls of few cells that the run finds, from the cache or computed in up to "
        f"{MOST_MINUTES} min"
    )


def _cost_lines(checked: CaseCheck) -> Iterator[str]:
    run, budget = checked.run, checked.resolved.case.run
    cost = run.cost
    exact = "" if checked.resolved.case.part.bricks is not None else "about "
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
        f"time: about {_duration(run.run_s)} of {_duration(budget.time)} allowed, "
        f"{_duration(run.iteration_s)} an iteration on two idle cores"
    )


def _mesh_size(checked: CaseCheck) -> str:
    return f"{checked.resolved.case.part.element_size:g} mm"


def _duration(seconds: float) -> str:
    """Seconds below two minutes, minutes below two hours, hours."""
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


def _points(points: FloatArray, size: float) -> str:
    text = " ".join(_triple(point, size) for point in points[:_MOST_POINTS])
    more = len(points) - _MOST_POINTS
    return text if more <= 0 else f"{text} and {more} more"


def _triple(vector: FloatArray, size: float = 0.0) -> str:
    """Three figures, without rounding noise beside each other and beside a size."""
    largest = max(float(np.abs(vector).max(initial=0.0)), size)
    return f"({', '.join(f'{v:.4g}' for v in without_noise(vector, largest))})"


def _extent(checked: CaseCheck) -> float:
    """Longest edge of the part's box, mm."""
    return float(np.ptp(checked.resolved.part.surface.vertices, axis=0).max())
