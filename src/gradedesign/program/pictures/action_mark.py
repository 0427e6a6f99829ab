"""Marks of loads and supports in pictures: arrows by size, one colour for each load case."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from gradedesign.arrays import FloatArray, lock
from gradedesign.program.pictures.region_mark import centre_of, spread_points, unit_normals
from gradedesign.program.pictures.scene import VIEW, Arrow, Lines

Kind = Literal["force", "pressure", "moment", "acceleration", "displacement"]
#: Colours of load cases, in their order; after the last one they begin again.
_CASE_COLOURS = ("#d62728", "#8e24aa", "#00838f", "#ef6c00", "#2e7d32", "#5d4037", "#c2185b")
#: Length of the largest arrow of a kind over the part's diagonal, and of the least over that.
#: Chosen, not measured.
LONGEST, SHORTEST = 0.2, 0.35
#: Arrows of a pressure at most, and how far apart over the diagonal. Chosen, not measured.
_MOST_ARROWS, APART = 9, 0.05
#: Arrows from one point closer than this in direction are moved apart, by a share of the diagonal.
#: Chosen, not measured.
_ALIKE, _ASIDE = np.cos(np.radians(25.0)), 0.035

#: Half the width of the bar from a region to the point of its remote force, over the diagonal: a
#: quarter of the longest arrow's shaft. Chosen, not measured.
_ARM = 0.002


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ActionMark:
    """One thing that acts on the part in a load case."""

    load_case: str
    #: "force", "pressure", "moment", "acceleration" or "displacement". Sizes are compared within a
    #: kind.
    kind: Kind
    text: str  #: Its size with unit, such as ``"1300 N"``.
    vector: FloatArray  #: ``(3,)``. Direction and size; of a pressure its size along x.
    #: ``(k, 3, 3)``, mm. Triangles of the region it acts on; of the whole part for an acceleration.
    corners: FloatArray
    at: FloatArray | None = None  #: ``(3,)``, mm. The point that a remote force acts at.

    def __post_init__(self) -> None:
        lock(self, vector=(3,))
        if self.at is not None:
            lock(self, at=(3,))
        lock(self, corners=(None, 3, 3))

    @property
    def size(self) -> float:
        """Length of the vector."""
        return float(np.linalg.norm(self.vector))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DrawnAction:
    """Arrows and strokes of an action, and where its label stands, ``(3,)`` mm."""

    action: ActionMark
    arrows: tuple[Arrow, ...]
    lines: tuple[Lines, ...]
    label: FloatArray
    colour: str


def _case_colours(names: Sequence[str]) -> dict[str, str]:
    """Colour of every load case, in the order of their first action."""
    unique = dict.fromkeys(names)
    return {name: _CASE_COLOURS[n % len(_CASE_COLOURS)] for n, name in enumerate(unique)}


def _arrow_lengths(actions: Sequence[ActionMark], diagonal: float) -> list[float]:
    """Lengths in proportion to the sizes within a kind, 35 % of the longest at least, mm."""
    largest: dict[str, float] = {}
    for action in actions:
        largest[action.kind] = max(largest.get(action.kind, 0.0), action.size)
    return [
        LONGEST * diagonal * max(a.size / largest[a.kind], SHORTEST) if a.size > 0 else 0.0
        for a in actions
    ]


def uses_floor(actions: Sequence[ActionMark]) -> bool:
    """Whether some arrow is longer than its proportion."""
    lengths = _arrow_lengths(actions, 1.0)
    return any(length == LONGEST * SHORTEST for length in lengths)


def drawn_actions(actions: Sequence[ActionMark], diagonal: float) -> list[DrawnAction]:
    """Arrows of all actions; those that would cover each other stand side by side."""
    colours = _case_colours([a.load_case for a in actions])
    lengths = _arrow_lengths(actions, diagonal)
    before: list[tuple[FloatArray, FloatArray]] = []
    drawn = []
    for action, length in zip(actions, lengths, strict=True):
        if length <= 0:
            continue
        colour = colours[action.load_case]
        if action.kind == "pressure":
            arrows = _against(action, length, colour, APART * diagonal)
            drawn.append(_drawn(action, arrows, (), arrows[0].tail, colour))
            continue
        direction = action.vector / action.size
        start = centre_of(action.corners) if action.at is None else action.at
        alike = sum(
            bool(np.linalg.norm(start - s) < 1e-6 * diagonal and d @ direction > _ALIKE)
            for s, d in before
        )
        before.append((start, direction))
        start = start + alike * _ASIDE * diagonal * _aside(direction)
        if action.kind == "moment":
            arc, head = _turn(start, direction, 0.45 * length, colour)
            drawn.append(_drawn(action, (head,), (arc,), arc.segments[-1, 1], colour))
            continue
        if action.at is not None:
            arrow = Arrow(tail=start, tip=start + length * direction, colour=colour)
            arm = np.stack([centre_of(action.corners), start])[None]
            bar = Lines(segments=arm, colour=colour, radius=_ARM * diagonal)
            drawn.append(_drawn(action, (arrow,), (bar,), arrow.tip, colour))
            continue
        arrow = _resultant(action, start, length * direction, diagonal, colour)
        pulls = bool(np.linalg.norm(arrow.tail - start) < np.linalg.norm(arrow.tip - start))
        drawn.append(_drawn(action, (arrow,), (), arrow.tip if pulls else arrow.tail, colour))
    return drawn


def _drawn(
    action: ActionMark,
    arrows: tuple[Arrow, ...],
    lines: tuple[Lines, ...],
    label: FloatArray,
    colour: str,
) -> DrawnAction:
    return DrawnAction(action=action, arrows=arrows, lines=lines, label=label, colour=colour)


def _aside(direction: FloatArray) -> FloatArray:
    """Unit vector across a direction that the viewer sees in full, or any across."""
    across = np.cross(direction, VIEW)
    if np.linalg.norm(across) < 1e-3:
        across = np.cross(direction, [0.0, 0.0, 1.0])
    return np.asarray(across / np.linalg.norm(across))


def _resultant(
    action: ActionMark, start: FloatArray, step: FloatArray, diagonal: float, colour: str
) -> Arrow:
    """One arrow at the region's centroid: away from it, or onto it where it presses."""
    normals = unit_normals(action.corners)
    normal = normals.mean(axis=0)
    presses = action.kind == "force" and float(normal @ step) < -0.3 * float(np.linalg.norm(step))
    tail = start - step if presses else start
    if not presses:
        tail = tail + 0.01 * diagonal * normal  # not half sunk into a face that it slides along
    return Arrow(tail=tail, tip=tail + step, colour=colour)


