"""The surface that is printed, from a design."""

from __future__ import annotations

import logging
from typing import NamedTuple

from gradedesign.common.system.progress import report_step
from gradedesign.geometry.contour.islands import Islands, remove_islands
from gradedesign.geometry.contour.resolution import CoarseContourError, Resolution
from gradedesign.geometry.lattice.internal_surface import (
    LEAST_DEPTH,
    appended,
    internal_of,
    require_thick_skin,
    surface_behind_skin,
)
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.geometry.lattice.trim import trimmed_surface
from gradedesign.geometry.triangles.chord_tolerance import within_chord
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

#: Most that the surface of a cell may hold more or less than its solid, by estimate: a density is
#: stated to two figures.
VOLUME_ERROR = 0.01

log = logging.getLogger(__name__)


#: Steps with which a grid begins: along a cell, and across its thinnest wall, at least; and along a
#: cell at most, for the necks of networks, whose volume counts little, may be as thin as nothing.
_STEPS_PER_CELL, STEPS_PER_WALL, MOST_STEPS_PER_CELL = 24.0, 1.5, 96.0


class PrintedSurface(NamedTuple):
    """A printed surface, what was removed from it, and the grid of its contour in mm."""

    surface: SurfaceMesh
    islands: Islands
    step: float


def first_step(cell_size: float, wall: float) -> float:
    """Grid with which the contour of cells of a size and a thinnest wall begins, all in mm."""
    step = min(cell_size / _STEPS_PER_CELL, wall / STEPS_PER_WALL)
    return max(step, cell_size / MOST_STEPS_PER_CELL)


def printed_surface(
    design: LatticeDesign,
    part: SurfaceMesh,
    step: float,
    chord_tolerance: float | None,
    *,
    memory: float,
    keep_outer: bool = False,
) -> PrintedSurface:
    """Closed surface of a lattice in a part, without disconnected components.

    Every cell of it holds the volume of the lattice there within `VOLUME_ERROR`.

    Parameters
    ----------
    part : SurfaceMesh
        As for `trimmed_surface`.
    step : float, mm
        Grid of the contour with which to begin; it becomes as fine as the volume needs.
    chord_tolerance : float or None, mm
        Fewer triangles within this distance; None: those of the contour.
    memory : float, bytes
        That it may take.
    keep_outer : bool
        Whether the part's triangles stay as they are, first in the surface, see
        `surface_behind_skin`.

    Raises
    ------
    LatticeError
        As `trimmed_surface`, `surface_behind_skin`, `remove_islands` and `within_chord`.
    ResourceError
        If a grid that is fine enough does not fit the memory.
    """
    make = surface_behind_skin if keep_outer else trimmed_surface
    asked = Resolution(within=VOLUME_ERROR, memory=memory)
    raw = None
    while raw is None:
        try:
            raw = make(design, part, step, asked)
        except CoarseContourError as error:
            log.info("%s: %.3g mm instead", error, error.finer)
            step = error.finer
    report_step("disconnected components of the surface")
    surface, islands = remove_islands(
        raw, keep=design.domain.bodies, least_pocket=(0.5 * step) ** 3
    )
    del raw
    if keep_outer:
        internal = internal_of(surface, part)
        if chord_tolerance is not None and len(internal.faces):
            least = LEAST_DEPTH * step + chord_tolerance
            require_thick_skin(design.domain, least, "a grid step and the chord tolerance")
            internal = within_chord(internal, chord_tolerance)
        return PrintedSurface(appended(part, internal), islands, step)
    if chord_tolerance is not None:
        surface = within_chord(surface, chord_tolerance)
    return PrintedSurface(surface, islands, step)
