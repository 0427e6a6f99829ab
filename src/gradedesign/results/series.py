"""The densities of every iteration as a series of VTU files that one PVD file names."""

from __future__ import annotations

from collections.abc import Sequence
from xml.sax.saxutils import quoteattr

from gradedesign.loop.iteration import DesignIteration
from gradedesign.output.vtu import write_vtu
from gradedesign.resolve.problem import Problem
from gradedesign.workspace.progress import report_step
from gradedesign.workspace.run_folder import RunFolder

SERIES_NAME = "iterations.pvd"


def write_series(
    out: RunFolder, problem: Problem, iterations: Sequence[DesignIteration], files: dict[str, str]
) -> None:
    """Write ``iterations.pvd`` and the file of every iteration; its time is the iteration."""
    report_step(f"writing {SERIES_NAME}")
    lines = []
    for done in iterations:
        number = done.summary.number
        name = f"iterations/iteration_{number:02d}.vtu"
        write_vtu(
            out.path_of(name),
            problem.space.mesh,
            cell_data={
                "relative_density [-]": done.rho,
                "solid_volume_fraction [-]": problem.solid_fraction,
            },
        )
        out.adopt(name)
        lines.append(f'<DataSet timestep="{number}" group="" part="0" file={quoteattr(name)}/>\n')
    out.write_text(
        SERIES_NAME,
        '<?xml version="1.0"?>\n'
        '<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">\n'
        f"<Collection>\n{''.join(lines)}</Collection>\n</VTKFile>\n",
    )
    files["iterations_pvd"] = SERIES_NAME
