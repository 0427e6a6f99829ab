"""Places where a support makes stress singular.

A face that is held along itself makes stress singular at its border, and in a lattice at every wall
that meets it. A plane that is held in its normal alone, as by symmetry or a sliding support, is a
mirror: stress is singular only where it ends within a smooth face, since the mirrored part has a
crack there. A corner of the mirrored part counts as every other corner does.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray, lock
from gradedesign.geometry.part.regions import Region
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, area_vectors, corner_points
from gradedesign.mechanics.fe.load_schema import FixSpec, LoadCaseSpec

#: Largest angle, degrees, between a face's normal and the axis it is held along: files in single
#: precision and remeshed planes stay below a tenth of it. Chosen, not measured.
_NORMAL_DEG = 1.0
#: Where the part's surface turns by less, degrees, at a support's border, the border lies within a
#: smooth face: the mirrored part has a notch there of at most 90 degrees, whose singularity is that
#: of a crack to a tenth (exponents 0.5 and 0.46; Williams, J. Appl. Mech. 19, 526-528, 1952).
_SMOOTH_DEG = 45.0
#: Corners closer than this share of the part's longest edge are one. Chosen, not measured.
_SAME = 1e-7


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SingularSupport:
    """Part of a held region at which stress is singular."""

    region: str
    #: ``(k, 3 corners, 3 coordinates)``, mm. Triangles of faces; lines of a border as triangles
    #: without area.
    corners: FloatArray
    whole: bool  #: Faces of it, and not lines of its border alone.
    area: float  #: mm^2. Of these faces.

    def __post_init__(self) -> None:
        lock(self, corners=(None, 3, 3))


def singular_supports(
    load_cases: Sequence[LoadCaseSpec], regions: Mapping[str, Region], surface: SurfaceMesh
) -> tuple[SingularSupport, ...]:
    """Places of all load cases where supports make stress singular, by region in their order.

    ``regions``: by name. ``surface``: that the regions lie on.
    """
    faces: dict[str, list[FloatArray]] = {}
    lines: dict[str, list[FloatArray]] = {}
    for spec in load_cases:
        for fix in spec.fix:
            region = regions[fix.region]
            sliding = held_in_normal_alone(fix, region)
            faces.setdefault(fix.region, []).append(region.corners[~sliding])
        for name, border in _borders(spec, regions, surface):
            lines.setdefault(name, []).append(border)
    found = []
    for name in sorted(faces):
        held = _each_once(np.concatenate(faces[name]))
        border = np.concatenate([np.zeros((0, 3, 3)), *lines.get(name, [])])
        corners = np.concatenate([held, border])
        if len(corners):
            area = 0.5 * float(np.linalg.norm(_crossed(held), axis=1).sum())
            found.append(
                SingularSupport(region=name, corners=corners, whole=len(held) > 0, area=area)
            )
    return tuple(found)


def _each_once(corners: FloatArray) -> FloatArray:
    """Triangles ``(k, 3, 3)`` without repetitions."""
    return np.unique(corners, axis=0) if len(corners) else corners


def held_in_normal_alone(fix: FixSpec, region: Region) -> BoolArray:
    """Whether a support holds no direction along the face, by piece of the region, ``(k,)``.

    A piece without area, as cutting leaves some, has no direction: it holds nothing.
    """
    held = np.array([value is not None for value in fix.displacement])
    cross = _crossed(region.corners)
    length = np.linalg.norm(cross, axis=1, keepdims=True)
    along = np.abs(cross) >= np.cos(np.deg2rad(_NORMAL_DEG)) * length
    return np.asarray((along | ~held).all(axis=1))


def _borders(
    spec: LoadCaseSpec, regions: Mapping[str, Region], surface: SurfaceMesh
) -> Iterator[tuple[str, FloatArray]]:
    """Borders within smooth faces of the planes that a load case holds in their normals alone."""
    names = [fix.region for fix in spec.fix]
    corners = np.concatenate([regions[name].corners for name in names])
    parents = np.concatenate([regions[name].triangles for name in names])
    owner = np.repeat(np.arange(len(names)), [len(regions[name].corners) for name in names])
    sliding = np.concatenate([held_in_normal_alone(fix, regions[fix.region]) for fix in spec.fix])
    if not sliding.any():
        return
    step = _SAME * float(np.ptp(surface.vertices, axis=0).max())
    _, vertex = np.unique(np.round(corners.reshape(-1, 3) / step), axis=0, return_inverse=True)
    vertex = vertex.reshape(-1, 3)
    # A piece that two supports hold is one piece, and one without area is none.
    places = np.sort(vertex, axis=1)
    _, first = np.unique(places, axis=0, return_index=True)
    first = first[(np.diff(places[first], axis=1) > 0).all(axis=1)]
    tail, head = vertex[first], np.roll(vertex[first], -1, axis=1)
    pairs = np.sort(np.stack([tail, head], axis=-1).reshape(-1, 2), axis=1)
    _, edge, count = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    alone = count[edge.ravel()].reshape(-1, 3) == 1
    smooth = _smooth_neighbours(surface, step)
    for piece, side in zip(*np.nonzero(alone & sliding[first, None]), strict=True):
        k = int(first[piece])
        ends = corners[k, [side, (side + 1) % 3]]
        if smooth(int(parents[k]), ends):
            line = np.stack([ends[0], ends[1], ends[1]])[None]
            yield names[int(owner[k])], line


def _smooth_neighbours(surface: SurfaceMesh, step: float) -> _SmoothNeighbours:
    """Test whether the surface goes on smoothly beyond a line on one of its triangles.

    ``step``, mm, is the distance within which the line counts as lying on the triangle's edge.
    """
    tail, head = surface.faces, np.roll(surface.faces, -1, axis=1)
    key = np.minimum(tail, head) * np.int64(len(surface.vertices)) + np.maximum(tail, head)
    order = np.argsort(key, axis=None, kind="stable")
    # Every edge of a closed surface belongs to two triangles, or to two at a time.
    other = np.zeros(key.size, dtype=np.int64)
    other[order[0::2]], other[order[1::2]] = order[1::2], order[0::2]
    return _SmoothNeighbours(
        corners=corner_points(surface),
        normals=area_vectors(surface),
        other=other.reshape(-1, 3) // 3,
        step=step,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _SmoothNeighbours:
    """See `_smooth_neighbours`."""

    corners: FloatArray  #: ``(m, 3, 3)``, mm.
    normals: FloatArray  #: ``(m, 3)``. Outward, of any length.
    other: IntArray  #: ``(m, 3)``. Triangle beyond edges 01, 12, 20.
    step: float  #: mm.

    def __call__(self, triangle: int, ends: FloatArray) -> bool:
        """Whether the part goes on smoothly beyond a line ``(2, 3)`` of a triangle."""
        for side in range(3):
            start = self.corners[triangle, side]
            along = self.corners[triangle, (side + 1) % 3] - start
            off = np.cross(ends - start, along / np.linalg.norm(along))
            if np.linalg.norm(off, axis=1).max() <= 10 * self.step:
                return self._smooth(triangle, int(self.other[triangle, side]))
        return True  # cut out of the triangle: the plane itself goes on

    def _smooth(self, one: int, other: int) -> bool:
        """Whether two triangles meet at a small turn, or at a re-entrant edge."""
        a, b = self.normals[one], self.normals[other]
        cosine = a @ b / (np.linalg.norm(a) * np.linalg.norm(b))
        above = (self.corners[other] - self.corners[one, 0]) @ a / np.linalg.norm(a)
        return bool(cosine > np.cos(np.deg2rad(_SMOOTH_DEG)) or above.max() > 10 * self.step)


def _crossed(corners: FloatArray) -> FloatArray:
    """Normals ``(k, 3)`` of triangles ``(k, 3, 3)``, of twice their area."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
