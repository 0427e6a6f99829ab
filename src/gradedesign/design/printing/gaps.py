"""Gaps and thin walls of a part: rays from its surface through the void or the solid beside it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, lock
from gradedesign.design.printing.wall_thickness import surface_rays
from gradedesign.geometry.part.signed_distance import surface_distance
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.geometry.triangles.triangle_tree import ray_lengths

#: Rays of a measurement. Chosen, not measured.
RAYS = 20_000
#: Distance of the middle of a ray from the surface over half its length: less where faces meet in
#: a notch or an edge of more than 26 degrees, whose width is 0 in its corner.
_FACING = 0.9


@dataclass(frozen=True, slots=True, kw_only=True)
class Gap:
    """Two places of a surface that face each other across void."""

    width: float  #: mm.
    middle: tuple[float, float, float]  #: mm.


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FacingPlaces:
    """Places of a surface that face another one of it within a distance."""

    width: FloatArray  #: ``(k,)``, mm.
    middle: FloatArray  #: ``(3, k)``, mm. Halfway between both.
    rays: int  #: Places that were looked at, spread evenly over the surface.

    def __post_init__(self) -> None:
        lock(self, width=(None,), middle=(3, None))


def narrowest_gap(surface: SurfaceMesh, below: float, rays: int = RAYS) -> Gap | None:
    """Narrowest gap of less than a width between faces of a closed surface, or None.

    Slots and clearances count, also those between bodies; the corners of notches of more than 26
    degrees do not.

    ``surface``: closed and outward oriented. ``below``, mm: wider gaps are not looked for.
    ``rays``: spread evenly over the surface: a gap is found if it is longer and wider than they are
    apart.
    """
    turned = SurfaceMesh(vertices=surface.vertices, faces=surface.faces[:, ::-1])
    found = _facing_places(surface, *surface_rays(turned, rays), below, way=-1)
    if not found.width.size:
        return None
    k = int(np.argmin(found.width))
    x, y, z = found.middle[:, k].tolist()
    return Gap(width=float(found.width[k]), middle=(x, y, z))


def thin_walls(surface: SurfaceMesh, below: float, rays: int = RAYS) -> FacingPlaces:
    """Places of a closed surface with a wall of less than a thickness behind them.

    Fins, ribs and pins count; edges of more than 26 degrees do not. Parameters as for
    `narrowest_gap`.
    """
    return _facing_places(surface, *surface_rays(surface, rays), below, way=1)


def _facing_places(
    surface: SurfaceMesh, origins: FloatArray, directions: FloatArray, below: float, *, way: int
) -> FacingPlaces:
    """Places whose ray, inward or with -1 outward, soon meets the surface, face to face."""
    distance = surface_distance(surface)
    length = ray_lengths(distance.tree, origins, directions, way)
    near = length < below
    width, middle = length[near], origins[:, near] + 0.5 * length[near] * directions[:, near]
    if width.size:
        facing = np.abs(distance(middle)) >= _FACING * 0.5 * width
        width, middle = width[facing], middle[:, facing]
    return FacingPlaces(width=width, middle=middle, rays=length.size)
