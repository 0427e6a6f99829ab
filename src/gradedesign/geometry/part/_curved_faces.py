"""Taking a smooth region apart into planes, cylinders and the rest.

Where a plane runs tangentially into a fillet no angle parts them. So cylinders are grown
first, strip by strip; flat pieces left alone are planes; flat pieces much larger than the
facets around them are planes too; the rest stays one curved face.
"""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.geometry.part._clusters import Clusters, connected_sets, patch_of
from gradedesign.geometry.part._face_fits import (
    Cylinder,
    Patch,
    angular_span,
    fit_cylinder,
    off_cylinder,
)

#: A face counts as a cylinder when its vertices fit within this share of the radius. Chosen, not
#: measured.
FIT_SHARE = 0.01
#: Growing is stricter: this share of the sagitta of its facets, so that a tangent plane stays out.
_GROW_SAGITTA = 0.2
#: Strips whose turns share an axis this well may lie on one cylinder, cosine. Chosen, not measured.
_SAME_AXIS = np.cos(np.radians(2.0))
#: Facets of a strip stand this square to the axis, sine. Chosen, not measured.
_SQUARE = np.sin(np.radians(1.0))
#: A cluster this much larger than its neighbours' median, or with this share of its set, is a face
#: of its own, not a facet of a curved one. Chosen, not measured.
_LARGE_RATIO, _LARGE_SHARE = 9.0, 0.2
#: Strips of a cylinder that runs into a doubly curved face are so much longer than the facets
#: there, or so much longer than wide. Chosen, not measured.
_LONGER, _SLENDER = 2.0, 10.0
#: A neighbour tilts along the axis if by more than this share of the turn between strips. Chosen,
#: not measured.
_TILT = 0.3
#: Clusters with more neighbours than this are no strips. Chosen, not measured.
_MOST_NEIGHBOURS = 16

Piece = tuple[str, list[int], Cylinder | None]


def split_region(clusters: Clusters, members: list[int]) -> list[Piece]:
    """Split the clusters of one sharp-edged region into faces.

    Returns list of (kind, clusters, cylinder): kind ``plane``, ``cylinder`` or ``other``.
    """
    whole = _classify(clusters, members)
    if whole[0] != "other":
        return [whole]
    pieces, remaining = _grow_cylinders(clusters, members)
    for group in connected_sets(clusters, remaining):
        piece = _classify(clusters, group)
        pieces += [piece] if piece[0] != "other" else _split_planes(clusters, group)
    return pieces


def _classify(clusters: Clusters, members: list[int]) -> Piece:
    """Name a connected set of clusters as a whole."""
    if len(members) == 1 and clusters.flat[members[0]]:
        return "plane", members, None
    if len(members) != 2:
        patch = patch_of(clusters, members)
        cylinder = fit_cylinder(patch)
        if cylinder is not None and cylinder.deviation < _whole_tolerance(patch, cylinder):
            return "cylinder", members, cylinder
    return "other", members, None


def _whole_tolerance(patch: Patch, cylinder: Cylinder) -> float:
    """Allowed distance of a vertex from a cylinder that a whole face is, mm.

    Of a face that goes around little of its cylinder the rise tells more than the radius.
    """
    half = np.radians(0.5 * min(angular_span(patch.points, cylinder), 180.0))
    rise = cylinder.radius * (1.0 - np.cos(half))
    return float(min(FIT_SHARE * cylinder.radius, _GROW_SAGITTA * rise))


