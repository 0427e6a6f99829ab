"""Overhangs of the printed surface: their area by build direction, and the support below them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.design.printing.wall_thickness import surface_rays
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, area_vectors, corner_points
from gradedesign.geometry.triangles.triangle_tree import build_triangle_tree, ray_lengths

#: Steps of the search for an orientation, degrees: all directions, then around the best. Chosen,
#: not measured.
_COARSE, _FINE = 3.6, 1.8
#: Inclinations to the plate below which the area of the surface is reported, degrees. Chosen, not
#: measured.
_INCLINATIONS = (10, 20, 30, 40, 50, 60, 70, 80, 90)
#: Normals are gathered in boxes of this edge, a fifth of a coarse step.
_BOX = 0.0125
#: Rays that measure the support. Chosen, not measured.
RAYS = 50_000
#: Facets lower than this share of the height lie on the plate. Chosen, not measured.
_ON_PLATE = 1e-6
#: Directions that are evaluated at a time. Bounds the memory of one step; the result does not
#: depend on it. Chosen, not measured.
_BATCH = 256


@dataclass(frozen=True, slots=True, kw_only=True)
class Overhang:
    """Overhangs of a surface."""

    angle: float  #: degrees. A facet overhangs where it is inclined to the plate by less.
    #: Share of the surface that looks down and is inclined to the plate by less, as built, for
    #: every one of `_INCLINATIONS`.
    share_by_angle: Mapping[str, float]
    #: Share of the surface that overhangs: as built, and in the best and the worst direction. What
    #: lies on the plate counts, since every direction has another plate.
    fraction: float
    least: float  #: As `fraction`.
    most: float  #: As `fraction`.
    best: tuple[float, float, float]  #: Those directions, in the axes of the part.
    worst: tuple[float, float, float]  #: Those directions, in the axes of the part.
    #: mm^2. Of the surface that overhangs as built and does not lie on the plate.
    supported_share: float
    supported_area: float  #: As `supported_share`.
    support_volume: float  #: mm^3. Below it, straight down to the next surface or the plate.


def overhang(surface: SurfaceMesh, up: FloatArray, angle: float) -> Overhang:
    """Measure the overhangs of a closed surface.

    ``up (3,)``: build direction, of length 1. ``angle``, degrees.

    References
    ----------
    Raymont, thesis, section 6.2.1: equation 6.19 with the arc cosine that it leaves out, and the
    support cast down from overhanging facets.
    """
    vectors = area_vectors(surface)
    total = float(np.linalg.norm(vectors, axis=1).sum())
    sums, area = gathered_normals(vectors)
    search = directions(_COARSE)
    shares = overhang_fractions(sums, area, search, angle)

    def share(direction: FloatArray, inclination: float) -> float:
        mine = _overhanging(vectors, direction, inclination)
        return float(np.linalg.norm(vectors[mine], axis=1).sum()) / total

    ends = []
    for pick, sign in ((int(np.argmin(shares)), 1.0), (int(np.argmax(shares)), -1.0)):
        near = _around(search[pick])
        extreme = near[int(np.argmin(sign * overhang_fractions(sums, area, near, angle)))]
        # Gathered normals choose a direction; its share, and that as built, come from facets.
        ends.append(min(((share(d, angle), d) for d in (extreme, up)), key=lambda e: sign * e[0]))
    supported, volume = _support(surface, up, angle)
    return Overhang(
        angle=angle,
        share_by_angle={f"{a}": share(up, a) for a in _INCLINATIONS},
        fraction=share(up, angle),
        least=ends[0][0],
        most=ends[1][0],
        best=_triple(ends[0][1]),
        worst=_triple(ends[1][1]),
        supported_share=supported / total,
        supported_area=supported,
        support_volume=volume,
    )


def gathered_normals(vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean unit normals ``(k, 3)`` of nearly parallel facets and their areas ``(k,)``."""
    area = np.linalg.norm(vectors, axis=1)
    vectors, area = vectors[area > 0.0], area[area > 0.0]
    key = np.asarray(np.rint(vectors / area[:, None] / _BOX), dtype=np.int64)
    _, box = np.unique(key @ np.array([1, 1000, 1_000_000]), return_inverse=True)
    box = box.ravel()
    sums = np.stack([np.bincount(box, weights=v) for v in vectors.T], axis=1)
    areas = np.asarray(np.bincount(box, weights=area), dtype=np.float64)
    return sums / np.linalg.norm(sums, axis=1)[:, None], areas


def overhang_fractions(
    normals: FloatArray, area: FloatArray, ups: FloatArray, angle: float
) -> FloatArray:
    """Share of the area that overhangs in each build direction ``(d, 3)``, ``(d,)``."""
    least = np.cos(np.radians(angle))
    shares = np.zeros(len(ups))
    for low in range(0, len(ups), _BATCH):
        down = -(normals @ ups[low : low + _BATCH].T)
        shares[low : low + _BATCH] = area @ (down > least)
    return shares / area.sum()


def directions(step: float) -> FloatArray:
    """Unit vectors a step in degrees apart in polar angle and azimuth, ``(d, 3)``."""
    polar = np.radians(np.arange(0.0, 180.0 + 0.5 * step, step))
    azimuth = np.radians(np.arange(0.0, 360.0 - 0.5 * step, step))
    p, a = np.meshgrid(polar, azimuth, indexing="ij")
    return np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=-1).reshape(
        -1, 3
    )


def _around(up: FloatArray) -> FloatArray:
    """A direction and those a fine step around it, ``(d, 3)``."""
    polar, azimuth = np.arccos(np.clip(up[2], -1, 1)), np.arctan2(up[1], up[0])
    steps = np.radians(_FINE) * np.arange(-1, 2)
    p, a = np.meshgrid(polar + steps, azimuth + steps, indexing="ij")
    near = np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=-1)
    return np.concatenate([up[None], near.reshape(-1, 3)])


def _overhanging(vectors: FloatArray, up: FloatArray, angle: float) -> BoolArray:
    area = np.linalg.norm(vectors, axis=1)
    return np.asarray(-(vectors @ up) > np.cos(np.radians(angle)) * area)


def _support(surface: SurfaceMesh, up: FloatArray, angle: float) -> tuple[float, float]:
    """Area that needs support, mm^2, and the volume of support below it, mm^3."""
    height = surface.vertices @ up
    plate, extent = height.min(), np.ptp(height)
    vectors = area_vectors(surface)
    hangs = _overhanging(vectors, up, angle)
    hangs = hangs & (height[surface.faces] - plate > _ON_PLATE * extent).any(axis=1)
    if not hangs.any():
        return 0.0, 0.0
    below = SurfaceMesh(vertices=surface.vertices, faces=surface.faces[hangs])
    area = float(np.linalg.norm(vectors[hangs], axis=1).sum())
    origins, inward = surface_rays(below, RAYS)
    tree = build_triangle_tree(corner_points(surface))
    down = np.repeat(-up[:, None], origins.shape[1], axis=1)
    length = np.minimum(ray_lengths(tree, origins, down, way=-1), up @ origins - plate)
    return area, area * float((length * (up @ inward)).mean())


def _triple(vector: FloatArray) -> tuple[float, float, float]:
    x, y, z = (round(float(v), 4) + 0.0 for v in vector)
    return x, y, z
