"""First guesses of the iteration: displacements of a similar solid and of other load cases."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.system.progress import report_step
from gradedesign.mechanics.finite_cell.elements import Elements
from gradedesign.mechanics.finite_cell.operator import Operator, product
from gradedesign.mechanics.finite_cell.result import FiniteCellResult, solution_of
from gradedesign.mechanics.finite_cell.space import BrickSpace, node_points
from gradedesign.mechanics.finite_cell.stress import displacement_at as displacement_in
from gradedesign.mechanics.finite_cell.surface import element_table, locate

#: Share of the largest singular value below which directions of a combination are dropped. Chosen,
#: not measured.
DEPENDENT = 1e-10


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


def nearest_combination(
    stiffness: Operator,
    keep: NDArray[np.float32],
    right: FloatArray,
    fields: Sequence[FloatArray],
) -> FloatArray | None:
    """Combination of fields that is nearest to the solution of ``K u = right`` in energy.

    Galerkin's method on their span, as `gradedesign.mechanics.solver.galerkin_start` does on
    tetrahedra: a load at an angle between two others is solved by their sum. Returns ``(N, 3)``:
    None without fields.

    ``keep (N, 3)``: 1 for unknowns, 0 for the others. ``right (N, 3)``: zero where nothing is kept.
    ``fields``, each ``(N, 3)``: zero where nothing is kept.
    """
    if not fields:
        return None
    sizes = [max(float(np.linalg.norm(field)), 1e-300) for field in fields]
    pairs = list(zip(fields, sizes, strict=True))
    gram = np.zeros((len(fields), len(fields)))
    for k, field in enumerate(fields):
        image = product(stiffness, field)
        image *= keep
        gram[k] = [np.einsum("nc,nc->", image, v) / s / sizes[k] for v, s in pairs]
    work = [np.einsum("nc,nc->", right, v) / s for v, s in pairs]
    weights = np.linalg.lstsq(gram, np.array(work), rcond=DEPENDENT)[0] / sizes
    guess = np.zeros_like(right)
    for weight, field in zip(weights, fields, strict=True):
        guess += weight * field
    return guess
