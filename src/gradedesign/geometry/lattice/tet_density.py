"""Densities, and tensors, from a field on tetrahedra."""

from __future__ import annotations

from typing import Literal

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.errors import DensityError
from gradedesign.geometry.lattice.density_grid import density_grid_from_elements, evaluate
from gradedesign.geometry.lattice.density_source import DensitySource
from gradedesign.geometry.tets.point_location import build_locator, locate
from gradedesign.geometry.tets.tet_mesh import TetMesh


def tet_density(
    mesh: TetMesh,
    values: FloatArray,
    *,
    at: Literal["points", "elements"],
    spacing: float,
    reach: float,
    memory_limit_bytes: float = 8e9,
) -> DensitySource:
    """Density of a field on tetrahedra.

    Values at points are interpolated inside each tetrahedron and go on outside with the nearest
    point of the mesh. Values of elements are spread over a grid just as the densities are that
    sizing finds, so the densities of a run give that run's lattice.

    Parameters
    ----------
    values : (n,) or (m,) array
        Relative density, at points or of elements.
    at : {"points", "elements"}
    spacing : float, mm
        Of the grid for elements.
    reach : float, mm
        Points farther from the mesh are refused: another part, or another unit of length.
    memory_limit_bytes : float
        What the grid may take.

    Raises
    ------
    DensityError
        If the values do not fit the mesh. The source raises it for points that are too far.
    ResourceError
        If the grid takes more memory.

    Examples
    --------
    >>> corners = np.array([[0.0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    >>> mesh = TetMesh(points=corners, tets=np.array([[0], [1], [2], [3]]))
    >>> density = tet_density(
    ...     mesh, np.array([0.2, 0.6, 0.2, 0.2]), at="points", spacing=0.5, reach=1.0
    ... )
    >>> density(np.array([[0.5], [0.0], [0.0]])).round(6)
    array([0.4])
    """
    expected = mesh.points.shape[1] if at == "points" else mesh.tets.shape[1]
    if values.shape != (expected,) or not np.isfinite(values).all():
        raise DensityError(
            f"a field at {at} of shape {values.shape} (or with values that are not finite); "
            f"expected {expected} finite numbers"
        )
    grid = None
    if at == "elements":
        grid = density_grid_from_elements(
            mesh,
            values,
            spacing=spacing,
            margin=2 * spacing,
            memory_limit_bytes=memory_limit_bytes,
        )
    locator = build_locator(mesh)

    def density(points: FloatArray) -> FloatArray:
        flat = np.asarray(points, dtype=np.float64).reshape(3, -1)
        tets, weights, apart = locate(mesh, flat, locator=locator)
        if apart.size and apart.max() > reach:
            x, y, z = flat[:, int(apart.argmax())]
            raise DensityError(
                f"the mesh of the densities ends {apart.max():.4g} mm from ({x:.4g}, {y:.4g}, "
                f"{z:.4g}) mm, a point of the part; expected at most {reach:.4g} mm: is it the "
                f"mesh of this part, in mm?"
            )
        if grid is not None:
            return evaluate(grid, points)
        interpolated = np.einsum("cn,cn->n", weights, values[mesh.tets[:, tets]])
        return np.asarray(interpolated).reshape(points.shape[1:])

    return density


def tet_tensors(mesh: TetMesh, values: FloatArray, at: Literal["points", "elements"]) -> Field:
    """Tensors of a field on tetrahedra, that of the nearest one outside.

    Parameters
    ----------
    values : (n, 3, 3) or (m, 3, 3) array
        At points or of elements.

    Returns
    -------
    callable
        Points ``(3, ...)`` mm to tensors ``(3, 3, ...)``.

    Examples
    --------
    >>> corners = np.array([[0.0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    >>> mesh = TetMesh(points=corners, tets=np.array([[0], [1], [2], [3]]))
    >>> stress = tet_tensors(mesh, np.diag([5.0, 2, 1])[None], "elements")
    >>> stress(np.full((3, 1), 0.2))[0, 0]
    array([5.])
    """
    locator = build_locator(mesh)

    def read(points: FloatArray) -> FloatArray:
        flat = np.asarray(points, dtype=np.float64).reshape(3, -1)
        tets, weights, _ = locate(mesh, flat, locator=locator)
        if at == "elements":
            tensor = values[tets]
        else:
            tensor = np.einsum("cn,cnij->nij", weights, values[mesh.tets[:, tets]])
        return np.moveaxis(tensor, 0, -1).reshape(3, 3, *points.shape[1:])

    return read
