"""Thickness of the printed solid: lengths of rays from its surface straight through the wall."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.errors import MeshError
from gradedesign.geometry.triangles._surface_mesh_kernels import triangle_areas
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, area_vectors, corner_points
from gradedesign.geometry.triangles.triangle_tree import build_triangle_tree, ray_lengths

#: Rays of a measurement. The thinnest 0.1 % then rest on 100 of them.
RAYS = 100_000
#: Percentiles by area that are reported, %. Chosen, not measured.
PERCENTILES = (0.1, 1.0, 5.0, 50.0)
#: Largest share of rays that may find no way out of a closed surface by rounding.
_MOST_LOST = 1e-4
#: Depth below the surface, over the thickness there, at which the phase is looked up: the contour
#: is off it by less. Chosen, not measured.
_BELOW = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class WallThickness:
    """Distribution of thickness over the surface."""

    #: By percentile of the surface's area, such as ``"0.1"``: that share of the surface has less
    #: solid behind it.
    percentiles_mm: Mapping[str, float]
    rays: int
    #: The same by percentile over the surface of one phase, where it was asked for and has some.
    of_phase_mm: Mapping[str, float] = field(default_factory=dict)
    #: For the report.
    method: str = (
        "length of the inward normal ray to where it first leaves the solid, from points spread "
        "evenly over the surface"
    )


def wall_thickness(
    surface: SurfaceMesh,
    rays: int = RAYS,
    percentiles: Sequence[float] = PERCENTILES,
    in_phase: Callable[[FloatArray], BoolArray] | None = None,
) -> WallThickness:
    """Measure the thickness of a closed solid behind its surface.

    A plate, a shell and a strut have their thickness or diameter. The face of a cut, such as a
    wall's end on a face of the part, has the length of the wall behind it, and an acute edge has
    less than any wall near it, so the lowest percentiles also tell of sharp rims.

    Raises MeshError if rays find no way out of the solid: the surface is open.

    ``surface``: closed and outward oriented. ``in_phase``: points ``(3, n)`` mm inside to whether
    they lie in the phase that is measured on its own, ``(n,)``.
    """
    origins, inward = surface_rays(surface, rays)
    length = ray_lengths(build_triangle_tree(corner_points(surface)), origins, inward)
    found = np.isfinite(length)
    thickness = length[found]
    lost = len(length) - len(thickness)
    if lost > _MOST_LOST * len(length):
        raise MeshError(
            f"thickness: {lost} of {len(length)} rays into the solid find no way out; the "
            "surface is open, repair it"
        )
    own = thickness[:0]
    if in_phase is not None:
        own = thickness[in_phase(origins[:, found] + _BELOW * thickness * inward[:, found])]
    return WallThickness(
        percentiles_mm=_by_percentile(thickness, percentiles),
        rays=len(thickness),
        of_phase_mm=_by_percentile(own, percentiles) if own.size else {},
    )


def _by_percentile(thickness: FloatArray, percentiles: Sequence[float]) -> dict[str, float]:
    values = np.percentile(thickness, percentiles)
    return {f"{p:g}": float(v) for p, v in zip(percentiles, values, strict=True)}


def surface_rays(surface: SurfaceMesh, count: int) -> tuple[FloatArray, FloatArray]:
    """About ``count`` points spread evenly by area, and the inward normals there, ``(3, n)``."""
    area = triangle_areas(surface.vertices, surface.faces)
    total = np.cumsum(area)
    rng = np.random.default_rng(20_231)
    at = (np.arange(count) + rng.random(count)) / count * total[-1]
    chosen = np.minimum(np.searchsorted(total, at, side="right"), len(total) - 1)
    chosen = chosen[area[chosen] > 0]
    u, v = np.sqrt(rng.random(len(chosen))), rng.random(len(chosen))
    weights = np.stack([1.0 - u, u * (1.0 - v), u * v])
    some = SurfaceMesh(vertices=surface.vertices, faces=surface.faces[chosen])
    origins = np.einsum("cn,ncd->dn", weights, corner_points(some))
    normals = area_vectors(some) / area[chosen, None]
    return np.ascontiguousarray(origins), np.ascontiguousarray(-normals.T)
