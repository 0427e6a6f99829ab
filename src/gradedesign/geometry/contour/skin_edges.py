"""Inner edges of skins, made sharp again where a contour cuts their corners off."""

from __future__ import annotations

import logging

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray
from gradedesign.geometry.fields.algebra import gradient

log = logging.getLogger(__name__)

#: Vertices this close to the inner face of a skin lie on it, in grid spacings. Chosen, not
#: measured.
_ON = 0.01
#: Vertices of a contour up to this far from it are moved there, in grid spacings. Chosen, not
#: measured.
_NEAR = 0.4
#: Middles of edges farther from it than this are off, in grid spacings. Chosen, not measured.
_OFF = 0.03
#: New vertices lie at most this far from the middle of the edge they divide, in grid spacings.
#: Chosen, not measured.
_FARTHEST = 1.5
#: Normals whose cosine is above this are those of one smooth face. 14 degrees. Chosen, not
#: measured.
_SMOOTH = 0.97
#: Rounds of dividing, and the step of gradients in grid spacings. Chosen, not measured.
_ROUNDS, _STEP = 5, 1e-3


def moved_onto_skins(
    vertices: FloatArray, used: BoolArray, skins: tuple[Field, ...], field: Field, step: float
) -> FloatArray:
    """Vertices of a surface, those beside an inner edge of a skin moved onto its inner face.

    One secant step along a grid edge misses the zero where the distance has a kink.

    Parameters
    ----------
    vertices : (n, 3) array, mm
    used : (n,) bool array
        Those that a contour placed: none on the part's faces.
    skins, field, step
        As for `divided_skin_edges`.
    """
    moved = np.array(vertices)
    for skin in skins:
        value = skin(moved.T)
        size = np.abs(value)
        off = np.flatnonzero(used & (size > 1e-3 * step) & (size <= _NEAR * step))
        # Elsewhere than on the skin it is the lattice that ends there.
        off = off[np.abs(field(moved[off].T) - value[off]) <= 1e-6 * step]
        place = _nearest(moved[off], skin, step)
        sound = _lies(place, moved[off], skin, field, step)
        moved[off[sound]] = place[sound]
    return moved


def divided_skin_edges(
    vertices: FloatArray,
    faces: NDArray[np.int32],
    used: BoolArray,
    skins: tuple[Field, ...],
    field: Field,
    step: float,
) -> tuple[FloatArray, NDArray[np.int32]]:
    """Divide edges of a surface that run off the inner face of a skin on which both ends lie.

    Each gets a vertex on the inner face: where the planes at its ends meet, or the nearest place.
    A triangle whose corners, or sides, lie on three planes also gets their common point.

    - ``vertices (n, 3)``, mm
    - ``faces (m, 3)``: closed and manifold, and so is the result
    - ``used (n,)``: ends of edges that may be divided
    - ``skins``: points ``(3, k)`` mm to signed distances to the inner face of a skin ``(k,)`` mm
    - ``field``: of the whole solid: new vertices lie on its zero as well
    - ``step``, mm: grid of the contour

    References
    ----------
    Attene et al. 2005, "Sharpen & Bend", IEEE TVCG 11(2), which divides the same edges.
    """
    for skin in skins:
        on = np.abs(skin(vertices.T)) <= _ON * step
        on[: len(used)] &= used
        first = 0
        for _ in range(_ROUNDS):
            known = len(vertices)
            added, vertices, faces = _divide(vertices, faces, on, skin, field, step, first)
            if not added:
                break
            first = known
            on = np.concatenate([on, np.ones(added, dtype=bool)])
            log.info("%d vertices on inner edges of a skin", added)
        vertices, faces = _with_corners(vertices, faces, on, skin, field, step)
    return vertices, faces


