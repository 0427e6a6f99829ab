"""The printed surface with the part's own faces: contour the lattice, then cut it with the part."""

from __future__ import annotations

import logging

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import BoolArray, Field, FloatArray
from gradedesign.common.system.progress import report_step, stepping
from gradedesign.geometry.contour.resolution import Resolution
from gradedesign.geometry.contour.skin_edges import divided_skin_edges, moved_onto_skins
from gradedesign.geometry.contour.surface import (
    Contour,
    extract_surface,
    require_closed,
)
from gradedesign.geometry.lattice.component import SolidLayer
from gradedesign.geometry.lattice.domain import DesignDomain, grown
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.geometry.lattice.lattice_contour import OVERHANG, lattice_contour
from gradedesign.geometry.lattice.solid_layers import solid_layers
from gradedesign.geometry.triangles.boolean import cut_capped, intersection
from gradedesign.geometry.triangles.crossings import TOUCHING, crossing_triangles
from gradedesign.geometry.triangles.short_edges import used_only, without_short_edges
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

log = logging.getLogger(__name__)

#: Rounds in which inner edges of skins are left as contoured where triangles cross. Chosen, not
#: measured.
ROUNDS = 4
#: Before, edges of this share of the grid step are collapsed there, which unfolds most. Chosen, not
#: measured.
_FOLDS = (0.03, 0.06, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5)
#: Triangles that a collapse changes lie within this many grid steps of those that crossed. Chosen,
#: not measured.
AROUND = 4.0
#: Edges shorter than this share of the grid step are collapsed after the cut: single precision
#: files cannot hold them apart.
SHORTEST = 0.02


def trimmed_surface(
    design: LatticeDesign, part: SurfaceMesh, step: float, asked: Resolution | None = None
) -> SurfaceMesh:
    """Closed surface of a lattice whose outer faces are exactly those of the part.

    Contouring the trimmed field would chamfer every edge between a wall and the part's faces by
    half a grid step. Here the lattice is contoured a little beyond the part and then cut by the
    part's own triangles, so faces stay flat and edges sharp. Only what lies near the part's surface
    is cut: the triangles deep inside are kept apart, and joined again by the vertices between.
    Vertices of the lattice are placed so that the triangles hold its volume, see `true_volume`.

    Raises CoarseContourError if more is off. Raises ResourceError if the surface does not fit the
    memory. Raises LatticeError if the lattice has no solid, or the result is not closed. Raises
    MeshError if the Boolean kernel refuses a surface or nothing is left.

    ``part``: closed and outward oriented; its signed distance is ``design.domain.distance``.
    ``step``, mm: grid of the contour. ``asked``: how much the volume of a cell may be off; whatever
    it is without.
    """
    raw, field = lattice_contour(design, part, step, asked)
    domain = grown(design.domain, OVERHANG * step)
    with stepping(f"cutting {len(raw.near)} of {raw.count} triangles with the part"):
        vertices, faces = _cut(raw, part)
        del raw  # the triangles once more
        if domain.closed:
            report_step("inner edges of skins")
            vertices, faces = with_skin_edges(vertices, faces, domain, field, step)
        report_step("collapsing short edges")
        trimmed = used_only(vertices, without_short_edges(vertices, faces, SHORTEST * step))
    require_closed(trimmed)
    return trimmed


def solid_surface(domain: DesignDomain, part: SurfaceMesh, step: float) -> SurfaceMesh | None:
    """Surface of what is solid in a part, cut by it as `trimmed_surface` is; None without solids.

    Raises
    ------
    LatticeError, MeshError, ResourceError
        As `trimmed_surface`.

    Examples
    --------
    Skins and kept regions of a part alone, on a grid of half a millimetre::

        solid_surface(domain, part, step=0.5)
    """
    if domain.lattice_only:
        return None
    domain = grown(domain, OVERHANG * step)
    part_distance, layers = solid_layers(domain)

    def field(points: FloatArray) -> FloatArray:
        distance = part_distance(points)
        solids = [layer(points, distance) for layer in layers]
        return np.maximum(distance, np.minimum.reduce(solids))

    raw = extract_surface(field, domain.lower - step, domain.upper + step, step)
    trimmed = intersection(raw, part, subject="solid regions", shortest=SHORTEST * step)
    require_closed(trimmed)
    return trimmed


