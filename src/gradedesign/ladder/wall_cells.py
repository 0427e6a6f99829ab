"""Walls of few cells in a part: which there are about every tetrahedron, and their ratios."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray
from gradedesign.case.schema import Case
from gradedesign.cell.calibration import calibrate
from gradedesign.cell.family import CellFamily
from gradedesign.cell.shape import complete_parameters, evaluate_shape, grid_nodes
from gradedesign.errors import CaseError, DensityError, LatticeError, SolverError
from gradedesign.fe.collapsed_rule import collapsed_rule
from gradedesign.homogenise.sampling import LEAST_VOXELS, voxels_in_wall
from gradedesign.homogenise.wall_ratios import WallRatios, wall_ratios
from gradedesign.lattice.lattice import KeptRegion
from gradedesign.mesh.surface_mesh import corner_points
from gradedesign.mesh.tet_mesh import TetMesh, centroids, signed_volumes
from gradedesign.part.chords import chords
from gradedesign.part.part import Part
from gradedesign.sizing.wall_factors import WallClass, WallFactors, wall_class
from gradedesign.workspace.cache import content_key, load_arrays, store_arrays

log = logging.getLogger(__name__)

#: Changes whenever a ratio would come out otherwise.
METHOD_VERSION = 1
#: Voxels along a cell: the first that puts three of them across the thinnest wall. Ratios hold
#: to 2 % with five across (one simple cubic cell, 22 against 44).
RESOLUTIONS = (24, 36, 48)
#: Densities between the bounds at which ratios are computed.
DENSITIES = 4
#: Points along an edge of the rule that integrates profiles over a tetrahedron: 0.3 % of what 216
#: points give on a bracket of one cell.
RULE = 3
#: A tetrahedron takes the wall of median thickness within this many cells.
_NEIGHBOURHOOD = 0.5
#: Walls whose faces lie within this many cells of each other's are one kind.
_ALIKE = 0.05
#: Walls are gathered in steps of this many cells before they are compared.
_SQUARE = 0.01
#: Share of the lattice that a kind of wall must have; others take the nearest kind.
_LEAST_SHARE = 0.01
#: A kind of wall may stand for one whose thickness differs by this many cells at most.
_NEAREST = 0.5
#: Thicker ones, in cells, count as endless: what faces do falls with one over the thickness (6 %
#: in the membrane stiffness of five simple cubic cells whose struts the faces leave whole).
_THICKEST = 6.0
#: Cosine between a face and the axis of the cells from which the wall lies across it.
_ACROSS = 0.94
#: By which points lie inside a face where this is measured, in cells.
_STEP = 1e-3
_KIND = "wall-ratios"


@dataclass(frozen=True, slots=True, kw_only=True)
class WallKind:
    """Faces of a wall along an axis of the cells, in cells; the lower in the first period."""

    axis: int
    lower: float
    upper: float


def wall_factors(
    case: Case,
    part: Part,
    mesh: TetMesh,
    lattice: BoolArray,
    kept: tuple[KeptRegion, ...],
    distance: Field,
    family: CellFamily,
    parameters: Mapping[str, float],
    bounds: tuple[float, float],
    poissons_ratio: float,
    on_wall: Callable[[str], None] = log.info,
) -> WallFactors:
    """Find the walls of a part and homogenise each kind of them.

    Along each axis of the cells the part reaches from face to face through the centroid of a
    tetrahedron; where both faces are free and lie across the axis, this is a wall.

    Parameters
    ----------
    case : Case
    part : Part
    mesh : TetMesh
    lattice : (M,) bool array
        Tetrahedra that hold lattice.
    kept : tuple of KeptRegion
    distance : callable
        Signed distance of the part.
    family : CellFamily
    parameters : mapping of str to float
    bounds : (float, float)
        Densities that sizing may choose.
    poissons_ratio : float
    on_wall : callable
        Told of each kind of wall before it is computed; not of those in the user's cache.

    Returns
    -------
    WallFactors

    Raises
    ------
    CaseError
        If a wall does not hang together at a density that sizing may choose, or its cells are too
        thin for the finest grid.
    """
    points, weights = collapsed_rule(RULE)
    edge = case.lattice.edges[0]
    turn = Rotation.from_euler("XYZ", case.lattice.rotation, degrees=True).as_matrix()
    origin = np.asarray(case.lattice.origin)

    def to_cells(x: FloatArray) -> FloatArray:
        return np.asarray(
            np.einsum("ij,i...->j...", turn, x) / edge
            - (turn.T @ origin / edge)[(slice(None), *(None,) * (x.ndim - 1))]
        )

    faces, found = _faces(case, part, mesh, lattice, kept, distance, turn, to_cells)
    kinds, kind = _kinds(faces, found, signed_volumes(mesh) * lattice, family)
    low, high = bounds
    density = np.geomspace(low, high, DENSITIES) if high > low else low * np.array([0.99, 1.01])
    window = calibrate(family, parameters).window
    density = np.clip(density, *window)
    # Rounding must not leave the bounds outside.
    density[0], density[-1] = min(density[0], low), max(density[-1], high)
    resolution = _resolution(family, parameters, low)
    classes = []
    for number, one in enumerate(kinds):
        at = centroids(mesh)[:, np.flatnonzero(kind[one.axis] == number)[0]]
        before = partial(on_wall, f"{_words(one)}, wall {number + 1} of {len(kinds)}")
        given = (family, parameters, density, one, resolution, poissons_ratio)
        classes.append(_class(*given, at, before))
    corners = to_cells(mesh.points)[:, mesh.tets]
    places = np.einsum("dcm,qc->dqm", corners, points)
    middle = 0.5 * (faces[0] + faces[1])[:, None]
    half = np.maximum(0.5 * (faces[1] - faces[0])[:, None], 1e-9)
    height = np.where(kind[:, None] >= 0, (places - middle) / half, 0.0)
    return WallFactors(
        density=density,
        classes=tuple(classes),
        kind=kind,
        height=np.clip(height, -1.0, 1.0),
        points=points,
        weights=weights,
    )


def _faces(
    case: Case,
    part: Part,
    mesh: TetMesh,
    lattice: BoolArray,
    kept: tuple[KeptRegion, ...],
    distance: Field,
    turn: FloatArray,
    to_cells: Field,
) -> tuple[FloatArray, BoolArray]:
    """Lower and upper faces along every axis, ``(2, 3, M)`` in cells, and where there are any.

    A tetrahedron takes the wall of median thickness by volume within half a cell.
    """
    middle = centroids(mesh)
    # A flat tetrahedron at a hollow face may have its centroid outside: it takes its neighbours'.
    known = np.flatnonzero(lattice & (distance(middle) < 0))
    inner = middle[:, known]
    lengths = chords(corner_points(part.surface), inner, turn)
    edge = case.lattice.edges[0]
    ends = np.zeros((2, 3, known.size))
    free = np.ones((3, known.size), dtype=np.bool_)
    for side, (sign, length) in enumerate(zip((-1.0, 1.0), lengths, strict=True)):
        for k in range(3):
            reached = np.isfinite(length[k])
            at = inner + sign * np.where(reached, length[k], 0.0) * turn[:, k, None]
            ends[side, k] = to_cells(at)[k]
            # A little inside, the surface is as near as it lies across the axis.
            step = _STEP * edge
            free[k] &= reached
            free[k] &= distance(at - sign * step * turn[:, k, None]) < -_ACROSS * step
            for region in kept:
                free[k] &= region.distance(at) > region.margin
    return _settled(ends, free, known, middle, signed_volumes(mesh), lattice, edge)


def _settled(
    ends: FloatArray,
    free: BoolArray,
    known: IntArray,
    points: FloatArray,
    volumes: FloatArray,
    lattice: BoolArray,
    edge: float,
) -> tuple[FloatArray, BoolArray]:
    """Faces of the free wall of median thickness near every tetrahedron of lattice."""
    faces = np.zeros((2, 3, points.shape[1]))
    found = np.zeros((3, points.shape[1]), dtype=np.bool_)
    asked = np.flatnonzero(lattice)
    for k in range(3):
        walls = np.flatnonzero(free[k])
        if not walls.size:
            continue
        tree = cKDTree(points[:, known[walls]].T)
        near = tree.query_ball_point(points[:, asked].T, _NEIGHBOURHOOD * edge)
        thick = ends[1, k] - ends[0, k]
        for tet, some in zip(asked, near, strict=True):
            if not some:
                continue
            here = walls[np.sort(some)]
            order = here[np.argsort(thick[here], kind="stable")]
            total = np.cumsum(volumes[known[order]])
            chosen = order[np.searchsorted(total, 0.5 * total[-1])]
            faces[:, k, tet] = ends[:, k, chosen]
            found[k, tet] = True
    return faces, found


def _kinds(
    faces: FloatArray, found: BoolArray, volumes: FloatArray, family: CellFamily
) -> tuple[tuple[WallKind, ...], IntArray]:
    """Kinds of walls, the most frequent first, and the kind at every tetrahedron."""
    kind = np.full(found.shape, -1, dtype=np.int64)
    kinds: list[WallKind] = []
    least = _LEAST_SHARE * volumes.sum()
    for axis in range(3):
        tets = np.flatnonzero(found[axis])
        low, high = faces[0, axis, tets], faces[1, axis, tets]
        start = np.floor(low / family.period + 1e-6) * family.period
        place = np.stack([low - start, high - start])
        thick = place[1] - place[0]
        thin = thick <= _THICKEST
        tets, place = tets[thin], place[:, thin]
        first = len(kinds)
        middle, total = _gathered(place, volumes[tets])
        left = np.ones(total.size, dtype=np.bool_)
        while left.any():
            # The wall with most lattice in walls like it.
            tree = cKDTree(middle[:, left].T)
            alike = tree.query_ball_point(middle[:, left].T, _ALIKE, p=np.inf)
            share = [total[left][some].sum() for some in alike]
            best = int(np.argmax(share))
            if share[best] < least:
                break
            lower, upper = middle[:, left][:, best]
            kinds.append(WallKind(axis=axis, lower=float(lower), upper=float(upper)))
            left[np.flatnonzero(left)[alike[best]]] = False
        if len(kinds) > first:
            mine = np.array([[one.lower, one.upper] for one in kinds[first:]])
            off, index = cKDTree(mine).query(place.T, p=np.inf)
            near = off <= _NEAREST
            kind[axis, tets[near]] = first + index[near]
    return tuple(kinds), kind


def _gathered(place: FloatArray, volumes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean faces ``(2, n)`` and volume of the walls in each square of a fine grid of faces.

    As many as tetrahedra at most, and few of them within `_ALIKE` of each other.
    """
    squares = np.round(place / _SQUARE).astype(np.int64)
    _, index = np.unique(squares, axis=1, return_inverse=True)
    total = np.bincount(index.ravel(), volumes).astype(np.float64)
    sums = [np.bincount(index.ravel(), volumes * row) for row in place]
    return np.array(sums) / total, total


