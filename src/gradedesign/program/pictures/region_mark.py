"""A region of the part as pictures mark it: its colour and where its label stands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from gradedesign.arrays import FloatArray, lock

Role = Literal["support", "load", "passive", "region", "unjudged"]
COLOURS: dict[Role, str] = {
    "support": "#1f5fbf",
    "load": "#e0906a",
    "passive": "#6b7a2e",
    "region": "#8a5a9e",
    "unjudged": "#3f4a57",
}
#: What the legend calls a role.
ROLES: dict[Role, str] = {
    "support": "supports",
    "load": "loaded",
    "passive": "passive solid",
    "region": "regions",
    "unjudged": "stress not judged",
}
#: Spacing of the hatch of supports, and what lies on a surface is lifted by, in diagonals of the
#: part. Chosen, not measured.
HATCH, LIFT = 0.012, 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RegionMark:
    """A region of the part and what it is there for."""

    name: str  #: The region's name in the case, and what else its label says.
    role: Role  #: "support", "load", "passive", "region" or "unjudged".
    corners: FloatArray  #: ``(k, 3, 3)``, mm. Its triangles.

    def __post_init__(self) -> None:
        lock(self, corners=(None, 3, 3))


def unit_normals(corners: FloatArray) -> FloatArray:
    """Unit normals ``(k, 3)`` of triangles ``(k, 3, 3)``; zero for one without area."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)


def lifted(mark: RegionMark, diagonal: float) -> FloatArray:
    """Triangles of a region just above those of the part with this diagonal, mm."""
    return np.asarray(mark.corners + LIFT * diagonal * unit_normals(mark.corners)[:, None, :])


def areas(corners: FloatArray) -> FloatArray:
    """Areas ``(k,)`` of triangles ``(k, 3, 3)``, mm^2."""
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return 0.5 * np.linalg.norm(across, axis=1)


def centre_of(corners: FloatArray) -> FloatArray:
    """Area centroid ``(3,)`` of triangles, mm: where the resultant of a spread force acts."""
    return np.average(corners.mean(axis=1), axis=0, weights=areas(corners) + 1e-300)


def anchor_point(corners: FloatArray) -> FloatArray:
    """Area centroid of a region moved onto its nearest triangle's centroid."""
    centre = corners.mean(axis=1)
    return centre[np.argmin(np.linalg.norm(centre - centre_of(corners), axis=1))]


def spread_points(points: FloatArray, most: int, apart: float) -> list[int]:
    """Points far from each other, farthest first, at least ``apart`` mm."""
    start = points.mean(axis=0)
    chosen = [int(np.argmin(np.linalg.norm(points - start, axis=1)))]
    gap = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < most and gap.max() > apart:
        chosen.append(int(np.argmax(gap)))
        gap = np.minimum(gap, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return chosen