def _against(action: ActionMark, length: float, colour: str, apart: float) -> tuple[Arrow, ...]:
    """Arrows onto a region, or off it where the pressure pulls, spread over it."""
    centre, normal = action.corners.mean(axis=1), unit_normals(action.corners)
    arrows = []
    for n in spread_points(centre, _MOST_ARROWS, apart):
        step = -np.sign(action.vector[0]) * length * normal[n]
        tail = centre[n] - step if action.vector[0] > 0 else centre[n]
        arrows.append(Arrow(tail=tail, tip=tail + step, colour=colour))
    return tuple(arrows)


def _turn(centre: FloatArray, axis: FloatArray, radius: float, colour: str) -> tuple[Lines, Arrow]:
    """Three quarters of a circle about an axis, right-handed, and the head at its end."""
    first = _aside(axis)
    second = np.cross(axis, first)
    angle = np.linspace(0.0, 1.5 * np.pi, 37)
    points = centre + radius * (np.outer(np.cos(angle), first) + np.outer(np.sin(angle), second))
    along = np.cross(axis, points[-1] - centre)
    along *= 0.8 * radius / np.linalg.norm(along)
    segments = np.stack([points[:-1], points[1:]], axis=1)
    arc = Lines(segments=segments, colour=colour, radius=0.06 * radius)
    return arc, Arrow(tail=points[-1], tip=points[-1] + along, colour=colour)