def _divide(
    vertices: FloatArray,
    faces: NDArray[np.int32],
    on: BoolArray,
    skin: Field,
    field: Field,
    step: float,
    first: int,
) -> tuple[int, FloatArray, NDArray[np.int32]]:
    """One round: the number of new vertices, and the surface.

    Only edges with an end of number ``first`` or later: others have been looked at.
    """
    near = np.flatnonzero(on[faces].sum(axis=1) >= 2)
    sides = np.sort(np.stack([faces[near][:, [c, (c + 1) % 3]] for c in range(3)], axis=1), axis=2)
    edges, of_side = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
    of_side = of_side.reshape(-1, 3)
    middle = vertices[edges].mean(axis=1)
    off = on[edges].all(axis=1) & (edges[:, 1] >= first)
    start = np.zeros(len(edges))
    start[off] = skin(middle[off].T)
    off &= np.abs(start) > _OFF * step
    if not off.any():
        return 0, vertices, faces
    ends = np.unique(edges[off])
    normal = np.zeros((len(vertices), 3))
    normal[ends] = gradient(skin, vertices[ends].T, _STEP * step).T
    a, b = edges[off].T
    place = np.array(middle)
    place[off] = _meeting(middle[off], (vertices[a], normal[a]), (vertices[b], normal[b]))
    bad = np.array(off)
    bad[off] = ~_lies(place[off], middle[off], skin, field, step)
    place[bad] = _nearest(middle[bad], skin, step)
    off[bad] = _lies(place[bad], middle[bad], skin, field, step)
    if not off.any():
        return 0, vertices, faces
    number = np.where(off, len(vertices) + np.cumsum(off) - 1, -1)
    new = number[of_side]  # of the sides from corner c to c + 1
    whole = near[(new >= 0).all(axis=1)]
    corners, sound = _common_point(normal[faces[whole]], vertices[faces[whole]])
    sound &= _lies(corners, vertices[faces[whole]].mean(axis=1), skin, field, step)
    centre = np.full(len(near), -1)
    at = np.flatnonzero((new >= 0).all(axis=1))[sound]
    centre[at] = len(vertices) + off.sum() + np.arange(len(at))
    points = np.concatenate([vertices, place[off], corners[sound]])
    fine = _subdivided(faces[near].astype(np.int64), new, centre, points)
    rest = np.ones(len(faces), dtype=bool)
    rest[near] = False
    faces = np.concatenate([faces[rest], fine.astype(np.int32)])
    return len(points) - len(vertices), points, faces


def _with_corners(
    vertices: FloatArray,
    faces: NDArray[np.int32],
    on: BoolArray,
    skin: Field,
    field: Field,
    step: float,
) -> tuple[FloatArray, NDArray[np.int32]]:
    """Divide triangles whose sides lie on the inner face, each on a plane of its own, in three."""
    near = np.flatnonzero(on[faces].all(axis=1))
    centre = vertices[faces[near]].mean(axis=1)
    off = np.abs(skin(centre.T)) > _OFF * step
    near, centre = near[off], centre[off]
    corners = vertices[faces[near]]
    middles = 0.5 * (corners + corners[:, [1, 2, 0]])
    normals = gradient(skin, middles.reshape(-1, 3).T, _STEP * step).T.reshape(-1, 3, 3)
    points, sound = _common_point(normals, middles)
    sound &= _lies(points, centre, skin, field, step)
    near = near[sound]
    i, j, k = faces[near].T
    number = (len(vertices) + np.arange(len(near))).astype(np.int32)
    fine = [np.stack([a, b, number], axis=1) for a, b in ((i, j), (j, k), (k, i))]
    rest = np.ones(len(faces), dtype=bool)
    rest[near] = False
    return np.concatenate([vertices, points[sound]]), np.concatenate([faces[rest], *fine])


