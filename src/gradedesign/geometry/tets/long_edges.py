"""Bisection of the tetrahedra whose edges are longer than a stated length."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.geometry.tets.tet_mesh import TetMesh, signed_volumes

if TYPE_CHECKING:
    import skfem


def longest_edges(mesh: TetMesh) -> FloatArray:
    """Longest edge of every tetrahedron, ``(m,)``, mm."""
    squared = np.zeros(mesh.tets.shape[1])
    for a, b in combinations(range(4), 2):
        edge = mesh.points[:, mesh.tets[a]] - mesh.points[:, mesh.tets[b]]
        np.maximum(squared, np.einsum("ij,ij->j", edge, edge), out=squared)
    return np.sqrt(squared)


def bisect_long_edges(mesh: TetMesh, longest: float) -> TetMesh:
    """Bisect tetrahedra at their longest edge until no edge is longer than a stated length.

    The mesh stays conforming and fills exactly what it filled (scikit-fem's longest-edge
    bisection). Rivara's closure also bisects neighbours of the tetrahedra that are too long.

    Returns TetMesh: the same object where no edge is too long; else the points keep their numbers
    and new ones follow. Raises ValueError if the length is not positive.

    ``longest``: mm.
    """
    if not 0.0 < longest < np.inf:
        raise ValueError(f"the longest edge must be positive, not {longest} mm")
    marked = np.flatnonzero(longest_edges(mesh) > longest)
    if marked.size == 0:
        return mesh
    import skfem

    refined: skfem.MeshTet = skfem.MeshTet(
        np.ascontiguousarray(mesh.points), np.ascontiguousarray(mesh.tets)
    )
    with _without_layout_warnings():
        while marked.size:
            refined = refined.refined(marked)
            mesh = _oriented(refined.p, refined.t)
            marked = np.flatnonzero(longest_edges(mesh) > longest)
    return mesh


@contextmanager
def _without_layout_warnings() -> Iterator[None]:
    """Suppress warnings about the memory layout inside scikit-fem's bisection."""
    logger = logging.getLogger("skfem.mesh.mesh")
    logger.addFilter(_is_not_layout)
    try:
        yield
    finally:
        logger.removeFilter(_is_not_layout)


def _is_not_layout(record: logging.LogRecord) -> bool:
    return "C_CONTIGUOUS" not in record.getMessage()


def least_count(volume: float, longest: float) -> float:
    """Tetrahedra that a volume needs at least where no edge is longer: regular ones.

    ``volume``, mm^3. ``longest``, mm.
    """
    return 6.0 * math.sqrt(2.0) * volume / longest**3


def _oriented(points: FloatArray, tets: np.ndarray) -> TetMesh:
    """Swap two corners of the tetrahedra of negative volume: bisection forgets orientation."""
    mesh = TetMesh(points=points, tets=tets)
    turned = signed_volumes(mesh) < 0.0
    tets = np.array(mesh.tets)
    tets[:2, turned] = tets[1::-1, turned]
    return TetMesh(points=points, tets=tets)
