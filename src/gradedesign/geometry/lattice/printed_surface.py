"""The surface that is printed, from a design."""

from __future__ import annotations

import logging
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.errors import LatticeError
from gradedesign.geometry.contour._surface_kernels import vertex_shells
from gradedesign.geometry.contour.islands import Islands, remove_islands
from gradedesign.geometry.contour.resolution import CoarseContourError, Resolution
from gradedesign.geometry.contour.surface import require_closed
from gradedesign.geometry.lattice.domain import DesignDomain, grown
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.geometry.lattice.lattice_contour import OVERHANG, finer_step, lattice_contour
from gradedesign.geometry.lattice.solid_layers import solid_layers
from gradedesign.geometry.lattice.trim import (
    SHORTEST,
    trimmed_surface,
    with_skin_edges,
)
from gradedesign.geometry.triangles.chord_tolerance import within_chord
from gradedesign.geometry.triangles.short_edges import used_only, without_short_edges
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
    least_pore: float = 0.0,
) -> PrintedSurface:
    """Closed surface of a lattice in a part, without disconnected components.

    Every cell of it holds the volume of the lattice there within `VOLUME_ERROR`. Raises
    `LatticeError` as `trimmed_surface`, `surface_behind_skin`, `remove_islands` and `within_chord`.
    Raises `ResourceError` if a grid that is fine enough does not fit the memory.

    - ``part``: as for `trimmed_surface`
    - ``step``, mm: grid of the contour with which to begin; it becomes as fine as the volume needs
    - ``chord_tolerance``, mm: fewer triangles within this distance; None: those of the contour
    - ``memory``, bytes: that it may take
    - ``keep_outer``: whether the part's triangles stay as they are, first in the surface, see
      `surface_behind_skin`
    - ``least_pore``, mm: closed pores smaller than a ball of it are filled; a cell that a solid
      member cuts off leaves them, and members that run together
    """
    make = surface_behind_skin if keep_outer else trimmed_surface
    asked = Resolution(within=VOLUME_ERROR, memory=memory)
    raw = None
    while raw is None:
        try:
            raw = make(design, part, step, asked)
        except CoarseContourError as error:
            step = finer_step(design, part, error, asked, keep_outer=keep_outer)
            log.info("%s: %.3g mm instead", error, step)
    report_step("disconnected components of the surface")
    least = max((0.5 * step) ** 3, np.pi / 6.0 * least_pore**3)
    surface, islands = remove_islands(raw, keep=design.domain.bodies, least_pocket=least)
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


#: Grid steps that a skin has at least, and that vertices lie below the part's faces at least:
#: triangles of a contour, which lie within a cube, then reach none of these.
_LEAST_SKIN, LEAST_DEPTH = 2.0, 1.0


def surface_behind_skin(
    design: LatticeDesign, part: SurfaceMesh, step: float, asked: Resolution | None = None
) -> SurfaceMesh:
    """Closed surface of a lattice behind a closed skin: the part's triangles, untouched, first.

    The surface of the cavities is contoured below the skin and appended. As part of the surface of
    the solid its normals point into the cavities. Both surfaces lie apart, so that no Boolean
    operation is needed.

    Returns SurfaceMesh: its first vertices and triangles are those of the part. Raises
    `CoarseContourError`, `ResourceError` as `trimmed_surface`. Raises `LatticeError` if the skin is
    thinner than the grid holds apart from the part's faces, or the internal surface reaches them.

    ``part``: closed and outward oriented; its signed distance is ``design.domain.distance``.
    ``step``, mm: grid of the contour. ``asked``: as for `trimmed_surface`.

    References
    ----------
    D. Raymont, thesis, University of Exeter, section 5.2: the internal architecture route.
    """
    require_thick_skin(design.domain, _LEAST_SKIN * step, f"two steps of its grid of {step:.3g} mm")
    raw, field = lattice_contour(design, part, step, asked, keep_outer=True)
    domain = grown(design.domain, OVERHANG * step)
    vertices, faces = raw.vertices, _internal(raw.vertices, raw.near, domain, step)
    del raw
    if len(faces):
        report_step("inner edges of skins")
        vertices, faces = with_skin_edges(vertices, faces, domain, field, step)
    report_step("collapsing short edges")
    internal = used_only(vertices, without_short_edges(vertices, faces, SHORTEST * step))
    surface = appended(part, internal)
    require_closed(surface)
    log.info("%d triangles of the part, %d internal ones", len(part.faces), len(internal.faces))
    return surface


def appended(part: SurfaceMesh, internal: SurfaceMesh) -> SurfaceMesh:
    """Both surfaces in one, the part's vertices and triangles first."""
    return SurfaceMesh(
        vertices=np.concatenate([part.vertices, internal.vertices]),
        faces=np.concatenate([part.faces, internal.faces + len(part.vertices)]),
    )


def internal_of(surface: SurfaceMesh, part: SurfaceMesh) -> SurfaceMesh:
    """Triangles of inner surfaces, to be appended to those of the part.

    Raises LatticeError if the surface does not begin with them.
    """
    count = len(part.faces)
    first = surface.faces[:count]
    if len(first) < count or not np.array_equal(surface.vertices[first], part.vertices[part.faces]):
        raise LatticeError(
            "a body or a cavity of the part is smaller than a piece of lattice or than a grid step "
            'and was dropped with those; take [print] outer = "cut"'
        )
    return used_only(surface.vertices, surface.faces[count:])


def require_thick_skin(domain: DesignDomain, least: float, why: str) -> None:
    """Refuse skins all round that keep the internal surface too near the part's faces.

    Raises `LatticeError`.
    """
    thickness = max((s.least for s in domain.solids if s.all_round), default=0.0)
    if thickness < least:
        raise LatticeError(
            f"a skin of {thickness:.3g} mm keeps the internal surface too near the part's "
            f"triangles, which [print] outer keeps: expected at least {least:.3g} mm, {why}; "
            f'state a thicker skin, in `run` more elements_per_wall, or outer = "cut"'
        )


def _internal(
    vertices: FloatArray, faces: NDArray[np.int32], domain: DesignDomain, step: float
) -> NDArray[np.int32]:
    """Triangles of the shells inside the part; the others lie beyond its faces.

    ``domain`` is grown by the overhang.
    """
    part = solid_layers(domain, 3 * step)[0]
    height = part(vertices.T) + OVERHANG * step
    shell = vertex_shells(faces.astype(np.int64), len(vertices))
    count = int(shell.max()) + 1
    highest, lowest = np.full(count, -np.inf), np.full(count, np.inf)
    np.maximum.at(highest, shell, height)
    np.minimum.at(lowest, shell, height)
    inside = highest <= -LEAST_DEPTH * step
    mixed = ~inside & (lowest <= 0)
    if mixed.any():
        at = vertices[np.argmax(np.where(mixed[shell], height, -np.inf))]
        raise LatticeError(
            f"the internal surface reaches the part's faces at "
            f"({', '.join(f'{c:.4g}' for c in at)}) mm, whose triangles [print] outer keeps: "
            f'expected a skin all round; state a thicker one or outer = "cut"'
        )
    return faces[inside[shell[faces[:, 0]]]]
