"""Local refinement: elements of twice the edge where the solid's walls allow it."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from gradedesign.arrays import BoolArray, Field, FloatArray
from gradedesign.mechanics.finite_cell.cut_problem import CutProblem
from gradedesign.mechanics.finite_cell.elements import (
    DISCONNECTED_SHARE,
    Elements,
    element_volumes,
    refined_elements,
    refuse_disconnected,
    selected,
    solid_fraction,
)
from gradedesign.mechanics.finite_cell.grid import Grid, Plane, fit_grid
from gradedesign.mechanics.finite_cell.space import BrickSpace, brick_space

log = logging.getLogger(__name__)

#: Rounding of a grading that allows exactly twice the edge.
ROUNDING = 1e-9
#: Blocks whose field is asked for at once. Chosen, not measured.
CHUNK = 2**13


def refined(
    problem: CutProblem, grading: Field, spacing: float, planes: Sequence[Plane]
) -> tuple[Elements, BrickSpace]:
    """Elements of a spacing, mm, and of twice that where the grading allows, and their nodes.

    Raises `LatticeError` if nothing is solid, or the solid falls apart.
    """
    grid = fit_grid(problem.lower, problem.upper, spacing, planes, multiple=2)
    coarse = _coarse_blocks(grading, grid, planes)
    log.info(
        "finite cells of %.4g mm, and of twice that in %.0f %% of the box, where walls are thick",
        float(grid.edges.max()), 100 * coarse.mean(),
    )  # fmt: skip
    elements = refined_elements(problem.field, grid, coarse)
    space = brick_space(elements)
    whole = _largest_bodies(elements, space, problem.bodies)
    if whole is not elements:
        elements, space = whole, brick_space(whole)
    return elements, space


def _coarse_blocks(grading: Field, grid: Grid, planes: Sequence[Plane]) -> BoolArray:
    """Blocks of eight bricks that become one element."""
    shape = tuple(n // 2 for n in grid.shape)
    blocks = np.indices(shape).reshape(3, -1)
    corners = np.stack([*np.ndindex(3, 3, 3)]).T.reshape(3, 1, -1)
    coarse = np.zeros(blocks.shape[1], dtype=bool)
    lower, edges = (v.reshape(3, 1, 1) for v in (grid.lower, grid.edges))
    for k in range(0, blocks.shape[1], CHUNK):
        points: FloatArray = lower + edges * (2 * blocks[:, k : k + CHUNK, None] + corners)
        flat = points.reshape(3, -1)
        allowed = grading(flat).reshape(points.shape[1:])
        coarse[k : k + CHUNK] = (allowed >= 2.0 * (1.0 - ROUNDING)).all(axis=1)
    is_coarse = coarse.reshape(shape)
    for plane in planes:
        place = (plane.place - grid.lower[plane.axis]) / grid.edges[plane.axis]
        # A face that goes through the middle of large elements would cut them.
        if plane not in grid.missed and round(place) % 2:
            np.moveaxis(is_coarse, plane.axis, 0)[round(place) // 2] = False
    return is_coarse


def _largest_bodies(elements: Elements, space: BrickSpace, bodies: int) -> Elements:
    """Elements of the largest components by volume; all if there is one component.

    Raises `DisconnectedError` if the others hold more than `DISCONNECTED_SHARE` of the volume.
    """
    n = len(space.nodes)
    graph = csr_matrix(
        (np.ones(space.nodes.size, np.int8),
         (np.repeat(np.arange(n), 27), n + space.nodes.ravel())),
        shape=(n + len(space.place),) * 2,
    )  # fmt: skip
    count, label = connected_components(graph, directed=False)
    label = label[:n]
    volume = np.bincount(
        label, weights=element_volumes(elements) * solid_fraction(elements), minlength=count
    )
    lost = np.argsort(-volume, kind="stable")[bodies:]
    lost = lost[volume[lost] > 0.0]
    if not len(lost):
        return elements
    share = float(volume[lost].sum() / volume.sum())
    if share > DISCONNECTED_SHARE:
        refuse_disconnected(len(lost), share)
    connected = selected(elements, ~np.isin(label, lost))
    return replace(connected, dropped=len(lost), dropped_share=share)
