"""Supports that prescribe different displacements where their regions touch, before any mesh."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.values.locate import Where
from gradedesign.errors import CaseError
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.regions import Region
from gradedesign.geometry.part.signed_distance import region_distance
from gradedesign.mechanics.fe.load_schema import FixSpec, LoadCaseSpec
from gradedesign.mechanics.fe.supports import disagrees

#: Regions closer than this share of the part's diagonal touch: the rounding of cut corners.
TOUCHING = 1e-9


def require_agreeing(load_cases: Sequence[LoadCaseSpec], part: Part, where: Where) -> None:
    """Refuse load cases of which two supports contradict each other on a common point.

    Regions that share an edge, a corner or an area have nodes of every mesh in common, which
    cannot be displaced by two values.

    Raises
    ------
    CaseError
        Naming both supports by file, line, region and value, and a common point.
    """
    tolerance = TOUCHING * part.diagonal
    for number, spec in enumerate(load_cases):
        for first, second in combinations(range(len(spec.fix)), 2):
            one, other = spec.fix[first], spec.fix[second]
            differing = _differing(one, other)
            if not differing:
                continue
            at = common_point(part.regions[one.region], part.regions[other.region], tolerance)
            if at is None:
                continue
            axis, key = "xyz"[differing[0]], f"load_case[{number}].fix"
            wanted = [fix.displacement[differing[0]] for fix in (one, other)]
            raise CaseError(
                f"{where(f'{key}[{second}]')}: load case '{spec.name}': the support of "
                f"region '{other.region}' prescribes the {axis} displacement {wanted[1]:g} mm, "
                f"that of region '{one.region}' ({where(f'{key}[{first}]')}) {wanted[0]:g} "
                f"mm, and the two regions meet, as at ({', '.join(f'{c:.4g}' for c in at)}) mm; "
                f'leave {axis} free in one of them, as displacement with "free" does, or choose '
                f"regions that do not touch"
            )


def _differing(one: FixSpec, other: FixSpec) -> list[int]:
    """Components that two supports prescribe differently."""
    pairs = enumerate(zip(one.displacement, other.displacement, strict=True))
    return [c for c, (a, b) in pairs if a is not None and b is not None and disagrees(a, b)]


def common_point(one: Region, other: Region, tolerance: float) -> FloatArray | None:
    """A point at which two regions of a surface touch or overlap, ``(3,)`` mm; None if they do not.

    Pieces of different triangles touch only along these triangles' common edge or at a common
    corner, so that a corner of one of the two lies on the other; cut pieces of one triangle may
    also cross without.
    """
    for a, b in ((one, other), (other, one)):
        corners = np.unique(b.corners.reshape(-1, 3), axis=0)
        away = region_distance(a.corners)(corners.T)
        if away.min() <= tolerance:
            return np.asarray(corners[int(np.argmin(away))])
    for triangle in np.intersect1d(one.triangles, other.triangles):
        for piece in one.corners[one.triangles == triangle]:
            for against in other.corners[other.triangles == triangle]:
                if _overlap(piece, against):
                    return np.asarray(0.5 * (piece.mean(axis=0) + against.mean(axis=0)))
    return None


def _overlap(one: FloatArray, other: FloatArray) -> bool:
    """Whether two triangles ``(3, 3)`` of one plane overlap: no edge of either separates them."""
    normal = np.cross(one[1] - one[0], one[2] - one[0])
    for corners in (one, other):
        across = np.cross(normal, np.roll(corners, -1, axis=0) - corners)
        a, b = across @ one.T, across @ other.T
        if ((a.max(axis=1) < b.min(axis=1)) | (b.max(axis=1) < a.min(axis=1))).any():
            return False
    return True