def _resolution(family: CellFamily, parameters: Mapping[str, float], low: float) -> int:
    """Voxels along a cell that put three across its thinnest wall.

    Raises
    ------
    CaseError
        If none of the grids does.
    """
    for resolution in RESOLUTIONS:
        if voxels_in_wall(family, parameters, low, family.period * resolution) >= LEAST_VOXELS:
            return resolution
    raise CaseError(
        f"the walls of cell '{family.name}' at density {low:.3g} are too thin for "
        f"{RESOLUTIONS[-1]} voxels along a cell, with which walls of few cells are computed; raise "
        f"the lower [lattice] density, or leave finite_size out"
    )


def _words(one: WallKind) -> str:
    return f"{one.upper - one.lower:.2f} cells across {'xyz'[one.axis]}"


def _class(
    family: CellFamily,
    parameters: Mapping[str, float],
    density: FloatArray,
    one: WallKind,
    resolution: int,
    poissons_ratio: float,
    at: FloatArray,
    before: Callable[[], None],
) -> WallClass:
    """Ratios of one kind of wall at all densities; `before` any is computed."""
    told = False

    def tell() -> None:
        nonlocal told
        if not told:
            before()
        told = True

    try:
        rows = [
            _cached(family, parameters, float(rho), one, resolution, poissons_ratio, tell)
            for rho in density
        ]
        return wall_class(
            np.array([r.solid for r in rows]),
            np.array([r.membrane for r in rows]),
            np.array([r.bending for r in rows]),
            np.array([r.shear for r in rows]),
        )
    except (DensityError, LatticeError, SolverError) as error:
        where = ", ".join(f"{v:.3g}" for v in at)
        raise CaseError(
            f"the part is a wall of {_words(one)} near ({where}) mm: {error}"
        ) from error


