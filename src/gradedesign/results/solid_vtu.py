"""Displacement and stress of the fully solid part as VTU."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gradedesign.fe.solution import Solution
from gradedesign.fe.stress import element_stress, von_mises
from gradedesign.output.vtu import write_vtu
from gradedesign.resolve.problem import Problem
from gradedesign.resolve.solid import solid_stiffness
from gradedesign.workspace.progress import report_step
from gradedesign.workspace.run_folder import RunFolder


def write_solid_vtu(
    out: RunFolder, problem: Problem, solid: Sequence[Solution], files: dict[str, str]
) -> None:
    """Write ``solid.vtu`` where the case asks for fields."""
    if "vtu" not in problem.case.output.formats:
        return
    stiffness = solid_stiffness(problem)
    data: dict[str, Any] = {}
    for solution in solid:
        data[f"displacement {solution.name} [mm]"] = solution.displacement
    cells = {
        f"von_mises {s.name} [MPa]": von_mises(
            element_stress(problem.space, stiffness, s.displacement)
        ).mean(axis=1)
        for s in solid
    }
    report_step("writing solid.vtu")
    files["solid_vtu"] = "solid.vtu"
    write_vtu(
        out.path_of("solid.vtu"),
        (problem.space.nodes, problem.space.elements.astype(np.int64)),
        point_data=data,
        cell_data=cells,
    )
    out.adopt("solid.vtu")
