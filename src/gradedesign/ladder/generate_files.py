"""The files of a generated lattice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from gradedesign.case.generate_schema import GenerateCase
from gradedesign.ladder.accepted import STL_NAME
from gradedesign.ladder.announce import Announcer
from gradedesign.ladder.files import RESULT_NAME, write_result
from gradedesign.ladder.result import RunResult
from gradedesign.lattice.slab_density import SlabDensities
from gradedesign.mesh.surface_mesh import SurfaceMesh
from gradedesign.output.pictures import picture_lattice
from gradedesign.output.stl import write_stl
from gradedesign.workspace.run_folder import RunFolder

SLABS_NAME = "slabs.csv"


def write_generated(
    out: RunFolder,
    case: GenerateCase,
    surface: SurfaceMesh,
    slabs: Sequence[SlabDensities],
    result: RunResult,
    announce: Announcer,
) -> RunResult:
    """Write surface, picture, densities and result.json; return the result with its files."""
    files = {"slabs": SLABS_NAME, "result": RESULT_NAME}
    with announce.stage("output"):
        if "stl" in case.output.formats:
            write_stl(out.path_of(STL_NAME), surface)
            out.adopt(STL_NAME)
            files["stl"] = STL_NAME
        cell = f"{case.lattice.cell}, cells of {case.lattice.size_words}"
        warnings = picture_lattice(out.path_of("lattice.png"), surface, title=cell)
        if (out.path / "lattice.png").is_file():
            out.adopt("lattice.png")
            files["lattice"] = "lattice.png"
        out.write_text(SLABS_NAME, slab_table(slabs))
    result = replace(
        result,
        folder=out.path,
        files=files,
        warnings=(*result.warnings, *warnings),
        timing_s=announce.timing(),
    )
    write_result(out, result)
    return result


def slab_table(slabs: Sequence[SlabDensities]) -> str:
    """One line per slab, comma separated, units in the header."""
    lines = ["axis,from_mm,to_mm,part_mm3,target,field,surface"]
    for s in slabs:
        for n in range(len(s.target)):
            numbers = (
                *(s.edges[n], s.edges[n + 1], s.part_volume[n]),
                *(s.target[n], s.field[n], s.surface[n]),
            )
            lines.append(",".join(["xyz"[s.axis], *(f"{v:.6g}" for v in numbers)]))
    return "\n".join(lines) + "\n"