def _meeting(
    middle: FloatArray, first: tuple[FloatArray, FloatArray], second: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """Place nearest to the middle where the planes at both ends meet, ``(n, 3)``."""
    (a, p), (b, q) = first, second
    r, s = ((a - middle) * p).sum(axis=1), ((b - middle) * q).sum(axis=1)
    pp, qq, pq = (p * p).sum(axis=1), (q * q).sum(axis=1), (p * q).sum(axis=1)
    det = pp * qq - pq**2
    sharp = det > (1 - _SMOOTH**2) * pp * qq
    det = np.where(sharp, det, 1.0)
    x, y = (r * qq - s * pq) / det, (s * pp - r * pq) / det
    return np.where(sharp[:, None], middle + x[:, None] * p + y[:, None] * q, middle)


def _nearest(points: FloatArray, skin: Field, step: float) -> FloatArray:
    """Two Newton steps onto the inner face, ``(n, 3)``."""
    for _ in range(2):
        slope = gradient(skin, points.T, _STEP * step)
        square = np.maximum((slope**2).sum(axis=0), 1e-2)
        points = points - (skin(points.T) / square * slope).T
    return points


def _lies(
    points: FloatArray, middle: FloatArray, skin: Field, field: Field, step: float
) -> BoolArray:
    """Whether points lie on the inner face and on the solid's surface, near the middles."""
    close = np.linalg.norm(points - middle, axis=1) <= _FARTHEST * step
    close[close] = np.abs(skin(points[close].T)) <= _ON * step
    close[close] = np.abs(field(points[close].T)) <= 2 * _ON * step
    return np.asarray(close)


def _common_point(normals: FloatArray, points: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Common point of three planes by their normals and points, and whether it is well defined."""
    heights = (normals * points).sum(axis=2)
    sound = np.abs(np.linalg.det(normals)) > 0.1
    normals = np.where(sound[:, None, None], normals, np.eye(3))
    return np.linalg.solve(normals, heights[:, :, None])[:, :, 0], sound


def _subdivided(faces: IntArray, new: IntArray, centre: IntArray, points: FloatArray) -> IntArray:
    """Triangles after division of their sides; ``new[:, c]`` lies between corners c and c + 1."""
    fine = [faces[(new < 0).all(axis=1)]]
    for c in range(3):
        one_side = (new[:, c] >= 0) & (new[:, (c + 1) % 3] < 0) & (new[:, (c + 2) % 3] < 0)
        i, j, k, m = *faces[one_side][:, [c, (c + 1) % 3, (c + 2) % 3]].T, new[one_side, c]
        fine += [np.stack([i, m, k], axis=1), np.stack([m, j, k], axis=1)]
        # The sides on both sides of corner i are divided, the one across is not.
        two_sides = (new[:, c] >= 0) & (new[:, (c + 2) % 3] >= 0) & (new[:, (c + 1) % 3] < 0)
        i, j, k = faces[two_sides][:, [c, (c + 1) % 3, (c + 2) % 3]].T
        m, n = new[two_sides, c], new[two_sides, (c + 2) % 3]
        fine.append(np.stack([i, m, n], axis=1))
        ahead = np.linalg.norm(points[m] - points[k], axis=1)
        back = np.linalg.norm(points[n] - points[j], axis=1)
        short = (ahead < back)[:, None]
        fine.append(np.where(short, np.stack([m, j, k], axis=1), np.stack([m, j, n], axis=1)))
        fine.append(np.where(short, np.stack([m, k, n], axis=1), np.stack([j, k, n], axis=1)))
    every = (new >= 0).all(axis=1)
    plain, fan = every & (centre < 0), every & (centre >= 0)
    fine.append(new[plain])
    for c in range(3):
        fine.append(np.stack([faces[plain, c], new[plain, c], new[plain, (c + 2) % 3]], axis=1))
        i, j, m, o = faces[fan, c], faces[fan, (c + 1) % 3], new[fan, c], centre[fan]
        fine += [np.stack([i, m, o], axis=1), np.stack([m, j, o], axis=1)]
    return np.concatenate(fine)
