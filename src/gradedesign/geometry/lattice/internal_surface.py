"""The part's own triangles with the internal surface of a lattice behind a closed skin."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import report_step, stepping
from gradedesign.errors import LatticeError
from gradedesign.geometry.contour._surface_kernels import vertex_shells
from gradedesign.geometry.contour.resolution import Resolution, require_volume
from gradedesign.geometry.contour.surface import contour, require_closed
from gradedesign.geometry.lattice.domain import DesignDomain, grown
from gradedesign.geometry.lattice.lattice import LatticeDesign, lattice_field
from gradedesign.geometry.lattice.solid_layers import solid_layers
from gradedesign.geometry.lattice.trim import (
    OVERHANG,
    SHORTEST,
    contour_grid,
    volume_fit,
    with_skin_edges,
)
from gradedesign.geometry.triangles.short_edges import used_only, without_short_edges
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

log = logging.getLogger(__name__)

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

    Parameters
    ----------
    part : SurfaceMesh
        Closed and outward oriented; its signed distance is ``design.domain.distance``.
    step : float, mm
        Grid of the contour.
    asked : Resolution, optional
        As for `trimmed_surface`.

    Returns
    -------
    SurfaceMesh
        Its first vertices and triangles are those of the part.

    Raises
    ------
    CoarseContourError, ResourceError
        As `trimmed_surface`.
    LatticeError
        If the skin is thinner than the grid holds apart from the part's faces, or the internal
        surface reaches them.

    References
    ----------
    D. Raymont, thesis, University of Exeter, section 5.2: the internal architecture route.
    """
    require_thick_skin(design.domain, _LEAST_SKIN * step, f"two steps of its grid of {step:.3g} mm")
    untrimmed = replace(design, domain=grown(design.domain, OVERHANG * step))
    field = lattice_field(untrimmed, band=3 * step, single=True)
    with stepping(f"contouring at {step:.3g} mm"):
        fit = volume_fit(design, step, asked)
        raw = contour(field, contour_grid(design.domain, step), fit=fit)
    require_volume(raw.volume_error, asked, step)
    vertices, faces = raw.vertices, _internal(raw.vertices, raw.near, untrimmed.domain, step)
    del raw
    if len(faces):
        report_step("inner edges of skins")
        vertices, faces = with_skin_edges(vertices, faces, untrimmed.domain, field, step)
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

    Raises
    ------
    LatticeError
        If the surface does not begin with them.
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

    Raises
    ------
    LatticeError
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
