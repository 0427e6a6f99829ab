"""Walls of few cells in a part: those about every tetrahedron, and their stiffness ratios."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.common.system.cache import content_key, load_arrays, store_arrays
from gradedesign.common.system.progress import counted
from gradedesign.errors import DensityError, LatticeError, ResourceError, SolverError
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.shape import evaluate_shape, grid_nodes
from gradedesign.geometry.maps.cell_map import CellMap
from gradedesign.geometry.tets.tet_mesh import TetMesh, centroids, signed_volumes
from gradedesign.mechanics.fe.collapsed_rule import collapsed_rule
from gradedesign.mechanics.homogenise.sampling import LEAST_VOXELS, voxels_in_wall
from gradedesign.mechanics.homogenise.wall_ratios import WallRatios, wall_ratios
from gradedesign.mechanics.sizing.wall_factors import WallClass, WallFactors, wall_class
from gradedesign.mechanics.sizing.wall_kinds import ALIKE, WallKind, wall_kinds

log = logging.getLogger(__name__)

#: Changes whenever a ratio would come out otherwise.
METHOD_VERSION = 1
#: Voxels along a cell: the first that puts three of them across the thinnest wall. Ratios hold
#: to 2 % with five across (one simple cubic cell, 22 against 44).
RESOLUTIONS = (24, 36, 48, 64)
#: Voxels of a wall that are worth the wait: half a minute of two processors at four densities.
MOST_VOXELS = 300_000
#: Voxels of all walls of a part: where they take more, walls that differ more are taken for one.
#: Two idle processors compute 200,000 in a minute at four densities.
MOST_TOGETHER, MOST_MINUTES = 900_000, 5
#: Densities between the bounds at which ratios are computed. Chosen, not measured.
DENSITIES = 4
#: Points along an edge of the rule that integrates profiles over a tetrahedron: 0.3 % of what 216
#: points give on a bracket of one cell.
RULE = 3
#: Walls without ratios that a warning names. Chosen, not measured.
NAMED = 3
_KIND = "wall-ratios"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WallMaterial:
    """Properties that all walls of a part share, at the densities of the design range."""

    cell: Cell
    density: FloatArray
    resolution: int
    poissons_ratio: float


def wall_material(cell: Cell, bounds: tuple[float, float], poissons_ratio: float) -> WallMaterial:
    """A cell at densities between the bounds, on the grid that its thinnest wall needs."""
    low, high = bounds
    density = np.geomspace(low, high, DENSITIES) if high > low else low * np.array([0.99, 1.01])
    density = np.clip(density, *cell.window)
    # Rounding must not leave the bounds outside.
    density[0], density[-1] = min(density[0], low), max(density[-1], high)
    return WallMaterial(
        cell=cell,
        density=density,
        resolution=wall_resolution(cell, low) or RESOLUTIONS[-1],
        poissons_ratio=poissons_ratio,
    )


def wall_factors(
    cell_map: CellMap,
    mesh: TetMesh,
    lattice: BoolArray,
    found: tuple[FloatArray, BoolArray],
    cells: WallMaterial,
    on_wall: Callable[[str], None] = log.info,
) -> tuple[WallFactors, tuple[str, ...]]:
    """Homogenise each kind of the walls of a part.

    Along each axis of the cells the part reaches from face to face through the centroid of a
    tetrahedron; where both faces are free and lie across the axis, this is a wall. Returns
    ``factors``: without the walls that are not known; ``warnings``: walls that count as periodic
    lattice, and why: those that take too many voxels, or do not hang together at a density that
    sizing may choose.

    ``cell_map``: straight cells of equal edges. ``lattice (M,)``: tetrahedra that hold lattice.
    ``found``: their walls by `wall_faces`.
    ``on_wall``: told of each kind of wall before it is computed; not of those in the user's cache.
    """
    points, weights = collapsed_rule(RULE)
    faces, axes = found
    volumes = signed_volumes(mesh) * lattice
    kinds, kind = affordable_kinds(faces, axes, volumes, cells)
    classes: list[WallClass] = []
    unknown: list[str] = []
    reasons: list[str] = []
    # The last entry stands for no wall.
    class_of_kind = np.full(len(kinds) + 1, -1)
    for number, wall in enumerate(counted(kinds, "wall", len(kinds))):
        before = partial(on_wall, f"wall {number + 1} of {len(kinds)}, {_words(wall)}")
        try:
            classes.append(_class(cells, wall, before))
        except (DensityError, LatticeError, ResourceError, SolverError) as error:
            at = centroids(mesh)[:, np.flatnonzero(kind[wall.axis] == number)[0]]
            unknown.append(f"{_words(wall)} near ({', '.join(f'{v:.3g}' for v in at)}) mm")
            reasons.append(str(error))
        else:
            class_of_kind[number] = len(classes) - 1
    kind = class_of_kind[kind]
    corners = cell_map(mesh.points)[:, mesh.tets]
    sample_points = np.einsum("dcm,qc->dqm", corners, points)
    middle = 0.5 * (faces[0] + faces[1])[:, None]
    half = np.maximum(0.5 * (faces[1] - faces[0])[:, None], 1e-9)
    height = np.where(kind[:, None] >= 0, (sample_points - middle) / half, 0.0)
    factors = WallFactors(
        density=cells.density,
        classes=tuple(classes),
        kind=kind,
        height=np.clip(height, -1.0, 1.0),
        points=points,
        weights=weights,
    )
    return factors, unknown_walls(unknown, reasons)


def affordable_kinds(
    faces: FloatArray, axes: BoolArray, volumes: FloatArray, cells: WallMaterial
) -> tuple[tuple[WallKind, ...], IntArray]:
    """Kinds of walls that can be computed together within the voxel budget, as fine as that allows.

    A sloped face makes walls of every thickness: on an angle block 31 kinds, for twelve minutes.
    """
    for alike in ALIKE:
        kinds, kind = wall_kinds(faces, axes, volumes, cells.cell.family, alike)
        voxels = [_voxels(cells, wall) for wall in kinds]
        if sum(count for count in voxels if count <= MOST_VOXELS) <= MOST_TOGETHER:
            break
    else:
        log.info("walls take %d voxels, more than %d", sum(voxels), MOST_TOGETHER)
    return kinds, kind


def _voxels(cells: WallMaterial, wall: WallKind) -> float:
    """Voxels of one period of a wall."""
    along = cells.cell.family.period * cells.resolution
    return along**2 * (wall.upper - wall.lower) * cells.resolution


def unknown_walls(walls: Sequence[str], reasons: Sequence[str]) -> tuple[str, ...]:
    """One warning on all walls without ratios, with the reason of the first."""
    if not walls:
        return ()
    log.info("walls without ratios: %s", "; ".join(walls))
    of_how_many = f" (the first of {len(walls)})" if len(walls) > 1 else ""
    more = len(walls) - NAMED
    others = f" and {more} other kinds" if more > 1 else " and another kind" if more == 1 else ""
    return (
        f"walls of {'; '.join(walls[:NAMED])}{others} count as periodic lattice in sizing, which "
        f"explicit analyses correct: {reasons[0]}{of_how_many}",
    )


def wall_resolution(cell: Cell, low: float) -> int | None:
    """Voxels along a cell that put three across its thinnest wall; None where no grid does."""
    for resolution in RESOLUTIONS:
        if voxels_in_wall(cell, low, cell.family.period * resolution) >= LEAST_VOXELS:
            return resolution
    return None


def _words(wall: WallKind) -> str:
    return f"{wall.upper - wall.lower:.2f} cells across {'xyz'[wall.axis]}"


def _class(cells: WallMaterial, wall: WallKind, before: Callable[[], None]) -> WallClass:
    """Ratios of one kind of wall at all densities; `before` is called where any is computed.

    Raises `ResourceError` if the wall takes more than `MOST_VOXELS`, and `DensityError` or
    `LatticeError` or `SolverError` if it has no ratios.
    """
    voxels = _voxels(cells, wall)
    if voxels > MOST_VOXELS:
        raise ResourceError(f"they take {voxels:.2g} voxels, more than {MOST_VOXELS:g}")
    rows = _ratios(cells, wall, before)
    return wall_class(
        np.array([r.solid for r in rows]),
        np.array([r.membrane for r in rows]),
        np.array([r.bending for r in rows]),
        np.array([r.shear for r in rows]),
    )


def _ratios(cells: WallMaterial, wall: WallKind, before: Callable[[], None]) -> list[WallRatios]:
    """Ratios by density from the user's cache, or computed and stored there."""
    axis = 0 if _cyclic(cells) else wall.axis
    keys = [_key(cells, wall, axis, float(rho)) for rho in cells.density]
    rows = [_stored(key) for key in keys]
    if None in rows:
        before()
    steps = zip(rows, cells.density, keys, strict=True)
    return [
        row or _computed(cells, wall, axis, float(rho), key)
        for row, rho, key in counted(steps, "density", len(keys))
    ]


