"""Effective density of the lattice beside passive regions, counted in samples of its cells."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import map_coordinates, uniform_filter

from gradedesign.arrays import BoolArray, Field, FloatArray
from gradedesign.errors import LatticeError, ResourceError
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.shape import evaluate_shape
from gradedesign.geometry.lattice.domain import DesignDomain, solid_at
from gradedesign.geometry.maps.cell_map import CellMap
from gradedesign.geometry.tets.tet_mesh import TetMesh, centroids
from gradedesign.mechanics.sizing.effective_density import EffectiveDensity

#: Samples along a cell, and how many samples in all are worth the wait. Chosen, not measured.
PER_CELL = 12
#: More would take too long beside what they change. Chosen, not measured.
MOST_SAMPLES = 40_000_000
#: Densities at which cells are counted. Chosen, not measured.
DENSITIES = 7
#: A neighbourhood without any solid counts as holding this share of the nominal density: stiffness
#: must stay positive definite. Chosen, not measured.
LEAST_SHARE = 0.1
#: Share of a neighbourhood below which it holds no lattice at all. Chosen, not measured.
_NO_LATTICE = 1e-3
#: Densities about a single one.
_AROUND = np.array([0.98, 1.02])
#: Samples that are evaluated at a time. Bounds the memory of one step; the result does not depend
#: on it. Chosen, not measured.
_BATCH = 1_000_000


def density_beside_solids(
    to_cells: CellMap,
    mesh: TetMesh,
    cell: Cell,
    bounds: tuple[float, float],
    domain: DesignDomain,
) -> EffectiveDensity:
    """Density of a block of one period about every tetrahedron, outside passive regions.

    The lattice goes on beyond the part: what its faces cut is the walls' to say. The block is
    exactly one period of the cell, so that away from passive regions the effective density is the
    nominal one, wherever the block lies in the cells. Raises `ResourceError` if the part has too
    many cells.
    """
    u = to_cells(mesh.points)
    period = cell.family.period
    low = period * (np.floor(u.min(axis=1) / period) - 1)
    high = period * (np.ceil(u.max(axis=1) / period) + 1)
    cells = (high - low).astype(int)
    if np.prod(cells) * PER_CELL**3 > MOST_SAMPLES:
        raise ResourceError(
            f"counting the solid of {np.prod(cells)} cells beside passive regions needs more than "
            f"{MOST_SAMPLES:g} samples: sizing takes their density for that of whole cells"
        )
    axes = [low[i] + (np.arange(cells[i] * PER_CELL) + 0.5) / PER_CELL for i in range(3)]
    if to_cells.inverse is None:
        raise LatticeError(f"the {to_cells.name} cell map has no straight cells to count in")
    inside = _outside_solids(axes, to_cells.inverse, domain)
    axis = (np.arange(PER_CELL * period) + 0.5) / PER_CELL
    samples = np.array(np.meshgrid(axis, axis, axis, indexing="ij"))
    shape = evaluate_shape(cell.family, cell.parameters, samples)
    # A mean over an even number of samples stands for the face between its two middle ones.
    index = (to_cells(centroids(mesh)) - low[:, None]) * PER_CELL

    def near(values: BoolArray) -> FloatArray:
        mean = uniform_filter(values.astype(np.float32), PER_CELL * period, mode="constant")
        return np.asarray(map_coordinates(mean, index, order=1), dtype=np.float64)

    share = near(inside)
    nominal = np.geomspace(*bounds, DENSITIES) if bounds[1] > bounds[0] else bounds[0] * _AROUND
    effective = np.zeros((nominal.size, share.size))
    for row, rho in zip(effective, nominal, strict=True):
        solid = shape <= cell.level_of(np.asarray(rho))
        there = near(np.tile(solid, cells // period) & inside)
        # Against the same samples of the whole cell, which hold not quite the density.
        lattice_share = np.maximum(share, _NO_LATTICE)
        held_share = np.where(share > _NO_LATTICE, there / lattice_share, solid.mean())
        row[:] = rho * np.maximum(held_share / solid.mean(), LEAST_SHARE)
    return EffectiveDensity(nominal=nominal, effective=_increasing(effective))


def _outside_solids(axes: list[FloatArray], to_points: Field, domain: DesignDomain) -> BoolArray:
    """Whether samples lie outside every passive region."""
    count = [a.size for a in axes]
    inside = np.ones(int(np.prod(count)), dtype=bool)
    for start in range(0, inside.size, _BATCH):
        some = np.arange(start, min(start + _BATCH, inside.size))
        u = np.array([a[i] for a, i in zip(axes, np.unravel_index(some, count), strict=True)])
        inside[some] = ~solid_at(domain, to_points(u))
    return inside.reshape(count)


def _increasing(effective: FloatArray) -> FloatArray:
    """Effective densities that grow at least a little with the nominal density.

    Where a neighbourhood's few samples of solid stay the same, the next nominal density brings
    no more of them.
    """
    growing = np.maximum.accumulate(effective, axis=0)
    steps = 1e-6 * np.arange(len(effective))[:, None]
    return np.asarray(growing * (1 + steps))
