"""First guess of the iteration: the displacements of a similar solid."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.finite_cell.elements import Elements
from gradedesign.finite_cell.result import FiniteCellResult, solution_of
from gradedesign.finite_cell.space import BrickSpace, node_points
from gradedesign.finite_cell.stress import displacement_at as displacement_in
from gradedesign.finite_cell.surface import element_table, locate
from gradedesign.workspace.progress import report_step


def first_guess(
    elements: Elements, space: BrickSpace, start: FiniteCellResult | None, load_case: str
) -> FloatArray | None:
    """Displacement of an earlier result at the nodes; 0 where it had no element."""
    if start is None or load_case not in {s.name for s in start.solutions}:
        return None
    report_step("first guess")
    points = node_points(elements, space)
    # A node lies between elements: look slightly towards the solid of one that it belongs to.
    owner = np.zeros(points.shape[1], np.int64)
    owner[space.nodes] = np.arange(len(space.nodes))[:, None]
    grid = elements.grid
    share = elements.share / elements.share.sum(axis=1, keepdims=True)
    middle = np.full((len(elements.position), 3), 0.5)
    middle[elements.whole :] = (share[:, :, None] * elements.centre).sum(axis=1)
    middle = elements.position + elements.size[:, None] * middle
    solid = grid.lower[:, None] + grid.edges[:, None] * middle[owner].T
    inner = points + 1e-6 * (solid - points)
    element: IntArray = locate(start.elements, element_table(start.elements), inner, solid)
    known = element >= 0
    u = np.zeros((points.shape[1], 3))
    u[known] = displacement_in(
        start.elements, start.space, solution_of(start, load_case).u, element[known],
        points[:, known],
    ).T  # fmt: skip
    return u
