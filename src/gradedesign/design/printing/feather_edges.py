"""Feather edges of the printed solid: rims thinner than a wall where two faces meet flat."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.design.printing.wall_thickness import RAYS, surface_rays
from gradedesign.geometry.triangles._surface_mesh_kernels import triangle_areas
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, area_vectors, corner_points
from gradedesign.geometry.triangles.triangle_tree import (
    build_triangle_tree,
    closest_triangles,
    ray_lengths,
)

#: A rim between faces that enclose less than this is a feather edge, degrees: it is thinner than a
#: wall over 1.7 times that wall. Where faces of the part cut walls at random, edges of 45 to 60
#: degrees are the most frequent by far, and no printer rounds them by more than its own detail.
FLAT = 30.0
#: Width of the cubes in which the place with the most of them is looked for, over the wall. Chosen.
_PLACE = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class FeatherEdges:
    """Surface with less than a wall of solid behind it, at an acute angle to the face behind."""

    wall_mm: float
    angle_deg: float  #: Faces that enclose less count.
    share: float  #: Of the surface's area.
    area_mm2: float
    at_mm: tuple[float, float, float] | None  #: Where most of it lies; None without any.


def feather_edges(surface: SurfaceMesh, wall: float, rays: int = RAYS) -> FeatherEdges:
    """Find the feather edges of a closed solid.

    Rays go from the surface straight through the solid, as for `wall_thickness`. One that leaves it
    within the wall, through a face that encloses less than `FLAT` with the face it began on, lies
    at a feather edge. A wall that is too thin all over encloses nothing and counts too.

    ``surface``: closed and outward oriented. ``wall``, mm: thinnest that is printed.
    """
    origins, inward = surface_rays(surface, rays)
    tree = build_triangle_tree(corner_points(surface))
    length = ray_lengths(tree, origins, inward)
    thin = length < wall
    start, direction = origins[:, thin], inward[:, thin]
    _, triangle, _ = closest_triangles(tree, start + length[thin] * direction)
    outward: FloatArray = area_vectors(surface)[triangle].T
    size = np.linalg.norm(outward, axis=0)
    flat = np.einsum("dn,dn->n", direction, outward) > np.cos(np.radians(FLAT)) * size
    share = float(flat.sum() / max(len(length), 1))
    return FeatherEdges(
        wall_mm=wall,
        angle_deg=FLAT,
        share=share,
        area_mm2=share * float(triangle_areas(surface.vertices, surface.faces).sum()),
        at_mm=_densest(start[:, flat], _PLACE * wall),
    )


def _densest(points: FloatArray, width: float) -> tuple[float, float, float] | None:
    """Mean of the points in the cube that holds most of them, mm."""
    if points.shape[1] == 0:
        return None
    _, cube, count = np.unique(
        np.floor(points / width), axis=1, return_inverse=True, return_counts=True
    )
    x, y, z = points[:, np.ravel(cube) == np.argmax(count)].mean(axis=1)
    return float(x), float(y), float(z)
