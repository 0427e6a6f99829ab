"""Cell maps: from points in mm to cell coordinates."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import CaseError


def uniform_map(
    size: float | Sequence[float],
    origin: Sequence[float] = (0.0, 0.0, 0.0),
    rotation: FloatArray | None = None,
) -> Callable[[FloatArray], FloatArray]:
    """Map of equal cells.

    Parameters
    ----------
    size : float or (3,) sequence, mm
        Edge of the cell, or one edge for each cell axis.
    origin : (3,) sequence, mm
        Where a corner of a cell lies.
    rotation : (3, 3) array, optional
        Columns are the cell axes in global coordinates.

    Returns
    -------
    callable
        Points ``(3, ...)`` in mm to cell coordinates ``(3, ...)``, period 1.

    Raises
    ------
    CaseError
        If a size is not positive or the matrix is not a rotation.

    Examples
    --------
    >>> to_cell = uniform_map(50.0, origin=(10.0, 0.0, 0.0))
    >>> to_cell(np.array([60.0, 25.0, 0.0])).tolist()
    [1.0, 0.5, 0.0]
    """
    edges = np.broadcast_to(np.asarray(size, dtype=np.float64), (3,))
    if not (np.isfinite(edges).all() and (edges > 0).all()):
        raise CaseError(f"cell size {edges.tolist()} mm is impossible; use positive lengths")
    start = np.asarray(origin, dtype=np.float64)
    axes = np.eye(3) if rotation is None else np.array(rotation, dtype=np.float64)
    if axes.shape != (3, 3) or not (
        np.allclose(axes.T @ axes, np.eye(3), atol=1e-9) and np.linalg.det(axes) > 0
    ):
        raise CaseError(
            f"the cell rotation {axes.tolist()} is not a rotation matrix; its columns must be "
            f"three right-handed orthogonal unit vectors"
        )
    matrix = (axes / edges).T

    def to_cell(points: FloatArray) -> FloatArray:
        x = np.asarray(points, dtype=np.float64)
        shifted = x - start.reshape(3, *[1] * (x.ndim - 1))
        if rotation is None:
            return shifted / edges.reshape(3, *[1] * (x.ndim - 1))
        return np.tensordot(matrix, shifted, axes=1)

    return to_cell
