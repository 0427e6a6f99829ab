"""A region of the part as pictures mark it: its colour, where its label stands, its arrows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from gradedesign.arrays import FloatArray, locked
from gradedesign.output.scene import Arrow

Role = Literal["support", "load", "kept"]
COLOURS: dict[Role, str] = {"support": "#1f5fbf", "load": "#d62728", "kept": "#6b7a2e"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RegionMark:
    """A region of the part and what acts on it.

    Attributes
    ----------
    name : str
        The region's name in the case.
    role : {"support", "load", "kept"}
    corners : (k, 3, 3) array, mm
        Its triangles.
    text : str
        What acts, such as ``"5 kN"``; shown after the name.
    direction : (3,) array, optional
        Of the load; any length but zero. A load without direction (a pressure, a moment) has
        its arrows against the surface.
    """

    name: str
    role: Role
    corners: FloatArray
    text: str = ""
    direction: FloatArray | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "corners", locked(self.corners, (None, 3, 3), name="corners"))
        if self.direction is not None:
            object.__setattr__(self, "direction", locked(self.direction, (3,), name="direction"))


def unit_normals(corners: FloatArray) -> FloatArray:
    """Unit normals ``(k, 3)`` of triangles ``(k, 3, 3)``; zero for one without area."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)


def _areas(corners: FloatArray) -> FloatArray:
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return 0.5 * np.linalg.norm(across, axis=1)


def anchor_point(corners: FloatArray) -> FloatArray:
    """Area centroid of a region moved onto its nearest triangle's centroid."""
    centre = corners.mean(axis=1)
    middle = np.average(centre, axis=0, weights=_areas(corners) + 1e-300)
    return centre[np.argmin(np.linalg.norm(centre - middle, axis=1))]


def load_arrows(mark: RegionMark, length: float, most: int = 9) -> list[Arrow]:
    """Arrows that end on the region, spread over it; pulling loads start on it."""
    centre, normal = mark.corners.mean(axis=1), unit_normals(mark.corners)
    spread = _spread(centre, anchor_point(mark.corners), most, 0.25 * length)
    arrows = []
    for n in spread:
        direction = -normal[n] if mark.direction is None else mark.direction
        step = length * direction / max(float(np.linalg.norm(direction)), 1e-300)
        pulls = float(step @ normal[n]) > 0.1 * length
        tail = centre[n] if pulls else centre[n] - step
        arrows.append(Arrow(tail=tail, tip=tail + step, colour=COLOURS["load"]))
    return arrows[::-1]  # the anchor's arrow last: it carries the label


def _spread(points: FloatArray, start: FloatArray, most: int, apart: float) -> list[int]:
    """Points far from each other, farthest first, the one nearest to ``start`` leading."""
    chosen = [int(np.argmin(np.linalg.norm(points - start, axis=1)))]
    gap = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < most and gap.max() > apart:
        chosen.append(int(np.argmax(gap)))
        gap = np.minimum(gap, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return chosen
