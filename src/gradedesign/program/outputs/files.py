"""Everything a run writes: result.json, log, pictures, the lattice, and the outputs asked for."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.system.atomic import replacing_path
from gradedesign.common.system.progress import report_step
from gradedesign.design.case.read_case import part_files
from gradedesign.design.case.schema import Case
from gradedesign.design.loop.announce import Announcer
from gradedesign.design.loop.designed import density_grid, with_design
from gradedesign.design.loop.exported_surface import case_surface
from gradedesign.design.loop.iteration import DesignIteration
from gradedesign.design.loop.iteration_steps import build_design
from gradedesign.design.loop.stated_print import StatedPrint
from gradedesign.design.resolve.cell_choice import thinnest_wall
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.design.resolve.lattice_files import (
    STL_NAME,
    crossing_warnings,
    outer_records,
    printed_lattice,
)
from gradedesign.design.resolve.plan import Plan
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.shown_case import shown_plan, shown_stated
from gradedesign.design.resolve.solid import unjudged_share
from gradedesign.design.resolve.stated_lattice import StatedLattice
from gradedesign.design.verdict.computed import Computed, computed_fields
from gradedesign.design.verdict.result import RunResult, as_json
from gradedesign.errors import PluginError, blaming
from gradedesign.geometry.contour.islands import islands_words
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.geometry.lattice.printed_surface import first_step
from gradedesign.geometry.lattice.slab_density import slab_table
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.explicit.correction import Correction
from gradedesign.mechanics.limits.local_stress import allowed_stress
from gradedesign.program.outputs.analysed_models import analysed_models, without_model
from gradedesign.program.outputs.drawn_files import (
    density_picture,
    lattice_picture,
    lattice_pictures,
    loads_picture,
    shown_density,
)
from gradedesign.program.outputs.iteration_log import iteration_log
from gradedesign.program.outputs.output import FinishedRun, Output
from gradedesign.program.outputs.printed_files import (
    compensated_file,
    write_lattice_files,
    write_printed,
)
from gradedesign.program.outputs.provenance import stamped
from gradedesign.program.outputs.report_section import ReportSection, ReportTable
from gradedesign.program.outputs.scene_file import fields_by_case, stored_scene, write_scene
from gradedesign.program.pictures.run_scene import RunShown
from gradedesign.program.store.run_folder import RunFolder

RESULT_NAME = "result.json"
_SLABS_NAME = "slabs.csv"
#: The case file as it was run: no ``case.toml``, since files that it names lie elsewhere.
CASE_COPY = "case-as-run.toml"


def write_result(out: RunFolder, result: RunResult) -> None:
    """Write result.json."""
    out.write_text(RESULT_NAME, json.dumps(as_json(result), indent=2, allow_nan=False) + "\n")


def write_outputs(
    out: RunFolder,
    model: DesignModel,
    registry: Registry,
    result: RunResult,
    announce: Announcer,
    computed: Computed,
) -> RunResult:
    """Write the files of what was computed, and return the result with their names."""
    plan, case = model.plan, model.plan.case
    shown, rho = computed.shown, computed.rho
    if computed.density is None:
        sized = model
    else:
        sized = with_design(model, computed.density, computed.field)
    part = sized.homogenised

    def drawn(files: dict[str, str]) -> Iterator[str]:
        density, printed, limit = None, None, allowed_stress(case.limits, plan.material)
        unjudged = unjudged_share(model.homogenised, plan.support_zones)
        yield from loads_picture(out, shown_plan(plan), unjudged, files)
        if computed.density is not None:
            density = part.space.mesh, shown_density(part, computed.density)
            yield from density_picture(out, *density, files)
        if shown is not None:
            printed = shown.surface
            yield from _exported_files(out, plan, printed, shown.analysed.design, files)
            yield from compensated_file(out, shown.built, files)
            yield from lattice_pictures(out, plan.domain, limit, shown, files)
        elif rho is not None and case.run.stop_after == "lattice":
            printed, told = _unjudged_lattice(out, sized, rho, files)
            yield from told
        run = RunShown(
            case=shown_plan(sized.plan, sized.cells.layout.cell_map),
            density=density,
            printed=printed,
            analysed={} if shown is None else fields_by_case(shown),
            limit=limit,
        )
        yield from write_scene(out, run, case.name, files)
        out.write_text("iterations.csv", iteration_log(result.iterations))
        files["log"] = "iterations.csv"

    def with_fields(run: FinishedRun) -> FinishedRun:
        return replace(
            run,
            fields=partial(computed_fields, part, model.solutions, computed),
            models=partial(
                analysed_models,
                model,
                rho=computed.density,
                members=computed.field,
                correction=_learned(computed.iterations, computed.density),
                printed=shown,
            ),
            no_model=without_model(shown),
        )

    printed = [STL_NAME, *(file.name for file in plan.tools.files)]
    return _finish((out, registry, announce), case, result, printed, drawn, with_fields)


def write_stated(
    to: tuple[RunFolder, Registry, Announcer],
    stated: StatedLattice,
    made: StatedPrint,
    result: RunResult,
) -> RunResult:
    """The same for a lattice of stated density, of which the densities by slabs are a file too."""
    (out, _, _), case, formats = to, stated.case, stated.formats

    def drawn(files: dict[str, str]) -> Iterator[str]:
        files |= write_lattice_files(out, formats, made.lattice)
        if made.surface is not None:
            yield from compensated_file(out, made.surface.built, files)
            title = f"{case.lattice.cell}, cells of {case.lattice.size_words}"
            yield from crossing_warnings(made.lattice.surface)
            yield from lattice_picture(
                out, made.lattice.surface, stated.design.domain, files, title=title
            )
        printed = None if made.surface is None else made.lattice.surface
        run = RunShown(case=shown_stated(stated), printed=printed, analysed={})
        yield from write_scene(out, run, case.name, files)
        out.write_text(_SLABS_NAME, slab_table(made.slabs))
        files["slabs"] = _SLABS_NAME

    return _finish(to, case, result, [file.name for file in formats], drawn)


def _finish(
    to: tuple[RunFolder, Registry, Announcer],
    case: Case,
    result: RunResult,
    printed: Sequence[str],
    drawn: Callable[[dict[str, str]], Iterable[str]],
    with_more: Callable[[FinishedRun], FinishedRun] = lambda run: run,
) -> RunResult:
    """Write files, the outputs that a case asks for and result.json.

    ``printed``: names of the files of the printed lattice; ``drawn``: writes the files of the run,
    enters them by their keys, and gives its warnings; ``with_more``: adds what outputs may read.
    """
    out, registry, announce = to
    files: dict[str, str] = {}
    warnings: list[str] = list(result.warnings)
    outputs = stated_outputs(case.output.formats, registry)
    asked = "formats" in case.output.model_fields_set

    def current() -> RunResult:
        return replace(
            result,
            folder=out.path,
            files=files,
            warnings=tuple(dict.fromkeys(warnings)),
            timing_s=announce.timing(),
        )

    run = with_more(finished_run((out, registry), case.path, files, current))
    with announce.stage("output"):
        warnings += drawn(files)
        for output in outputs:
            if not output.last:
                before, told = len(files), list(output.write(run))
                if asked and not told and len(files) == before:
                    told = [
                        f"the format '{output.name}' has written nothing: it shows what analyses "
                        f"find, and this run made none; leave it out of [output] formats"
                    ]
                warnings += told
    files["result"] = RESULT_NAME
    result = stamped(result, part_files(case.part), out.checksums(printed))
    for output in outputs:
        if output.last:
            warnings += output.write(run)
    result = current()
    write_result(out, result)
    return result


def stated_outputs(formats: Sequence[str], registry: Registry) -> list[Output]:
    """Outputs among the formats of a case, in its order; the others are those of the lattice."""
    names = dict.fromkeys(formats)
    return [
        _blamed(registry.outputs[name], registry.sources["outputs"][name])
        for name in names
        if name in registry.outputs
    ]


def _blamed(output: Output, source: str) -> Output:
    """An output whose errors name it."""

    def write(run: FinishedRun) -> list[str]:
        with blaming(f"output '{output.name}' of {source}", always=False):
            return list(output.write(run))

    return replace(output, write=write)


def finished_run(
    to: tuple[RunFolder, Registry],
    case_file: Path,
    files: dict[str, str],
    result: Callable[[], RunResult],
) -> FinishedRun:
    """Record that outputs receive, without fields and models; ``files`` takes what they write."""
    out, registry = to

    def write(name: str, writer: Callable[[Path], object], *, key: str | None = None) -> None:
        report_step(f"writing {name}")
        if key is not None:
            files[key] = name
        with replacing_path(out.path_of(name)) as path:
            writer(path)
        out.adopt(name)

    def pictures() -> dict[str, bytes]:
        return {
            name: (out.path / path).read_bytes()
            for name, path in files.items()
            if path.endswith(".png")
        }

    case_text = case_file.read_text(encoding="utf-8")
    out.write_text(CASE_COPY, case_text)
    files["case"] = CASE_COPY

    def scene() -> Mapping[str, Any] | None:
        return stored_scene(out.path) if "scene" in files else None

    return FinishedRun(
        case_text=case_text,
        result=result,
        write=write,
        pictures=pictures,
        scene=scene,
        sections=[
            _blamed_section(section, registry.sources["report_sections"][name])
            for name, section in registry.report_sections.items()
        ],
    )


def _blamed_section(section: ReportSection, source: str) -> ReportSection:
    """A section whose errors name it."""

    def content(result: RunResult) -> list[str | ReportTable]:
        with blaming(f"report section '{section.name}' of {source}"):
            parts = list(section.content(result))
            for part in parts:
                if not isinstance(part, str | ReportTable):
                    kind = type(part).__name__
                    raise PluginError(f"a part of type {kind}, expected str or ReportTable")
            return parts

    return replace(section, content=content)


def _learned(iterations: Sequence[DesignIteration], rho: FloatArray | None) -> Correction:
    """Correction that the explicit analysis of a design taught; none before."""
    if rho is None:
        return Correction()
    corrections = (
        iteration.correction for iteration in iterations if np.array_equal(iteration.rho, rho)
    )
    return next(corrections, Correction())


def _unjudged_lattice(
    out: RunFolder, model: DesignModel, rho: FloatArray, files: dict[str, str]
) -> tuple[SurfaceMesh, tuple[str, ...]]:
    """Surface of a design that no analysis has judged, and warnings."""
    plan, cells = model.plan, model.cells
    density = density_grid(model, rho)
    design = build_design(plan.domain, cells, density)
    thinnest, _ = thinnest_wall(model.homogenised, cells, density)
    case, part = plan.case, plan.part.surface
    surface, islands, _ = case_surface(
        *(case.print, case.lattice, case.run.memory),
        *(part, design, first_step(cells.layout.least, thinnest)),
    )
    write_printed(out, surface, outer_records(case.print, case.part.file, part))
    return surface, (
        *_exported_files(out, plan, surface, design, files),
        *lattice_picture(out, surface, plan.domain, files),
        *islands_words(islands.dropped, islands.dropped_share),
    )


def _exported_files(
    out: RunFolder,
    plan: Plan,
    surface: SurfaceMesh,
    design: LatticeDesign,
    files: dict[str, str],
) -> tuple[str, ...]:
    """The printed surface in every format asked for; the STL, always made, lies there already."""
    files["stl"] = STL_NAME
    others = [file for file in plan.tools.files if file.name != STL_NAME]
    case, part = plan.case, plan.part.surface
    lattice = printed_lattice(
        case.named,
        case.print,
        surface,
        design,
        plan.material,
        part=part,
        file=case.part.file,
    )
    files |= write_lattice_files(out, others, lattice)
    return crossing_warnings(surface)