def _cached(
    family: CellFamily,
    parameters: Mapping[str, float],
    rho: float,
    one: WallKind,
    resolution: int,
    poissons_ratio: float,
    before: Callable[[], None],
) -> WallRatios:
    """Ratios from the user's cache, or computed after `before` and stored there."""
    complete = complete_parameters(family, parameters)
    values = evaluate_shape(family, complete, family.period * grid_nodes(16, (0.3, 0.3, 0.3)))
    # A cell that is the same with x, y, z exchanged in a cycle needs one axis only.
    cyclic = np.allclose(values, values.transpose(1, 2, 0), rtol=0, atol=1e-9 * np.ptp(values))
    axis = 0 if cyclic else one.axis
    key = content_key(
        family.name,
        repr(sorted(complete.items())),
        family.period,
        values,
        np.round([rho, one.lower, one.upper, poissons_ratio], 9),
        axis,
        resolution,
        METHOD_VERSION,
    )
    entry = load_arrays(_KIND, key)
    if entry is not None and {"solid", "membrane", "bending", "shear"} <= set(entry):
        return WallRatios(
            solid=float(entry["solid"]),
            membrane=entry["membrane"],
            bending=entry["bending"],
            shear=entry["shear"],
        )
    before()
    found = wall_ratios(
        family,
        parameters,
        rho,
        axis=axis,
        lower=one.lower,
        upper=one.upper,
        resolution=resolution,
        poissons_ratio=poissons_ratio,
    )
    store_arrays(
        _KIND,
        key,
        solid=np.array(found.solid),
        membrane=found.membrane,
        bending=found.bending,
        shear=found.shear,
    )
    return found