def with_skin_edges(
    vertices: FloatArray, faces: NDArray[np.int32], domain: DesignDomain, field: Field, step: float
) -> tuple[FloatArray, NDArray[np.int32]]:
    """The surface with inner edges of skins, but where triangles would cross.

    ``domain`` is grown by the overhang.
    """
    part, layers = solid_layers(domain, 3 * step)
    skins = tuple(
        _alone(layer) for solid, layer in zip(domain.solids, layers, strict=True) if solid.closes
    )
    open_ones = np.zeros(len(vertices), dtype=bool)
    open_ones[faces] = True
    # Not on the part's faces, which the domain's overhang lies outside of.
    open_ones &= part(vertices.T) < -OVERHANG * step - 1e-6
    for _ in range(ROUNDS):
        moved = moved_onto_skins(vertices, open_ones, skins, field, step)
        fine, triangles, corners = _divided(moved, faces, open_ones, skins, field, step)
        if not len(corners):
            # What has been collapsed may be divided again.
            again = _divided(fine, triangles, open_ones, skins, field, step)
            return (fine, triangles) if len(again[2]) else again[:2]
        log.info(
            "%d triangles would cross at inner edges of a skin: left as contoured", len(corners)
        )
        open_ones &= ~_inside_any(vertices, corners, 0.1 * step)
    log.warning("inner edges of skins are left as contoured: their triangles would cross")
    return vertices, faces


def _divided(
    vertices: FloatArray,
    faces: NDArray[np.int32],
    open_ones: BoolArray,
    skins: tuple[Field, ...],
    field: Field,
    step: float,
) -> tuple[FloatArray, NDArray[np.int32], FloatArray]:
    """The surface with divided edges, folds of it collapsed, and triangles that still cross."""
    fine, triangles = divided_skin_edges(vertices, faces, open_ones, skins, field, step)
    to_skin = np.minimum.reduce([np.abs(skin(fine.T)) for skin in skins])
    inner = to_skin <= 0.01 * step
    inner[: len(open_ones)] &= open_ones
    near = to_skin <= 2 * step
    corners = _crossing(fine, triangles, near)
    for share in _FOLDS:
        if not len(corners):
            break
        there = inner & _inside_any(fine, corners, share * step)
        triangles = without_short_edges(fine, triangles.copy(), share * step, there)
        # Farther away nothing has changed.
        corners = _crossing(fine, triangles, near & _inside_any(fine, corners, AROUND * step))
    return fine, triangles, corners


def _crossing(vertices: FloatArray, faces: NDArray[np.int32], near: BoolArray) -> FloatArray:
    """Corners of triangles with a corner near the skins that pass through others, ``(k, 3, 3)``."""
    suspects = faces[near[faces].any(axis=1)].astype(np.int64)
    pairs = crossing_triangles(vertices, suspects, TOUCHING)
    return vertices[suspects[pairs.ravel()]]


def _inside_any(vertices: FloatArray, corners: FloatArray, margin: float) -> BoolArray:
    """Mask of the vertices in or close to the box of one of some triangles (k, 3, 3)."""
    inside = np.zeros(len(vertices), dtype=bool)
    order = np.argsort(vertices[:, 0])
    along = vertices[order, 0]
    for some in corners:
        lower, upper = some.min(axis=0) - margin, some.max(axis=0) + margin
        # Few of millions of vertices lie between the ends of a triangle.
        near = order[slice(*np.searchsorted(along, (lower[0], upper[0])))]
        here = vertices[near]
        inside[near[((here >= lower) & (here <= upper)).all(axis=1)]] = True
    return inside


def _alone(layer: SolidLayer) -> Field:
    return lambda points: layer(points, None)


def _cut(raw: Contour, part: SurfaceMesh) -> tuple[FloatArray, NDArray[np.int32]]:
    """Cut the triangles near the part's surface, and join those deep inside to them again."""
    near = np.concatenate([raw.near, raw.outer, raw.inner])
    cut = cut_capped(raw.vertices, near, len(raw.inner), part, subject="printed surface")
    number = np.where(cut.source >= 0, cut.source, len(raw.vertices) + np.arange(len(cut.source)))
    vertices = np.concatenate([raw.vertices, cut.vertices])
    return vertices, np.concatenate([raw.deep, number[cut.faces].astype(np.int32)])