def _samples(cells: WallMaterial) -> FloatArray:
    """Values of the cell on a coarse grid, which identify it."""
    points = cells.cell.family.period * grid_nodes(16, (0.3, 0.3, 0.3))
    return evaluate_shape(cells.cell.family, cells.cell.parameters, points)


def _cyclic(cells: WallMaterial) -> bool:
    """The cell is the same with x, y, z exchanged in a cycle, so that it needs one axis only."""
    values = _samples(cells)
    turned = values.transpose(1, 2, 0)
    return bool(np.allclose(values, turned, rtol=0, atol=1e-9 * np.ptp(values)))


def _key(cells: WallMaterial, wall: WallKind, axis: int, rho: float) -> str:
    return content_key(
        cells.cell.name,
        repr(sorted(cells.cell.parameters.items())),
        cells.cell.family.period,
        _samples(cells),
        np.round([rho, wall.lower, wall.upper, cells.poissons_ratio], 9),
        axis,
        cells.resolution,
        METHOD_VERSION,
    )


def _stored(key: str) -> WallRatios | None:
    entry = load_arrays(_KIND, key)
    if entry is None or not {"solid", "membrane", "bending", "shear"} <= set(entry):
        return None
    return WallRatios(
        solid=float(entry["solid"]),
        membrane=entry["membrane"],
        bending=entry["bending"],
        shear=entry["shear"],
    )


def _computed(cells: WallMaterial, wall: WallKind, axis: int, rho: float, key: str) -> WallRatios:
    ratios = wall_ratios(
        cells.cell,
        rho,
        axis=axis,
        lower=wall.lower,
        upper=wall.upper,
        resolution=cells.resolution,
        poissons_ratio=cells.poissons_ratio,
    )
    store_arrays(
        _KIND,
        key,
        solid=np.array(ratios.solid),
        membrane=ratios.membrane,
        bending=ratios.bending,
        shear=ratios.shear,
    )
    return ratios
