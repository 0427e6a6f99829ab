"""The narrowest gap between faces of a part: rays from its surface through the void beside it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.mesh.surface_mesh import SurfaceMesh
from gradedesign.part.signed_distance import surface_distance
from gradedesign.verify.wall_thickness import ray_lengths, surface_rays

#: Rays of a measurement. Chosen, not measured.
RAYS = 20_000
#: Distance of the middle of a ray from the surface over half its length: less where faces meet in
#: a notch of more than 26 degrees, whose width is 0 in its corner.
_FACING = 0.9


@dataclass(frozen=True, slots=True, kw_only=True)
class Gap:
    """Two places of a surface that face each other across void.

    Attributes
    ----------
    width : float, mm
    middle : (float, float, float), mm
    """

    width: float
    middle: tuple[float, float, float]


def narrowest_gap(surface: SurfaceMesh, below: float, rays: int = RAYS) -> Gap | None:
    """Narrowest gap of less than a width between faces of a closed surface, or None.

    Slots and clearances count, also those between bodies; the corners of notches of more than 26
    degrees do not.

    Parameters
    ----------
    surface : SurfaceMesh
        Closed and outward oriented.
    below : float, mm
        Wider gaps are not looked for.
    rays : int
        Spread evenly over the surface: a gap is found if it is longer and wider than they are
        apart.
    """
    turned = SurfaceMesh(vertices=surface.vertices, faces=surface.faces[:, ::-1])
    origins, outward = surface_rays(turned, rays)
    length = ray_lengths(turned, origins, outward)
    narrow = np.flatnonzero(length < below)
    if not len(narrow):
        return None
    middle: FloatArray = origins[:, narrow] + 0.5 * length[narrow] * outward[:, narrow]
    apart = surface_distance(surface)(middle) >= _FACING * 0.5 * length[narrow]
    if not apart.any():
        return None
    k = int(np.argmin(np.where(apart, length[narrow], np.inf)))
    x, y, z = middle[:, k].tolist()
    return Gap(width=float(length[narrow[k]]), middle=(x, y, z))
