"""Relative density on a regular grid, the form in which a lattice is built from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from gradedesign.arrays import FloatArray, lock
from gradedesign.errors import DensityError, ResourceError
from gradedesign.geometry.contour.sample import grid_points
from gradedesign.geometry.lattice._density_kernels import trilinear
from gradedesign.geometry.tets.tet_mesh import TetMesh, centroids, signed_volumes

#: Elements that share in the density of a grid node. Chosen, not measured.
_NEIGHBOURS = 24
#: Memory for a node: its place and its density, and what batches of neighbours share.
_BYTES_PER_NODE = 48


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DensityGrid:
    """Node values of relative density."""

    origin: FloatArray  #: ``(3,)``, mm. First node.
    spacing: float  #: mm. The same along x, y, z.
    values: FloatArray  #: ``(nx, ny, nz)``. Relative density, 0 to 1.

    def __post_init__(self) -> None:
        lock(self, origin=(3,), values=(None, None, None))
        if not self.spacing > 0 or self.values.size == 0:
            raise ValueError(
                f"a density grid needs a positive spacing and nodes, got {self.spacing:g} mm "
                f"and shape {self.values.shape}"
            )
        if self.values.min() < 0 or self.values.max() > 1:
            raise DensityError(
                f"relative densities range from {self.values.min():g} to {self.values.max():g}, "
                f"expected values from 0 to 1"
            )


def evaluate(grid: DensityGrid, points: FloatArray) -> FloatArray:
    """Relative density at points ``(3, ...)`` mm, trilinear; constant beyond the outer nodes."""
    points = np.asarray(points, dtype=np.float64)
    flat = np.ascontiguousarray(points.reshape(3, -1))
    return trilinear(grid.values, grid.origin, grid.spacing, flat).reshape(points.shape[1:])


def density_grid_from_elements(
    mesh: TetMesh,
    rho: FloatArray,
    *,
    spacing: float,
    margin: float,
    memory_limit_bytes: float = 8e9,
) -> DensityGrid:
    """Spread element densities over a grid that covers the mesh and a margin.

    Each node takes a weighted mean of the 24 nearest elements, weight = element volume times ``(1 -
    (d / R)^2)^2`` with d the distance to the centroid and R that of the 25th. The weight vanishes
    smoothly at R, so walls get no steps; it is a mean, so no node leaves the range of ``rho``; and
    a constant stays a constant. Peaks narrower than an element are lowered. Nodes outside the part
    continue what is nearest.

    Raises DensityError if ``rho`` does not match the mesh, or a value is not finite. Raises
    ResourceError if the grid takes more memory.

    - ``rho (m,)``: relative density of every element
    - ``spacing``, mm: of the grid; about half an element is enough
    - ``margin``, mm: by which the grid is larger than the mesh on every side
    - ``memory_limit_bytes``: what the grid may take
    """
    rho = np.asarray(rho, dtype=np.float64)
    if rho.shape != (mesh.tets.shape[1],) or rho.size == 0 or not np.isfinite(rho).all():
        raise DensityError(
            f"element densities have shape {rho.shape} (or hold values that are not finite), "
            f"expected one finite value for each of {mesh.tets.shape[1]} elements"
        )
    if not spacing > 0 or margin < 0:
        raise DensityError(
            f"spacing {spacing:g} mm and margin {margin:g} mm: expected a positive spacing and "
            f"a margin of at least 0"
        )
    lower = mesh.points.min(axis=1) - margin
    upper = mesh.points.max(axis=1) + margin
    count = np.ceil((upper - lower) / spacing - 1e-9) + 1
    if not count.prod() * _BYTES_PER_NODE <= memory_limit_bytes:  # also where it is not finite
        size = " x ".join(f"{n:.4g}" for n in upper - lower)
        raise ResourceError(
            f"a density grid at {spacing:g} mm over elements of {size} mm has {count.prod():.3g} "
            f"nodes, about {count.prod() * _BYTES_PER_NODE / 1e9:.3g} GB; found run.memory of "
            f"{memory_limit_bytes / 1e9:.3g} GB; raise it or use larger cells, if the elements are "
            f"those of the part in mm"
        )
    x, y, z = (int(n) for n in count)
    nodes = grid_points(lower, (0, 0, 0), (x, y, z), spacing).reshape(3, -1)
    values = _weighted_mean(mesh, rho, nodes)
    return DensityGrid(origin=lower, spacing=spacing, values=values.reshape(x, y, z))


def _weighted_mean(mesh: TetMesh, rho: FloatArray, nodes: FloatArray) -> FloatArray:
    volume = signed_volumes(mesh)
    near = min(_NEIGHBOURS, rho.size - 1)
    if near == 0:
        return np.full(nodes.shape[1], rho[0])
    tree = cKDTree(centroids(mesh).T)
    result = np.zeros(nodes.shape[1])
    for low in range(0, nodes.shape[1], 1 << 17):
        part = slice(low, low + (1 << 17))
        distance, element = tree.query(nodes[:, part].T, k=near + 1)
        reach = distance[:, -1:]
        weight = volume[element[:, :-1]] * (1 - (distance[:, :-1] / reach) ** 2) ** 2
        # All neighbours at the same distance: the weights vanish together, so weigh by volume.
        tie = ~(weight.sum(axis=1) > 0)
        weight[tie] = volume[element[tie, :-1]]
        share = weight / weight.sum(axis=1, keepdims=True)
        result[part] = (share * rho[element[:, :-1]]).sum(axis=1)
    return np.clip(result, rho.min(), rho.max())  # removes the last bit of rounding only
