"""Bores as isotropic remeshing leaves them: corners anywhere on the facets of the former mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay

#: Corners are moved by this share of their spacing, so that no two triangles are alike.
JITTER = 0.25


@dataclass(frozen=True, slots=True, kw_only=True)
class Bore:
    """A bore through a square plate, about z before the plate is turned.

    Attributes
    ----------
    shape : {"plain", "rounded", "countersunk", "cone", "waist"}
        The last two hold no cylinder: a cone, and a wall whose radius is least halfway.
    diameter, height, edge : float, mm
        Of the bore, of the plate, of a triangle.
    former : int
        Facets around the bore before it was remeshed; 0: corners lie on the cylinder itself.
    """

    shape: str
    diameter: float
    height: float
    edge: float
    former: int
    seed: int

    @property
    def straight(self) -> float:
        """Length of the cylindrical part, mm."""
        return {"plain": 1.0, "rounded": 0.7, "countersunk": 0.6}.get(self.shape, 0.0) * self.height


def profile(bore: Bore) -> np.ndarray:
    """Radius and height of points along the wall from the bottom up, ``(2, n)``."""
    r, h = 0.5 * bore.diameter, bore.height
    z = np.linspace(0.0, h, 2001)
    if bore.shape == "plain":
        radius = np.full_like(z, r)
    elif bore.shape == "rounded":
        fillet = 0.15 * h
        end = np.clip(fillet - np.minimum(z, h - z), 0.0, fillet)
        radius = r + fillet - np.sqrt(fillet**2 - end**2)
    elif bore.shape == "countersunk":
        radius = r + np.clip(z - 0.6 * h, 0.0, None)
    elif bore.shape == "cone":
        radius = r * (1.0 + 0.3 * z / h)
    else:
        radius = r * (1.0 + 0.4 * (2.0 * z / h - 1.0) ** 2)
    return np.stack([radius, z])


def corners_of(bore: Bore) -> np.ndarray:
    """Triangles ``(m, 3, 3)`` of the plate with its bore, outward, turned and moved by chance."""
    rng = np.random.default_rng(bore.seed)
    radius, z = profile(bore)
    length = np.append(0.0, np.cumsum(np.hypot(np.diff(radius), np.diff(z))))
    around = max(round(2.0 * np.pi * radius.mean() / bore.edge), 12)
    rows = max(round(length[-1] / (bore.edge * np.sqrt(0.75))), 1) + 1
    angle, along = _strip(rng, around, rows)
    place = along * length[-1]
    ring, level = np.interp(place, length, radius), np.interp(place, length, z)
    if bore.former:
        step = 2.0 * np.pi / bore.former
        ring = ring * np.cos(0.5 * step) / np.cos(np.mod(angle, step) - 0.5 * step)
    wall = np.stack([ring * np.cos(angle), ring * np.sin(angle), level], axis=1)
    triangles = wall[_wall_triangles(angle, along, around, length[-1] / radius.mean())]
    parts = [_facing(triangles, -triangles.mean(axis=1) * np.array([1.0, 1.0, 0.0]))]
    half = 1.6 * radius.max() + 2.0 * bore.edge
    for row, sign in ((0.0, -1.0), (1.0, 1.0)):
        rim = wall[along == row]
        parts.append(_facing(_end(rng, rim, half, bore.edge), np.array([0.0, 0.0, sign])))
    parts.append(_sides(half, bore))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    return np.concatenate(parts) @ turn.T + rng.uniform(-30.0, 30.0, 3)


def _strip(rng, around, rows):
    """Angles and places along the wall of corners in rows, moved by chance but at the rims."""
    angle, along = [], []
    for row in range(rows):
        inner = 0 < row < rows - 1
        shift = 0.5 * (row % 2) + (rng.uniform(-JITTER, JITTER, around) if inner else 0.0)
        angle.append(2.0 * np.pi * np.mod(np.arange(around) + shift, around) / around)
        move = rng.uniform(-JITTER, JITTER, around) if inner else np.zeros(around)
        along.append((row + move) / (rows - 1))
    return np.concatenate(angle), np.concatenate(along)


def _wall_triangles(angle, along, around, slenderness):
    """Delaunay triangles of the unrolled wall, closed around its axis."""
    size = len(angle)
    flat = np.stack([angle, along * slenderness], axis=1)
    copies = np.concatenate([flat + np.array([2.0 * np.pi * k, 0.0]) for k in (-1, 0, 1)])
    found = Delaunay(copies).simplices
    middle = copies[found].mean(axis=1)[:, 0]
    found = found[(middle >= 0.0) & (middle < 2.0 * np.pi)]
    found = np.unique(np.sort(found % size, axis=1), axis=0)
    flat_rim = (along[found] == 0.0).all(axis=1) | (along[found] == 1.0).all(axis=1)
    return found[~flat_rim]


def _square(half, edge):
    count = max(round(2.0 * half / edge), 2)
    side = np.linspace(-half, half, count + 1)[:-1]
    ends = np.full_like(side, half)
    return np.concatenate(
        [np.stack(pair, 1) for pair in ((side, -ends), (ends, side), (-side, ends), (-ends, -side))]
    )


def _end(rng, rim, half, edge):
    """Triangles of a flat end between its square and the rim of the bore."""
    circle, square = rim[:, :2], _square(half, edge)
    reach = np.hypot(*circle.T).max()
    inner = rng.uniform(-half + 0.6 * edge, half - 0.6 * edge, (int((half / edge) ** 2), 2))
    inner = inner[np.hypot(*inner.T) > reach + 0.6 * edge]
    points = np.concatenate([circle, square, inner])
    found = Delaunay(points).simplices
    # The rim's polygon is convex, so Delaunay keeps its edges.
    hole = (found < len(circle)).all(axis=1)
    return np.c_[points, np.full(len(points), rim[0, 2])][found[~hole]]


def _sides(half, bore):
    outline = _square(half, bore.edge)
    after = np.roll(outline, -1, axis=0)
    low, high = 0.0, bore.height
    a, b = np.c_[outline, np.full(len(outline), low)], np.c_[after, np.full(len(after), low)]
    c, d = np.c_[after, np.full(len(after), high)], np.c_[outline, np.full(len(outline), high)]
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def _facing(triangles, outward):
    """Triangles turned so that their normals point along ``outward``."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    wrong = (np.cross(b - a, c - a) * outward).sum(axis=1) < 0.0
    triangles = triangles.copy()
    triangles[wrong] = triangles[wrong][:, ::-1]
    return triangles