def _split_planes(clusters: Clusters, members: list[int]) -> list[Piece]:
    """Part flat pieces that are too large to be facets from the curved rest."""
    inside = set(members)
    area = dict(zip(members, clusters.area[members].tolist(), strict=True))
    total = sum(area.values())
    large = []
    for k in members:
        around = sorted(area[j] for j in clusters.neighbours[k].tolist() if j in inside)
        typical = around[len(around) // 2] if around else 0.0
        big = area[k] > _LARGE_RATIO * typical or area[k] > _LARGE_SHARE * total
        if clusters.flat[k] and (big or len(members) == 2):
            large.append(k)
    pieces: list[Piece] = [("plane", [k], None) for k in large]
    rest = inside.difference(large)
    pieces += [_classify(clusters, group) for group in connected_sets(clusters, rest)]
    return pieces


def _grow_cylinders(clusters: Clusters, members: list[int]) -> tuple[list[Piece], list[int]]:
    """Grow a cylinder from every strip that turns about one axis to both sides."""
    free = set(members)
    tried: set[int] = set()  # a failed growth would fail again from each of its strips
    pieces: list[Piece] = []
    for k in members:
        if k not in free:
            continue
        for seed in _strip_seeds(clusters, k, free):
            if k in tried:
                break
            group, cylinder = _grow(clusters, seed, free)
            if cylinder is not None:
                pieces.append(("cylinder", sorted(group), cylinder))
                free.difference_update(group)
                break
            tried.update(group)
    return pieces, sorted(free)


def _strip_seeds(clusters: Clusters, k: int, free: set[int]) -> list[list[int]]:
    """Triples of a cluster with two neighbours towards which it turns oppositely."""
    around = clusters.neighbours[k]
    if not 2 <= len(around) <= _MOST_NEIGHBOURS:
        return []
    turns = clusters.turns[k]
    opposite = np.argwhere(turns @ turns.T < -_SAME_AXIS).tolist()
    pairs = [(int(around[i]), int(around[j])) for i, j in opposite if i < j]
    return [[k, i, j] for i, j in pairs if i in free and j in free]


def _grow(clusters: Clusters, seed: list[int], free: set[int]) -> tuple[set[int], Cylinder | None]:
    """Add neighbours while they lie on the cylinder through a seed.

    Returns ``found``: clusters gathered beyond the seed; may be empty; ``cylinder``: None unless
    enough clusters lie on it to be sure.
    """
    members = set(seed)
    rough = fit_cylinder(patch_of(clusters, seed))
    if rough is None or _is_band(clusters, members, rough):
        return set(), None
    width = min(_width(clusters, k, rough) for k in seed)
    cylinder = _fit(clusters, members, width)
    if cylinder is None:
        return set(), None
    fitted, front = len(members), list(seed)
    while front:
        candidates = {j for k in front for j in clusters.neighbours[k].tolist()} & free - members
        front = [j for j in sorted(candidates) if _belongs(clusters, j, cylinder, width)]
        members.update(front)
        if len(members) > 1.5 * fitted:
            cylinder, fitted = _fit(clusters, members, width) or cylinder, len(members)
    better = _fit(clusters, members, width)
    if better is not None and not _is_band(clusters, members, better):
        span = angular_span(patch_of(clusters, members).points, better)
        if (len(members) >= 4 and span >= 30.0) or (len(members) == 3 and span >= 60.0):
            return members, better
    return (members if len(members) > len(seed) else set()), None


def _is_band(clusters: Clusters, members: set[int], cylinder: Cylinder) -> bool:
    """Whether a short cylinder is one row of facets of a sphere or torus.

    Then the surface goes on smoothly along the axis, in facets of about the same length.
    """
    beside = sorted({j for k in members for j in clusters.neighbours[k].tolist()} - members)
    width = np.median([_width(clusters, k, cylinder) for k in members])
    limit = min(_SQUARE, _TILT * width / cylinder.radius)
    tilted = np.abs(clusters.normal[beside] @ cylinder.axis) > limit
    if not tilted.any():
        return False
    rows = [k for k, tilt in zip(beside, tilted, strict=True) if tilt]
    length = np.median([np.ptp(_vertices(clusters, k) @ cylinder.axis) for k in members])
    next_length = np.median([np.ptp(_vertices(clusters, k) @ cylinder.axis) for k in rows])
    return bool(length < _LONGER * next_length and length < _SLENDER * width)


def _fit(clusters: Clusters, members: set[int], width: float) -> Cylinder | None:
    """Fit a cylinder that every vertex keeps to closely."""
    cylinder = fit_cylinder(patch_of(clusters, sorted(members)))
    if cylinder is None or cylinder.deviation > _tolerance(clusters, cylinder, width):
        return None
    return cylinder


def _belongs(clusters: Clusters, k: int, cylinder: Cylinder, width: float) -> bool:
    """Whether a cluster is one more strip of a cylinder."""
    if abs(float(clusters.normal[k] @ cylinder.axis)) > _SQUARE:
        return False
    points = _vertices(clusters, k)
    off = off_cylinder(points, cylinder.axis, cylinder.point, cylinder.radius).max()
    return bool(off <= _tolerance(clusters, cylinder, width))


def _tolerance(clusters: Clusters, cylinder: Cylinder, width: float) -> float:
    """Allowed distance of a vertex, mm, for strips of that width."""
    sagitta = width**2 / (8.0 * cylinder.radius)
    return max(clusters.noise, min(_GROW_SAGITTA * sagitta, FIT_SHARE * cylinder.radius))


def _width(clusters: Clusters, k: int, cylinder: Cylinder) -> float:
    """Extent of a strip square to its length, mm."""
    across = np.cross(cylinder.axis, clusters.normal[k])
    return float(np.ptp(_vertices(clusters, k) @ across))


def _vertices(clusters: Clusters, k: int) -> FloatArray:
    return clusters.surface.vertices[clusters.vertices[k]]
