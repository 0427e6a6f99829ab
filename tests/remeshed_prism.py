"""Prisms as isotropic remeshing leaves them: corners anywhere on the facets of the former mesh."""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay

#: Corners are moved by this share of their spacing, so that no two triangles are alike.
JITTER = 0.25


def arc(centre, radius, start, end, facets):
    """Corners of an arc of that many facets a turn, both ends included, degrees."""
    count = max(round(facets * abs(end - start) / 360.0), 1)
    turn = np.radians(np.linspace(start, end, count + 1))
    return np.stack([centre[0] + radius * np.cos(turn), centre[1] + radius * np.sin(turn)], axis=1)


def prism(loops, height, edge, seed):
    """Triangles ``(m, 3, 3)`` of a prism over closed outlines, outward, turned by chance.

    Parameters
    ----------
    loops : list of (n, 2) arrays, mm
        Outlines; of those inside others holes. Corners that turn by more than 30 degrees stay.
    height, edge : float, mm
        Of the prism, of a triangle.
    seed : int
    """
    rng = np.random.default_rng(seed)
    rows = max(round(height / (edge * np.sqrt(0.75))), 2) + 1
    parts, rims = [], [[], []]
    for loop in loops:
        place, turned = _outline(loop, edge, rng)
        walls, ends = _wall(place, turned, height, rows, rng)
        parts.append(walls)
        for rim, own in zip(rims, ends, strict=True):
            rim.append(own)
    for rim, level, up in zip(rims, (0.0, height), (False, True), strict=True):
        flat = _end(rim, loops, edge, rng)
        corners = np.concatenate([flat, np.full((*flat.shape[:2], 1), level)], axis=2)
        parts.append(corners if up else corners[:, ::-1])
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    return np.concatenate(parts) @ turn.T + rng.uniform(-30.0, 30.0, 3), turn[:, 2]


def _outline(loop, edge, rng):
    """Function from lengths along an outline to places, and spans between its sharp corners."""
    closed = np.concatenate([loop, loop[:1]])
    steps = np.diff(closed, axis=0)
    length = np.append(0.0, np.cumsum(np.hypot(*steps.T)))
    angle = np.arctan2(*steps.T[::-1])
    turn = np.abs(np.angle(np.exp(1j * (angle - np.roll(angle, 1)))))
    sharp = length[:-1][turn > np.radians(30.5)]
    if not len(sharp):
        sharp = np.zeros(1)
    ends = np.append(sharp, sharp[0] + length[-1])

    def place(at):
        at = np.mod(at, length[-1])
        return np.stack([np.interp(at, length, closed[:, k]) for k in (0, 1)], axis=-1)

    counts = np.maximum(np.round(np.diff(ends) / edge).astype(int), 1)
    return place, (ends, counts, len(sharp) if turn.max() > np.radians(30.5) else 0)


def _wall(place, turned, height, rows, rng):
    """Triangles of the wall over an outline, and its lower and upper rim."""
    ends, counts, sharp = turned
    along, up = [], []
    for row in range(rows):
        inner = 0 < row < rows - 1
        for first, last, count in zip(ends[:-1], ends[1:], counts, strict=True):
            shift = np.zeros(count)
            move = np.zeros(count)
            if inner:
                shift = rng.uniform(-JITTER, JITTER, count) + 0.5 * (row % 2)
                move = rng.uniform(-JITTER, JITTER, count)
                if sharp:  # the corner's edge stays straight
                    shift[0] = 0.0
                    if row % 2 and count > 1:
                        shift[1:] -= 0.25
            along.append(first + (last - first) * (np.arange(count) + shift) / count)
            up.append(height * (row + move) / (rows - 1))
    along, up = np.concatenate(along), np.concatenate(up)
    total = ends[-1] - ends[0]
    flat = np.stack([along, up], axis=1)
    size = len(flat)
    copies = np.concatenate([flat + np.array([total * k, 0.0]) for k in (-1, 0, 1)])
    found = Delaunay(copies).simplices
    middle = copies[found].mean(axis=1)[:, 0]
    found = found[(middle >= ends[0]) & (middle < ends[-1])] % size
    flat_rim = (up[found] == 0.0).all(axis=1) | (up[found] == height).all(axis=1)
    found = np.unique(np.sort(found[~flat_rim], axis=1), axis=0)
    places = np.concatenate([place(along), up[:, None]], axis=1)
    # Unrolled, counterclockwise faces to the right of the outline: outward where it runs so.
    a, b, c = (flat[found[:, k]] for k in range(3))
    b, c = (p + total * np.round((a[:, :1] - p[:, :1]) / total) * [1.0, 0.0] for p in (b, c))
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    wrong = ux * vy - uy * vx < 0.0
    found[wrong] = found[wrong][:, ::-1]
    return places[found], [places[up == level][:, :2] for level in (0.0, height)]


def _end(rims, loops, edge, rng):
    """Triangles of a flat end between its rims, counterclockwise."""
    rim = np.concatenate(rims)
    low, high = rim.min(axis=0), rim.max(axis=0)
    count = int(np.prod((high - low) / edge))
    inner = rng.uniform(low, high, (count, 2))
    away = np.hypot(*(inner[:, None] - rim[None]).transpose(2, 0, 1)).min(axis=1)
    points = np.concatenate([rim, inner[away > 0.7 * edge]])
    found = Delaunay(points).simplices
    inside = np.zeros(len(found), dtype=bool)
    middle = points[found].mean(axis=1)
    for own in rims:
        inside ^= _within(own, middle)
    return points[found[inside]]


def _within(loop, points):
    """Whether points lie in a closed outline, by crossings of a ray."""
    a, b = loop, np.roll(loop, -1, axis=0)
    x, y = points[:, :1], points[:, 1:]
    crosses = (a[:, 1] > y) != (b[:, 1] > y)
    step = np.where(b[:, 1] == a[:, 1], 1.0, b[:, 1] - a[:, 1])
    ahead = a[:, 0] + (y - a[:, 1]) / step * (b[:, 0] - a[:, 0])
    return (crosses & (ahead > x)).sum(axis=1) % 2 == 1
