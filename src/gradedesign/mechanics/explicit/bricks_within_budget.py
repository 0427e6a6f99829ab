"""Finite cells of a printed solid on the first grid that keeps the solid and fits the memory."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import report_step, stepping
from gradedesign.errors import DisconnectedError, LatticeError, ResourceError
from gradedesign.geometry.lattice.lattice import lattice_field
from gradedesign.mechanics.explicit.analysis import Resolution
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid
from gradedesign.mechanics.fe.modes import mode_room
from gradedesign.mechanics.finite_cell.analysis import brick_grid, divide
from gradedesign.mechanics.finite_cell.cut_problem import CutProblem, require_regions
from gradedesign.mechanics.finite_cell.elements import Elements, solid_volume
from gradedesign.mechanics.finite_cell.grid import Plane
from gradedesign.mechanics.finite_cell.space import BrickSpace, unknown_count
from gradedesign.mechanics.solver.lowest_modes import GUARD

log = logging.getLogger(__name__)

#: Memory, bytes: of the program, of each unknown, and of each brick of the box while the field is
#: sampled. Measured without the sample points, 0.25 GB for the program: 280 at density 0.3, eight
#: bricks to a cell; at 0.15, where most elements hold less solid than void, 475 on 9.2 M unknowns
#: and 615 on 0.8 M, whose peak this predicts 8 % too low.
BASE_BYTES, BYTES_PER_UNKNOWN, _BYTES_PER_BRICK = 300_000_000, 480, 100
#: Memory of each unknown for each mode of an iteration, bytes: three vectors with their products,
#: and the sums that replace them. Measured 167 and 180 for three and five modes, 0.31 M unknowns.
_BYTES_PER_MODE = 180
#: The next spacing where bricks lost volume or components, and the volume they may lose. Chosen,
#: not measured.
FINER, VOLUME_TOLERANCE = 0.8, 0.04
#: What keeps this share on finer bricks is no fault of the grid. Chosen, not measured.
_SAME_LOSS = 0.8
#: Points at which the volume of the field is counted, and the seed of their places. Chosen, not
#: measured.
_VOLUME_POINTS, _VOLUME_SEED = 500_000, 2007


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DividedSolid:
    """Elements of a printed solid that are to be solved."""

    problem: CutProblem
    elements: Elements
    space: BrickSpace
    requested: float  #: mm. Spacing before it was fitted to the part.
    refused: tuple[str, ...]  #: Faults of the spacings that were tried first.


def _design_problem(solid: PrintedSolid, spacing: float, *, graded: bool = False) -> CutProblem:
    """The solid of a design, or its `PrintedSolid.field`, with the loads and supports of its case.

    ``spacing``, mm, is that of the elements: distances of the part are exact within it. Of a graded
    problem the elements are twice as large where walls are thick.
    """
    domain = solid.design.domain
    return CutProblem(
        field=solid.field or lattice_field(solid.design, band=2.0 * spacing if graded else spacing),
        lower=domain.lower,
        upper=domain.upper,
        cases=solid.load_cases,
        regions=solid.regions,
        material=solid.material,
        planes=tuple(Plane(**plane._asdict()) for body in domain.solids for plane in body.planes),
        bodies=domain.bodies,
        grading=solid.grading if graded else None,
        goals=solid.goals,
        modes=solid.modes,
    )


def divided_within_budget(
    solid: PrintedSolid, resolution: Resolution, say: Callable[[str], None]
) -> DividedSolid:
    """Elements of the first spacing that holds the solid and fits the memory.

    Where the memory does not hold a spacing everywhere, elements are first made twice as large
    where the design has thick walls, then all of them larger. Without a coarsest spacing the one
    asked for is taken everywhere or refused: analyses that are compared divide the solid alike.
    """
    spacing, memory = resolution.spacing, solid.memory
    refused: list[str] = []
    lost_before, graded = 0.0, False

    def refuse(message: str) -> None:
        refused.append(message)
        log.info("%s", message)
        say(message)

    while True:
        problem = _design_problem(solid, spacing, graded=graded)
        require_regions(problem)
        _require_room(problem, spacing, memory)
        tried = _tried(problem, spacing, solid.volume)
        if not isinstance(tried, _Lost):
            elements, space = tried
            unknowns = unknown_count(space)
            need = predict_memory(unknowns, mode_room(solid.modes.values()))
            if need <= memory:
                return DividedSolid(
                    problem=problem,
                    elements=elements,
                    space=space,
                    requested=spacing,
                    refused=tuple(refused),
                )
            # Unknowns fall at least with the square of the spacing: those of a surface.
            step = 1.02 * (need / memory) ** (1 / 2)
            words = (
                f"finite cells of {spacing:.3g} mm have {unknowns / 1e6:.3g} M unknowns and need "
                f"{need / 1e9:.3g} GB, more than [run] memory {memory / 1e9:.3g} GB"
            )
            if resolution.coarsest is not None and solid.grading is not None and not graded:
                graded = True
                refuse(f"{words}; taking twice that where walls are thick")
                continue
            if resolution.coarsest is None or lost_before or spacing * step > resolution.coarsest:
                raise ResourceError(
                    f"{words}; allow more memory, raise the lower density, or use larger cells "
                    f"({spacing * step:.3g} mm would fit)"
                )
            spacing *= step
            refuse(f"{words}; taking {spacing:.3g} mm")
            continue
        if resolution.coarsest is None:
            raise tried.error
        if tried.share > _SAME_LOSS * lost_before > 0.0:
            tried.error.args = (
                f"{tried.error} (coarser ones lost as much: it is the design, not its grid; raise "
                f"the lower density, enlarge the cells, or add a skin)",
            )
            raise tried.error
        lost_before = tried.share
        spacing *= FINER
        refuse(f"{tried.error}; refined to {spacing:.3g} mm")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Lost:
    """Elements that lose too much of the solid."""

    share: float  #: Of the solid.
    error: LatticeError


def _tried(
    problem: CutProblem, spacing: float, enclosed: float | None
) -> tuple[Elements, BrickSpace] | _Lost:
    """Elements of a spacing and their space, unless they lose too much of the solid.

    Elements that hold what a surface encloses are right; where they do not, its triangles may
    overlap, and the volume of the field is counted.
    """
    try:
        with stepping(f"finite cells of {spacing:.3g} mm"):
            elements, space = divide(problem, spacing)
    except DisconnectedError as error:
        return _Lost(share=error.share, error=error)
    held, kept = solid_volume(elements), 1.0 - elements.dropped_share
    if enclosed is not None and abs(held / (enclosed * kept) - 1.0) <= VOLUME_TOLERANCE:
        return elements, space
    report_step("volume of the solid")
    volume = _sampled_volume(problem)
    off = held / (volume * kept) - 1.0
    if abs(off) <= VOLUME_TOLERANCE:
        return elements, space
    why = (
        f"finite cells of {spacing:.3g} mm hold {held:.6g} mm^3, the field {volume:.6g} mm^3 "
        f"({off:+.1%}, allowed {VOLUME_TOLERANCE:.0%}): they are too coarse for the walls"
    )
    return _Lost(share=abs(off), error=LatticeError(why))


def _sampled_volume(problem: CutProblem) -> float:
    """Volume of the solid, mm^3, by points in random places of an even grid of the box."""
    extent = problem.upper - problem.lower
    step = float((extent.prod() / _VOLUME_POINTS) ** (1 / 3))
    count = np.maximum(np.ceil(extent / step), 1).astype(int)
    random = np.random.default_rng(_VOLUME_SEED)
    inside = 0
    y, z = np.meshgrid(np.arange(count[1]), np.arange(count[2]), indexing="ij")
    for i in range(count[0]):
        corner: FloatArray = np.stack([np.full(y.shape, i), y, z]).astype(np.float64)
        places = (corner + random.random(corner.shape)) / count[:, None, None]
        points = problem.lower[:, None, None] + extent[:, None, None] * places
        inside += int(np.count_nonzero(problem.field(points) < 0.0))
    return float(inside * extent.prod() / count.prod())


def _require_room(problem: CutProblem, spacing: float, memory: float) -> None:
    """Refuse a grid whose samples alone do not fit the memory."""
    bricks = float(np.prod(brick_grid(problem, spacing).shape, dtype=np.float64))
    need = BASE_BYTES + _BYTES_PER_BRICK * bricks
    if need > memory:
        raise ResourceError(
            f"a grid of {bricks:.3g} finite cells of {spacing:.3g} mm needs {need / 1e9:.3g} GB "
            f"before it is solved, but [run] memory is {memory / 1e9:.3g} GB; allow more memory, "
            f"raise the lower density, or use larger cells"
        )


def predict_memory(unknowns: float, modes: int = 0) -> int:
    """Peak memory of an analysis that finds so many natural frequencies, bytes."""
    block = _BYTES_PER_MODE * (modes + GUARD) if modes else 0
    return int(BASE_BYTES + (BYTES_PER_UNKNOWN + block) * unknowns)
