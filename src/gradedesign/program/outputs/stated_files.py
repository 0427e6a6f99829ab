"""The files of a generated lattice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from gradedesign.design.loop.announce import Announcer
from gradedesign.design.loop.stated_print import StatedPrint
from gradedesign.design.resolve.lattice_files import crossing_warnings
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.stated_lattice import StatedLattice
from gradedesign.design.verdict.result import RunResult
from gradedesign.geometry.lattice.slab_density import SlabDensities
from gradedesign.program.outputs.files import (
    RESULT_NAME,
    finished_run,
    stated_outputs,
    write_result,
)
from gradedesign.program.outputs.printed_files import write_lattice_files
from gradedesign.program.outputs.provenance import stamped
from gradedesign.program.pictures.pictures import picture_lattice
from gradedesign.program.store.run_folder import RunFolder

_SLABS_NAME = "slabs.csv"


def write_stated(
    to: tuple[RunFolder, Registry, Announcer],
    stated: StatedLattice,
    made: StatedPrint,
    result: RunResult,
) -> RunResult:
    """Write a lattice and its densities, the outputs and result.json; return the result."""
    (out, registry, announce), case, formats = to, stated.case, stated.formats
    files = {"slabs": _SLABS_NAME, "result": RESULT_NAME}
    warnings = list(result.warnings)
    with announce.stage("output"):
        files |= write_lattice_files(out, formats, made.lattice)
        if made.surface is not None:
            warnings += crossing_warnings(made.lattice.surface)
            warnings += picture_lattice(
                out.path_of("lattice.png"),
                made.lattice.surface,
                title=f"{case.lattice.cell}, cells of {case.lattice.size_words}",
                opened=stated.design.domain.closed,
            )
        if (out.path / "lattice.png").is_file():
            out.adopt("lattice.png")
            files["lattice"] = "lattice.png"
        out.write_text(_SLABS_NAME, _slab_table(made.slabs))
    result = stamped(out, case.part, result, [file.name for file in formats])

    def current() -> RunResult:
        return replace(
            result,
            folder=out.path,
            files=files,
            warnings=tuple(warnings),
            timing_s=announce.timing(),
        )

    run = finished_run(out, case.path, files, current)
    for output in stated_outputs(case.output.formats, registry):
        warnings += output.write(run)
    result = current()
    write_result(out, result)
    return result


def _slab_table(slabs: Sequence[SlabDensities]) -> str:
    """One line per slab, comma separated, units in the header."""
    lines = [f"axis,from_mm,to_mm,part_mm3,target,field,{slabs[0].measured_on}"]
    for s in slabs:
        for n in range(len(s.target)):
            numbers = (
                *(s.edges[n], s.edges[n + 1], s.part_volume[n]),
                *(s.target[n], s.field[n], s.surface[n]),
            )
            lines.append(",".join(["xyz"[s.axis], *(f"{v:.6g}" for v in numbers)]))
    return "\n".join(lines) + "\n"
