"""Walls of few cells in a part: between which faces every tetrahedron lies, and their kinds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.lattice.domain import DesignDomain, solid_at
from gradedesign.geometry.maps.cell_map import CellMap
from gradedesign.geometry.maps.local_cells import local_cells
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.thickness import chords
from gradedesign.geometry.tets.tet_mesh import TetMesh, centroids, signed_volumes
from gradedesign.mechanics.fe.stress import weighted_percentile

#: A tetrahedron takes the wall of median thickness within this many cells. Chosen, not measured.
_NEIGHBOURHOOD = 0.5
#: Tetrahedra there, about as many at most. Chosen, not measured.
_MOST_NEIGHBOURS = 500
#: Tetrahedra whose neighbours are looked up at a time. Bounds the memory of one step; the result
#: does not depend on it. Chosen, not measured.
_BATCH = 4096
#: Walls whose faces lie within this many cells of each other's are one kind: the first by default.
#: An angle block had 31 kinds and 2.2 million voxels with the first, 12 and 0.77 million with 0.2.
ALIKE = (0.05, 0.1, 0.2, 0.4)
#: Walls are gathered in steps of this many cells before they are compared. Chosen, not measured.
_SQUARE = 0.01
#: Share of the lattice that a kind of wall must have; others take the nearest kind. Chosen, not
#: measured.
_LEAST_SHARE = 0.01
#: A kind of wall may stand for one whose thickness differs by this many cells at most. Chosen, not
#: measured.
_NEAREST = 0.5
#: Thicker ones, in cells, count as infinite: the effect of faces falls with one over the
#: thickness (6 % in the membrane stiffness of five simple cubic cells whose faces cut no strut).
_THICKEST = 6.0
#: Cosine between a face and the axis of the cells from which the wall lies across it. 20 degrees.
#: Chosen, not measured.
_ACROSS = 0.94
#: By which points lie inside a face where this is measured, in cells.
_STEP = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class WallKind:
    """Faces of a wall along an axis of the cells, in cells; the lower in the first period."""

    axis: int
    lower: float
    upper: float


def wall_faces(
    cell_map: CellMap,
    part: Part,
    domain: DesignDomain,
    mesh: TetMesh,
    lattice: BoolArray,
) -> tuple[FloatArray, BoolArray]:
    """Lower and upper faces along every axis, ``(2, 3, M)`` in cells, and where there are any.

    A tetrahedron takes the wall of median thickness by volume within half a cell.
    """
    middle = centroids(mesh)
    turn, edge = local_cells(cell_map, middle[:, :1]).axes[:, :, 0], cell_map.size
    # A flat tetrahedron at a hollow face may have its centroid outside: it takes its neighbours'.
    inside_tets = np.flatnonzero(lattice & (domain.distance(middle) < 0))
    inner = middle[:, inside_tets]
    lengths = chords(part.surface, inner, turn)
    ends = np.zeros((2, 3, inside_tets.size))
    free = np.ones((3, inside_tets.size), dtype=np.bool_)
    for side, (sign, length) in enumerate(zip((-1.0, 1.0), lengths, strict=True)):
        for k in range(3):
            reached = np.isfinite(length[k])
            at = inner + sign * np.where(reached, length[k], 0.0) * turn[:, k, None]
            ends[side, k] = cell_map(at)[k]
            # A little inside, the surface is as near as it lies across the axis.
            step = _STEP * edge
            free[k] &= reached
            free[k] &= domain.distance(at - sign * step * turn[:, k, None]) < -_ACROSS * step
            free[k] &= ~solid_at(domain, at)
    return _settled(ends, free, inside_tets, middle, signed_volumes(mesh), lattice, edge)


def _settled(
    ends: FloatArray,
    free: BoolArray,
    inside_tets: IntArray,
    points: FloatArray,
    volumes: FloatArray,
    lattice: BoolArray,
    edge: float,
) -> tuple[FloatArray, BoolArray]:
    """Faces of the free wall of median thickness near every tetrahedron of lattice."""
    faces = np.zeros((2, 3, points.shape[1]))
    has_wall = np.zeros((3, points.shape[1]), dtype=np.bool_)
    tets = np.flatnonzero(lattice)
    for k in range(3):
        walls = np.flatnonzero(free[k])
        if not walls.size:
            continue
        # Of a mesh much finer than the cells, evenly left out.
        ball = walls.size * 4.2 * (_NEIGHBOURHOOD * edge) ** 3 / volumes[inside_tets[walls]].sum()
        walls = walls[:: max(int(ball / _MOST_NEIGHBOURS), 1)]
        walls = walls[np.argsort((ends[1, k] - ends[0, k])[walls], kind="stable")]
        tree, held = cKDTree(points[:, inside_tets[walls]].T), volumes[inside_tets[walls]]
        for batch in np.array_split(tets, tets.size // _BATCH + 1):
            near = tree.query_ball_point(
                points[:, batch].T, _NEIGHBOURHOOD * edge, return_sorted=True
            )
            for tet, some in zip(batch, near, strict=True):
                if not some:
                    continue
                total = np.cumsum(held[some])
                chosen = walls[some[np.searchsorted(total, 0.5 * total[-1])]]
                faces[:, k, tet] = ends[:, k, chosen]
                has_wall[k, tet] = True
    return faces, has_wall


def wall_kinds(
    faces: FloatArray,
    has_wall: BoolArray,
    volumes: FloatArray,
    family: CellFamily,
    alike: float = ALIKE[0],
) -> tuple[tuple[WallKind, ...], IntArray]:
    """Kinds of walls, the most frequent first, and the kind at every tetrahedron.

    Walls whose faces lie within ``alike`` cells of each other's are one kind.
    """
    kind = np.full(has_wall.shape, -1, dtype=np.int64)
    kinds: list[WallKind] = []
    least = _LEAST_SHARE * volumes.sum()
    for axis in range(3):
        tets = np.flatnonzero(has_wall[axis])
        low, high = faces[0, axis, tets], faces[1, axis, tets]
        start = np.floor(low / family.period + 1e-6) * family.period
        place = np.stack([low - start, high - start])
        thick = place[1] - place[0]
        thin = thick <= _THICKEST
        tets, place = tets[thin], place[:, thin]
        first = len(kinds)
        index, middle, total = _gathered(place, volumes[tets])
        remaining = np.ones(total.size, dtype=np.bool_)
        while remaining.any():
            # The wall with most lattice in walls like it.
            tree = cKDTree(middle[:, remaining].T)
            near = tree.query_ball_point(middle[:, remaining].T, alike, p=np.inf)
            share = [total[remaining][some].sum() for some in near]
            best = int(np.argmax(share))
            if share[best] < least:
                break
            chosen = np.flatnonzero(remaining)[near[best]]
            mine = np.isin(index, chosen)
            # Medians: plane walls have their faces there, whatever the mesh and its sloped ones.
            lower, upper = (
                weighted_percentile(row[mine], volumes[tets][mine], 50.0) for row in place
            )
            kinds.append(WallKind(axis=axis, lower=lower, upper=upper))
            remaining[chosen] = False
        if len(kinds) > first:
            mine = np.array([[wall.lower, wall.upper] for wall in kinds[first:]])
            off, index = cKDTree(mine).query(place.T, p=np.inf)
            close = off <= _NEAREST
            kind[axis, tets[close]] = first + index[close]
    return tuple(kinds), kind


def _gathered(place: FloatArray, volumes: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Group tetrahedra whose wall has both faces in the same square of a fine grid.

    Returns the group of every tetrahedron ``(n,)``, and of every group the mean position of its
    faces ``(2, k)``, in cells, and its volume ``(k,)``. There are far fewer groups than
    tetrahedra, which keeps the search for walls that are alike short.
    """
    squares = np.round(place / _SQUARE).astype(np.int64)
    _, index = np.unique(squares, axis=1, return_inverse=True)
    index = index.ravel()
    total = np.bincount(index, volumes).astype(np.float64)
    sums = [np.bincount(index, volumes * row) for row in place]
    return index, np.array(sums) / total, total
