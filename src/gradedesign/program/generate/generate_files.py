"""The files of a generated lattice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gradedesign.design.case.generate_schema import GenerateCase
from gradedesign.design.loop.announce import Announcer
from gradedesign.design.resolve.lattice_files import (
    LatticeFile,
    crossing_warnings,
    write_lattice_files,
)
from gradedesign.design.verdict.provenance import stamped
from gradedesign.design.verdict.result import RunResult
from gradedesign.geometry.formats.printed_lattice import PrintedLattice
from gradedesign.geometry.lattice.slab_density import SlabDensities
from gradedesign.geometry.triangles.triangle_cells import CellGrid
from gradedesign.program.outputs.files import RESULT_NAME, write_result
from gradedesign.program.pictures.pictures import picture_lattice
from gradedesign.program.store.run_folder import RunFolder

SLABS_NAME = "slabs.csv"


def write_generated(
    out: RunFolder,
    case: GenerateCase,
    formats: Sequence[LatticeFile],
    lattice: PrintedLattice,
    grid: CellGrid,
    slabs: Sequence[SlabDensities],
    result: RunResult,
    announce: Announcer,
) -> RunResult:
    """Write surface, picture, densities and result.json; return the result with its files.

    The surface was contoured on the grid.
    """
    files = {"slabs": SLABS_NAME, "result": RESULT_NAME}
    with announce.stage("output"):
        files |= write_lattice_files(out, formats, lattice)
        cell = f"{case.lattice.cell}, cells of {case.lattice.size_words}"
        warnings = crossing_warnings(lattice.surface, grid)
        warnings += picture_lattice(
            out.path_of("lattice.png"),
            lattice.surface,
            title=cell,
            opened=any(not skin.net for skin in case.lattice.skin),
        )
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
    result = stamped(out, case, result, [file.name for file in formats])
    write_result(out, result)
    return result


def slab_table(slabs: Sequence[SlabDensities]) -> str:
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


def slab_data(slabs: SlabDensities) -> dict[str, Any]:
    """Plain data of the slabs across one axis."""
    field, surface = slabs.field - slabs.target, slabs.surface - slabs.target
    return {
        "edges_mm": slabs.edges.tolist(),
        "target": slabs.target.tolist(),
        "field": slabs.field.tolist(),
        slabs.measured_on: slabs.surface.tolist(),
        "largest_error_of_field": float(np.abs(field).max()),
        f"largest_error_of_{slabs.measured_on}": float(np.abs(surface).max()),
    }
