"""A lattice of round struts as beams: nodes, struts and a radius at each of their ends."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from gradedesign import (
    CellMap,
    DesignDomain,
    LatticeDesign,
    LatticeError,
    StrutAxes,
    SurfaceMesh,
    density_at,
    solid_surface,
)
from gradedesign.fields import FloatArray, IntArray

#: A beam's radius is linear; graded struts are divided until it is right within this share. Chosen,
#: not measured.
_RADIUS_ERROR = 0.01
#: Most beams that a graded strut is divided into. Chosen, not measured.
_MOST_PIECES = 16
#: Points along a strut at which its distance from the part is looked up. Chosen, not measured.
_LOOKED_UP = 9
#: Grid steps of skin and passive solids along a cell. Chosen, not measured.
_STEPS_PER_CELL = 24.0
#: Nodes closer than this, in cells, are one. Chosen, not measured.
_SAME = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BeamLattice:
    """Beams inside a part, united with what is solid there.

    Attributes
    ----------
    nodes : (n, 3) array, mm
    beams : (m, 2) int array
        Nodes at the ends.
    radii : (m, 2) array, mm
        At the ends; linear between them, with a ball of that radius at each end.
    ball_nodes : (b,) int array
    ball_radii : (b,) array, mm
        Of the balls at those nodes.
    clip : SurfaceMesh
        The part, which cuts the beams.
    solid : SurfaceMesh or None
        Skin and passive solids.
    """

    nodes: FloatArray
    beams: IntArray
    radii: FloatArray
    ball_nodes: IntArray
    ball_radii: FloatArray
    clip: SurfaceMesh
    solid: SurfaceMesh | None


def beam_lattice(design: LatticeDesign, part: SurfaceMesh) -> BeamLattice:
    """Beams of a lattice.

    Parameters
    ----------
    part : SurfaceMesh
        Its signed distance is ``design.domain.distance``.

    Raises
    ------
    LatticeError
        If the lattice is not made of round struts in equal cubes.
    """
    axes, cell_map = design.cells.axes, design.cell_map
    words = why_no_beams(axes, cell_map if isinstance(cell_map, CellMap) else None, design.domain)
    if words or axes is None or not isinstance(cell_map, CellMap):
        raise LatticeError(words)
    size = _cube_edge(cell_map)
    segments = _repeated(design, cell_map, axes)
    ends = _points(cell_map, segments)
    touching = _touches(design, ends, _radius(design, ends, size).max(axis=1))
    segments, ends = segments[touching], ends[touching]
    if len(segments) == 0:
        raise LatticeError("no strut lies in the part; take smaller cells or move their origin")
    pieces = _pieces(design, ends, size)
    cuts = np.linspace(0.0, 1.0, pieces + 1)
    line = segments[:, :1] + cuts[:, None] * (segments[:, 1:] - segments[:, :1])
    split = np.stack([line[:, :-1], line[:, 1:]], axis=2).reshape(-1, 2, 3)
    places, node = _merged(split.reshape(-1, 3))
    nodes = _points(cell_map, places[:, None])[:, 0]
    radius = _radius(design, nodes[:, None], size)[:, 0]
    beams = node.reshape(-1, 2)
    balls = _ball_nodes(places, axes)
    return BeamLattice(
        nodes=nodes,
        beams=beams,
        radii=radius[beams],
        ball_nodes=balls,
        ball_radii=axes.ball_ratio * radius[balls],
        clip=part,
        solid=solid_surface(design.domain, part, design.cell_size / _STEPS_PER_CELL),
    )


def why_no_beams(axes: StrutAxes | None, cell_map: CellMap | None, domain: DesignDomain) -> str:
    """Say why a lattice cannot be written as beams; empty if it can.

    Parameters
    ----------
    axes : StrutAxes or None
        None where the cell is not made of round struts.
    cell_map : CellMap or None
        None where the cells follow the design.
    """
    if axes is None:
        return (
            "beams are round struts, which this cell is not made of; expected a strut cell such "
            'as bcc, write "3mf" instead'
        )
    if domain.on_cells or domain.join or domain.cuts:
        return (
            "beams have no joints of a radius, drain holes or net-skins; write "
            '"3mf", which holds their surface, or leave these out of [lattice]'
        )
    if cell_map is None or not _cube_edge(cell_map):
        return (
            "struts of cells that are no equal cubes are bent or not round, which beams cannot "
            'be; write "3mf" instead'
        )
    return ""


def _cube_edge(cell_map: CellMap) -> float:
    """Edge of the equal cubes that a map makes, mm; 0 where it makes none."""
    if cell_map.name != "uniform" or not cell_map.inverse:
        return 0.0
    edges = 1.0 / np.linalg.norm(cell_map.jacobian(np.zeros((3, 1)))[:, :, 0], axis=1)
    return float(edges.mean()) if np.ptp(edges) <= 1e-9 * edges.max() else 0.0


def _repeated(design: LatticeDesign, cell_map: CellMap, axes: StrutAxes) -> FloatArray:
    """Struts of all cells around the part, ``(m, 2, 3)``, cell units."""
    ends = np.stack([design.domain.lower, design.domain.upper])
    corners = np.array(
        [[ends[b, axis] for axis, b in enumerate(at)] for at in product((0, 1), repeat=3)]
    )
    u = cell_map(corners.T)
    reach = np.abs(axes.segments).max(initial=0.0)
    low = np.floor(u.min(axis=1) - reach - 1).astype(np.int64)
    high = np.ceil(u.max(axis=1) + reach + 1).astype(np.int64)
    shifts = np.stack(
        np.meshgrid(*(np.arange(a, b) for a, b in zip(low, high, strict=True)), indexing="ij"),
        axis=-1,
    ).reshape(-1, 1, 1, 3)
    return np.asarray((axes.segments + shifts).reshape(-1, 2, 3))


def _points(cell_map: CellMap, u: FloatArray) -> FloatArray:
    """Points ``(..., 3)`` mm of cell coordinates ``(..., 3)``."""
    if cell_map.inverse is None:
        raise LatticeError("the cell map has no inverse")
    return np.moveaxis(cell_map.inverse(np.moveaxis(u, -1, 0)), 0, -1)


def _radius(design: LatticeDesign, points: FloatArray, size: float) -> FloatArray:
    """Radius of the struts at points ``(..., 3)`` mm, ``(...)``, mm."""
    return size * design.cells.level_of(density_at(design, np.moveaxis(points, -1, 0)))


def _touches(design: LatticeDesign, ends: FloatArray, radius: FloatArray) -> IntArray:
    """Struts that may reach into the part, ``(k,)``."""
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    nearest = np.full(len(ends), np.inf)
    box = design.domain.lower, design.domain.upper
    beyond = np.maximum(box[0] - ends.max(axis=1), ends.min(axis=1) - box[1]).max(axis=1)
    near = np.flatnonzero(beyond <= radius)
    for s in np.linspace(0.0, 1.0, _LOOKED_UP):
        points = ends[near, 0] + s * (ends[near, 1] - ends[near, 0])
        nearest[near] = np.minimum(nearest[near], design.domain.distance(points.T))
    return np.flatnonzero(nearest <= radius + 0.5 * length / (_LOOKED_UP - 1))


def _pieces(design: LatticeDesign, ends: FloatArray, size: float) -> int:
    """Number of beams into which each strut is divided so that its radius is linear in each.

    Raises
    ------
    LatticeError
        If the density changes too fast along the struts.
    """
    s = np.linspace(0.0, 1.0, 2 * _MOST_PIECES + 1)
    line = ends[:, :1] + s[:, None] * (ends[:, 1:] - ends[:, :1])
    radius = _radius(design, line, size)
    pieces = 1
    while pieces <= _MOST_PIECES:
        step = 2 * _MOST_PIECES // pieces
        end_radius = radius[:, ::step]
        at = np.minimum(np.arange(len(s)) // step, pieces - 1)
        share = (np.arange(len(s)) - at * step) / step
        linear = end_radius[:, at] * (1 - share) + end_radius[:, at + 1] * share
        if (np.abs(linear - radius) <= _RADIUS_ERROR * radius).all():
            return pieces
        pieces *= 2
    raise LatticeError(
        f"the radius of struts changes too fast along them for {_MOST_PIECES} beams of linear "
        f"radius each within {100 * _RADIUS_ERROR:g} %; raise [lattice] filter_radius"
    )


def _merged(places: FloatArray) -> tuple[FloatArray, IntArray]:
    """Distinct points ``(n, 3)``, and the index of the distinct point for every given one."""
    keys = np.asarray(np.rint(places / _SAME), dtype=np.int64)
    _, first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return places[first], number.ravel()


def _ball_nodes(places: FloatArray, axes: StrutAxes) -> IntArray:
    """Nodes with balls that the struts do not hide."""
    if axes.ball_ratio <= 1.0 or len(axes.balls) == 0:
        return np.zeros(0, dtype=np.int64)
    away = np.abs(places[:, None] - axes.balls[None])
    away = np.abs(away - np.rint(away)).max(axis=2)
    return np.flatnonzero((away <= 2 * _SAME).any(axis=1))
