"""Everything a run writes: result.json, log, meshes, pictures, report."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.lattice.lattice import LatticeDesign
from gradedesign.lattice.printed_surface import first_step, printed_surface
from gradedesign.limits.local_stress import allowed_stress
from gradedesign.loop.announce import Announcer
from gradedesign.loop.iteration import DesignIteration
from gradedesign.loop.iteration_steps import build_design, density_grid
from gradedesign.mesh.surface_mesh import SurfaceMesh
from gradedesign.output.pictures import (
    picture_deformed,
    picture_density,
    picture_lattice,
    picture_loads,
    picture_stress,
)
from gradedesign.output.report import render_report
from gradedesign.output.result import RunResult, as_json
from gradedesign.output.vtu import write_vtu
from gradedesign.resolve.cell_choice import CellChoice
from gradedesign.resolve.lattice_files import (
    STL_NAME,
    chord_tolerance,
    crossing_warnings,
    printed_lattice,
    write_lattice_files,
    write_printed,
)
from gradedesign.resolve.outer_triangles import keeps_outer
from gradedesign.resolve.problem import Problem, unjudged_share
from gradedesign.resolve.setup import Setup
from gradedesign.resolve.thinnest_wall import thinnest_wall
from gradedesign.results.decks import write_decks
from gradedesign.results.iteration_log import iteration_log
from gradedesign.results.marks import action_marks, loads_note, region_marks
from gradedesign.results.provenance import stamped
from gradedesign.results.series import write_series
from gradedesign.results.shown import Shown
from gradedesign.results.solid_vtu import write_solid_vtu
from gradedesign.verify.correction import Correction
from gradedesign.verify.explicit import governing_load_case
from gradedesign.verify.support_zones import evaluated_at
from gradedesign.workspace.progress import report_step
from gradedesign.workspace.run_folder import RunFolder

RESULT_NAME, REPORT_NAME = "result.json", "report.html"


def write_result(out: RunFolder, result: RunResult) -> None:
    """Write result.json."""
    out.write_text(RESULT_NAME, json.dumps(as_json(result), indent=2, allow_nan=False) + "\n")


def write_outputs(
    out: RunFolder,
    setup: Setup,
    result: RunResult,
    announce: Announcer,
    *,
    rho: FloatArray | None = None,
    shown: Shown | None = None,
    iterations: Sequence[DesignIteration] = (),
) -> RunResult:
    """Write the files of what was computed, and return the result with their names."""
    problem = setup.problem
    files: dict[str, str] = {}
    warnings: list[str] = list(result.warnings)
    with announce.stage("output"):
        warnings += _loads_picture(out, problem, files)
        density = shown.rho if shown is not None else rho
        if density is None:
            write_solid_vtu(out, problem, setup.solutions, files)
        if "inp" in problem.case.output.formats:
            learned = _learned(iterations, density)
            warnings += write_decks(
                out, setup, files, rho=density, correction=learned, printed=shown
            )
        if density is not None:
            warnings += _density_files(out, problem, density, files)
        if iterations and "vtu" in problem.case.output.formats:
            write_series(out, problem, iterations, files)
        if shown is not None:
            warnings += _exported_files(out, problem, shown.surface, shown.analysed.design, files)
            warnings += _lattice_files(out, problem, shown, files)
        elif rho is not None and problem.case.run.stop_after == "lattice":
            warnings += _unjudged_lattice(out, problem, setup.cells, rho, files)
    formats = problem.case.output.formats
    if "report" in formats:
        files["report"] = REPORT_NAME
    files["log"] = "iterations.csv"
    files["result"] = RESULT_NAME
    result = replace(
        result,
        folder=out.path,
        files=files,
        warnings=tuple(dict.fromkeys(warnings)),
        timing_s=announce.timing(),
    )
    printed = [STL_NAME, *(file.name for file in problem.lattice_files)]
    result = stamped(out, problem.case, result, printed)
    out.write_text("iterations.csv", iteration_log(result.iterations))
    if "report" in formats:
        pictures = {
            name: (out.path / path).read_bytes()
            for name, path in files.items()
            if path.endswith(".png")
        }
        case_text = problem.case.path.read_text(encoding="utf-8")
        out.write_text(REPORT_NAME, render_report(result, pictures, case_text))
    write_result(out, result)
    return result


def _learned(iterations: Sequence[DesignIteration], rho: FloatArray | None) -> Correction:
    """Correction that the explicit analysis of a design taught; none before."""
    if rho is None:
        return Correction()
    corrections = (
        iteration.correction for iteration in iterations if np.array_equal(iteration.rho, rho)
    )
    return next(corrections, Correction())


def _loads_picture(out: RunFolder, problem: Problem, files: dict[str, str]) -> tuple[str, ...]:
    files["loads"] = "loads.png"
    warnings = picture_loads(
        out.path_of("loads.png"),
        problem.part.surface,
        region_marks(problem.case, problem.part, problem.domain, problem.support_zones),
        action_marks(problem.case, problem.part),
        note=loads_note(problem.case, problem.support_zones, unjudged_share(problem)),
    )
    _adopt_drawn(out, files, "loads")
    return warnings


def _density_files(
    out: RunFolder, problem: Problem, rho: FloatArray, files: dict[str, str]
) -> tuple[str, ...]:
    shown = np.where(problem.solid_fraction >= 1.0, 1.0, rho)
    files["density"] = "density.png"
    warnings = picture_density(out.path_of("density.png"), problem.space.mesh, shown)
    _adopt_drawn(out, files, "density")
    if "vtu" in problem.case.output.formats:
        report_step("writing density.vtu")
        files["density_vtu"] = "density.vtu"
        write_vtu(
            out.path_of("density.vtu"),
            problem.space.mesh,
            cell_data={
                "relative_density [-]": rho,
                "solid_volume_fraction [-]": problem.solid_fraction,
            },
        )
        out.adopt("density.vtu")
    return warnings


def _lattice_files(
    out: RunFolder, problem: Problem, shown: Shown, files: dict[str, str]
) -> tuple[str, ...]:
    """Pictures and fields of the lattice."""
    result = shown.analysed.result
    load_case = governing_load_case(result)
    fields, solid = shown.fields, shown.analysed.solid
    files |= {"lattice": "lattice.png", "stress": "stress.png", "deformed": "deformed.png"}
    warnings = [
        *picture_lattice(
            out.path_of("lattice.png"), shown.surface, opened=bool(problem.domain.skins)
        ),
        *picture_stress(
            out.path_of("stress.png"),
            fields.surface,
            fields.von_mises,
            limit=allowed_stress(problem.case, problem.material),
            unjudged=~evaluated_at(fields.surface.vertices.T, solid.support_zones),
            title=f"Stress of the lattice, load case {load_case}",
        ),
        *picture_deformed(
            out.path_of("deformed.png"),
            fields.surface,
            fields.displacement,
            title=f"Deformed lattice, load case {load_case}",
        ),
    ]
    for name in ("lattice", "stress", "deformed"):
        _adopt_drawn(out, files, name)
    if "vtu" in problem.case.output.formats:
        report_step("writing lattice.vtu")
        files["lattice_vtu"] = "lattice.vtu"
        sampled = {
            f"von_mises {name} [MPa]": values.mean(axis=1)
            for name, values in result.von_mises.items()
        }
        sampled["phase [0 lattice 1 skin 2 passive]"] = result.phase.astype(np.float64)
        solved = result.solved.volume_fields(sampled)
        write_vtu(
            out.path_of("lattice.vtu"),
            (solved.points, solved.elements),
            point_data=solved.point_data,
            cell_data=solved.element_data,
        )
        out.adopt("lattice.vtu")
    return tuple(warnings)


def _unjudged_lattice(
    out: RunFolder,
    problem: Problem,
    cells: CellChoice,
    rho: FloatArray,
    files: dict[str, str],
) -> tuple[str, ...]:
    """Surface of a design that no analysis has judged."""
    density = density_grid(problem, cells, rho)
    design = build_design(problem, cells, density)
    step = first_step(cells.layout.least, thinnest_wall(problem, cells, density)[0])
    case, part = problem.case, problem.part.surface
    memory, outer = case.run.memory, keeps_outer(case)
    surface, islands, _ = printed_surface(
        design, part, step, chord_tolerance(case), memory=memory, keep_outer=outer
    )
    write_printed(out, case, part, surface)
    warnings = _exported_files(out, problem, surface, design, files)
    files["lattice"] = "lattice.png"
    warnings += picture_lattice(
        out.path_of("lattice.png"), surface, opened=bool(problem.domain.skins)
    )
    _adopt_drawn(out, files, "lattice")
    if islands.dropped:
        return (*warnings, f"{islands.dropped} floating islands were removed")
    return warnings


def _exported_files(
    out: RunFolder,
    problem: Problem,
    surface: SurfaceMesh,
    design: LatticeDesign,
    files: dict[str, str],
) -> tuple[str, ...]:
    """The printed surface in every format asked for; the STL, always made, lies there already."""
    files["stl"] = STL_NAME
    others = [file for file in problem.lattice_files if file.name != STL_NAME]
    lattice = printed_lattice(problem.case, problem.part.surface, surface, design, problem.material)
    files |= write_lattice_files(out, others, lattice)
    return crossing_warnings(surface)


def _adopt_drawn(out: RunFolder, files: dict[str, str], name: str) -> None:
    """Enter a picture in the manifest; one that could not be drawn left a warning instead."""
    if (out.path / files[name]).is_file():
        out.adopt(files[name])
    else:
        del files[name]
