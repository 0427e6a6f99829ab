"""Displacement and stress of the fully solid part as VTU."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gradedesign.fe.solution import Solution
from gradedesign.fe.stress import von_mises
from gradedesign.output.vtu import write_vtu
from gradedesign.resolve.problem import Problem
from gradedesign.resolve.solid_stress import solid_field
from gradedesign.workspace.progress import report_step
from gradedesign.workspace.run_folder import RunFolder


def write_solid_vtu(
    out: RunFolder, problem: Problem, solid: Sequence[Solution], files: dict[str, str]
) -> None:
    """Write ``solid.vtu`` where the case asks for fields."""
    if "vtu" not in problem.case.output.formats:
        return
    data: dict[str, Any] = {}
    for load, solution in zip(problem.loads, solid, strict=True):
        data[f"displacement {solution.name} [mm]"] = solution.displacement
        stress = von_mises(solid_field(problem, load, solution).nodal)
        data[f"von_mises {solution.name} [MPa]"] = stress
    report_step("writing solid.vtu")
    files["solid_vtu"] = "solid.vtu"
    write_vtu(
        out.path_of("solid.vtu"),
        (problem.space.nodes, problem.space.elements.astype(np.int64)),
        point_data=data,
    )
    out.adopt("solid.vtu")
