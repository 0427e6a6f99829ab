"""Finite cells as an explicit analysis: of a lattice design, or of any field in its place."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.cell.cell import Cell
from gradedesign.errors import LatticeError, ResourceError
from gradedesign.finite_cell.analysis import brick_grid, divide, solve_divided
from gradedesign.finite_cell.elements import Elements, LoosePiecesError, solid_volume
from gradedesign.finite_cell.grid import Plane
from gradedesign.finite_cell.problem import Problem, require_regions
from gradedesign.finite_cell.space import BrickSpace
from gradedesign.finite_cell.stress import solid_points
from gradedesign.lattice.lattice import lattice_field
from gradedesign.verify.analysis import (
    AnalysisEstimate,
    Discretisation,
    ExplicitAnalysis,
    PlannedSolid,
    Resolution,
)
from gradedesign.verify.finite_cell_fields import FiniteCellFields
from gradedesign.verify.grid_resolution import LAYER_ELEMENTS
from gradedesign.verify.grid_resolution import elements_per_wall as tets_per_wall
from gradedesign.verify.printed_solid import PrintedSolid
from gradedesign.verify.tets import TETS_PER_GRID_CELL
from gradedesign.workspace.progress import report_step, stepping

log = logging.getLogger(__name__)

#: Grid of tetrahedra that resolves the same walls, over the edge of a brick. Quadratic finite
#: cells of 1.4 walls displace a gyroid sheet within 2 % (8 bricks a cell at density 0.3), where
#: stuffing takes cubes of 0.8 walls; what holds a strut by stuffing does so here, too.
SURFACE_PER_BRICK = 0.56
#: Order of the error of displacement and work in the spacing: the least, the usual and the most
#: that was observed; less than 1 where plates meet sheets in re-entrant edges and one cell is
#: across.
ORDERS = (0.75, 1.5, 3.0)
#: Bricks that hold solid per solid volume of a brick, and unknowns of each: measured 2.7 and 28 to
#: 30 on gyroid sheets of 1.4 walls a brick; solid layers have fewer.
BRICKS_PER_SOLID, UNKNOWNS_PER_BRICK = 2.7, 29.0
#: Memory, bytes: of the program, of each unknown, and of each brick of the box while the field is
#: sampled. Measured 0.25 GB and 385 on 0.1 to 1.2 M unknowns, without the sample points.
BASE_BYTES, BYTES_PER_UNKNOWN, BYTES_PER_BRICK = 300_000_000, 480, 100
#: Seconds for each brick of the box (sampling its field) and each unknown (the first load case) on
#: two idle cores, and what a further load case adds as a share of the latter: set-up is shared.
BRICK_S, UNKNOWN_S, MORE_CASES = 1e-4, 1.8e-5, 0.7
#: Largest spacing over the one that walls ask for, where that does not fit the memory.
COARSEST = 1.25
#: The next spacing where bricks lost volume or pieces, and the volume they may lose.
FINER, VOLUME_TOLERANCE = 0.8, 0.04
#: What keeps this share on finer bricks is no fault of the grid.
SAME_LOSS = 0.8
#: Points at which the volume of the field is counted, and the seed of their places.
VOLUME_POINTS, VOLUME_SEED = 500_000, 2007


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DividedSolid:
    """Elements of a printed solid that are to be solved.

    Attributes
    ----------
    problem : Problem
    elements : Elements
    space : BrickSpace
    requested : float, mm
        Spacing before it was fitted to the part.
    refused : tuple of str
        What was wrong with the spacings that were tried first.
    """

    problem: Problem
    elements: Elements
    space: BrickSpace
    requested: float
    refused: tuple[str, ...]


def design_problem(solid: PrintedSolid, spacing: float) -> Problem:
    """The solid of a design, or its `PrintedSolid.field`, with the loads and supports of its case.

    ``spacing``, mm, is that of the elements: distances of the part are exact within it.
    """
    domain = solid.design.domain
    return Problem(
        field=solid.field or lattice_field(solid.design, band=spacing),
        lower=domain.lower,
        upper=domain.upper,
        cases=solid.case.load_case,
        regions=solid.regions,
        material=solid.material,
        planes=passive_planes(solid),
        bodies=domain.bodies,
    )


def passive_planes(solid: PrintedSolid) -> tuple[Plane, ...]:
    """Inner faces of passive solids along plane regions across an axis."""
    planes = []
    for keep in solid.case.keep:
        region = solid.regions.get(keep.region)
        if region is None or keep.margin <= 0.0:
            continue
        corners = region.corners.reshape(-1, 3)
        axis = int(np.argmin(np.ptp(corners, axis=0)))
        if np.ptp(corners[:, axis]) > 1e-9 * np.ptp(corners, axis=0).max():
            continue
        inward = -np.sign(np.cross(*(region.corners[0, 1:] - region.corners[0, 0]))[axis])
        place = float(corners[0, axis] + inward * keep.margin)
        planes.append(Plane(axis=axis, place=place, area=region.area))
    return tuple(planes)


def solve_finite_cells(
    solid: PrintedSolid, resolution: Resolution, say: Callable[[str], None]
) -> FiniteCellFields:
    """Divide a printed solid into finite cells and solve every load case on them.

    Raises
    ------
    ResourceError
        If no spacing that holds the solid fits the memory of the case.
    LatticeError
        If the solid falls apart or is not resolved, or a loaded or supported region carries none.
    SolverError
        If supports leave rigid motions free, or the iteration does not converge.
    """
    began = perf_counter()
    divided = divided_within_budget(solid, resolution, say)
    problem, elements = divided.problem, divided.elements
    seconds = perf_counter() - began
    result = solve_divided(problem, elements, divided.space)
    for note in result.notes:
        log.info("%s", note)
    surface_size = SURFACE_PER_BRICK * result.spacing
    return FiniteCellFields(
        result=result,
        field=problem.field,
        division=Discretisation(
            made_by="finite cells",
            mesh_size=result.spacing,
            surface_size=surface_size,
            surface_tets=TETS_PER_GRID_CELL * result.volume / surface_size**3,
            unknowns=result.unknowns,
            requested=divided.requested,
            refused=divided.refused,
            dropped_pieces=elements.dropped,
            seconds=seconds,
        ),
        at=solid_points(elements),
        bodies=problem.bodies,
    )


def divided_within_budget(
    solid: PrintedSolid, resolution: Resolution, say: Callable[[str], None]
) -> DividedSolid:
    """Elements of the first spacing that holds the solid and fits the memory.

    Without a coarsest spacing the one asked for is taken or refused.
    """
    spacing, memory = resolution.spacing, solid.case.run.memory
    refused: list[str] = []
    lost_before = 0.0

    def refuse(message: str) -> None:
        refused.append(message)
        log.info("%s", message)
        say(message)

    while True:
        problem = design_problem(solid, spacing)
        require_regions(problem)
        _require_room(problem, spacing, memory)
        lost, why, divided = _tried(problem, spacing)
        if divided is not None:
            unknowns = 3 * len(divided[1].place)
            need = predict_memory(unknowns)
            if need <= memory:
                return DividedSolid(
                    problem=problem,
                    elements=divided[0],
                    space=divided[1],
                    requested=spacing,
                    refused=tuple(refused),
                )
            step = 1.02 * (need / memory) ** (1 / 3)
            words = (
                f"finite cells of {spacing:.3g} mm have {unknowns / 1e6:.3g} M unknowns and need "
                f"{need / 1e9:.3g} GB, more than [run] memory {memory / 1e9:.3g} GB"
            )
            if resolution.coarsest is None or lost_before or spacing * step > resolution.coarsest:
                raise ResourceError(
                    f"{words}; allow more memory, raise the lower density, or use larger cells "
                    f"({spacing * step:.3g} mm would fit)"
                )
            spacing *= step
            refuse(f"{words}; taking {spacing:.3g} mm")
            continue
        if resolution.coarsest is None:
            raise LatticeError(why)
        if lost > SAME_LOSS * lost_before > 0.0:
            raise LatticeError(
                f"{why} (coarser ones lost as much: it is the design, not its grid; raise the "
                f"lower density, enlarge the cells, or add a skin)"
            )
        lost_before = lost
        spacing *= FINER
        refuse(f"{why}; refined to {spacing:.3g} mm")


def _tried(
    problem: Problem, spacing: float
) -> tuple[float, str, tuple[Elements, BrickSpace] | None]:
    """Share of the solid that elements lose, in words, and the elements if it is little."""
    try:
        with stepping(f"finite cells of {spacing:.3g} mm"):
            elements, space = divide(problem, spacing)
    except LoosePiecesError as error:
        return error.share, str(error), None
    report_step("volume of the solid")
    held, volume = solid_volume(elements), sampled_volume(problem)
    off = held / (volume * (1.0 - elements.dropped_share)) - 1.0
    if abs(off) <= VOLUME_TOLERANCE:
        return 0.0, "", (elements, space)
    why = (
        f"finite cells of {spacing:.3g} mm hold {held:.6g} mm^3, the field {volume:.6g} mm^3 "
        f"({off:+.1%}, allowed {VOLUME_TOLERANCE:.0%}): they are too coarse for the walls"
    )
    return abs(off), why, None


def sampled_volume(problem: Problem) -> float:
    """Volume of the solid, mm^3, by points in random places of an even grid of the box."""
    extent = problem.upper - problem.lower
    step = float((extent.prod() / VOLUME_POINTS) ** (1 / 3))
    count = np.maximum(np.ceil(extent / step), 1).astype(int)
    random = np.random.default_rng(VOLUME_SEED)
    inside = 0
    y, z = np.meshgrid(np.arange(count[1]), np.arange(count[2]), indexing="ij")
    for i in range(count[0]):
        corner: FloatArray = np.stack([np.full(y.shape, i), y, z]).astype(np.float64)
        places = (corner + random.random(corner.shape)) / count[:, None, None]
        points = problem.lower[:, None, None] + extent[:, None, None] * places
        inside += int(np.count_nonzero(problem.field(points) < 0.0))
    return float(inside * extent.prod() / count.prod())


def _require_room(problem: Problem, spacing: float, memory: float) -> None:
    """Refuse a grid whose samples alone do not fit the memory."""
    bricks = float(np.prod(brick_grid(problem, spacing).shape, dtype=np.float64))
    need = BASE_BYTES + BYTES_PER_BRICK * bricks
    if need > memory:
        raise ResourceError(
            f"a grid of {bricks:.3g} finite cells of {spacing:.3g} mm needs {need / 1e9:.3g} GB "
            f"before it is solved, but [run] memory is {memory / 1e9:.3g} GB; allow more memory, "
            f"raise the lower density, or use larger cells"
        )


def predict_memory(unknowns: float) -> int:
    """Peak memory of an analysis, bytes."""
    return int(BASE_BYTES + BYTES_PER_UNKNOWN * unknowns)


def estimate(planned: PlannedSolid, spacing: float) -> AnalysisEstimate:
    """Size of the analysis on bricks of a spacing, mm."""
    bricks = float(np.ceil(np.asarray(planned.box) / spacing).prod())
    active = BRICKS_PER_SOLID * planned.volume / spacing**3
    unknowns = int(UNKNOWNS_PER_BRICK * (min(active, bricks) if bricks else active))
    surface_tets = TETS_PER_GRID_CELL * planned.volume / (SURFACE_PER_BRICK * spacing) ** 3
    return AnalysisEstimate(
        unknowns=unknowns,
        memory_bytes=predict_memory(unknowns),
        mesh_s=BRICK_S * bricks,
        solve_s=UNKNOWN_S * unknowns * (1.0 + MORE_CASES * (planned.load_cases - 1)),
        surface_tets=surface_tets,
    )


def fitted_spacing(planned: PlannedSolid, spacing: float, memory_bytes: float) -> float:
    """Longest edge that bricks have, mm: one that the memory holds and that divides the box."""
    need = estimate(planned, spacing).unknowns * BYTES_PER_UNKNOWN
    room = max(memory_bytes - BASE_BYTES, 1.0)
    step = (need / room) ** (1 / 3)
    if 1.0 < step <= COARSEST:
        spacing *= step
    box = np.asarray(planned.box)
    return float((box / np.ceil(box / spacing * (1.0 - 1e-9))).max())


def elements_per_wall(cell: Cell, rho: float) -> float:
    """Bricks across the thinnest wall or strut of a cell for 2 % in displacement."""
    return SURFACE_PER_BRICK * tets_per_wall(cell, rho)


#: Quadratic finite cells, ``[run] analysis = "finite-cells"``.
FINITE_CELLS = ExplicitAnalysis(
    name="finite-cells",
    solve=solve_finite_cells,
    estimate=estimate,
    fitted_spacing=fitted_spacing,
    elements_per_wall=elements_per_wall,
    elements_per_layer=SURFACE_PER_BRICK * LAYER_ELEMENTS,
    coarsest=COARSEST,
)
