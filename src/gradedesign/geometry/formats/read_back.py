"""A file of triangles compared with the surface that was written to it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gradedesign.errors import ResourceError
from gradedesign.geometry.triangles._triangle_kernels import cone_volume, directed_balance
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, enclosed_volume

#: Largest relative change of the enclosed volume by rounding to float32. Chosen, not measured.
_VOLUME_TOLERANCE = 1e-3


def require_read_back(
    path: Path, pieces: Iterable[NDArray[np.floating]], surface: SurfaceMesh, holds: str = ""
) -> None:
    """Compare count, closedness and volume of the triangles of a file with those of a surface.

    Parameters
    ----------
    pieces : iterable of (k, 3, 3) arrays, mm
        Corners of the triangles, some at a time.
    holds : str
        Size of the file in words, for the message.

    Raises
    ------
    ResourceError
        If they differ.

    Examples
    --------
    At the end of an exporter, which reads its own file again, some triangles at a time::

        require_read_back(path, pieces_of(path), surface)
    """
    volume, middle = enclosed_volume(surface), surface.vertices.mean(axis=0)
    count, balance, enclosed = 0, 0, 0.0
    for corners in pieces:
        count += len(corners)
        balance += edge_balance(corners)
        enclosed += cone_volume(corners.astype(np.float64), *middle)
    closed = balance % 2**64 == 0
    if (
        count != len(surface.faces)
        or not closed
        or not abs(enclosed - volume) <= _VOLUME_TOLERANCE * abs(volume)
    ):
        raise ResourceError(
            f"{path} reads back as {holds}{count} triangles that {'' if closed else 'do not '}"
            f"close, {enclosed:g} mm^3; expected {len(surface.faces)} that close, {volume:g} mm^3 "
            f"within 0.1 %; check the disk and write it again"
        )


def edge_balance(corners: NDArray[np.floating]) -> int:
    """Sum of a hash over the directed edges of triangles, less that over the reversed edges.

    Sums of pieces add up modulo 2^64. The sum over a surface is 0 where every edge is passed as
    often in one direction as in the other: it is closed and consistently oriented. Any other
    surface has 0 with a probability of 2^-64.

    ``corners (m, 3, 3)``: triangle, corner, coordinate; equal corners are the same float32.

    Examples
    --------
    >>> a, b, c, d = np.eye(4)[:, :3]
    >>> edge_balance(np.array([[b, a, c], [a, b, d], [b, c, d], [c, a, d]]))
    0
    >>> edge_balance(np.array([[a, b, c], [a, b, d], [b, c, d], [c, a, d]])) != 0
    True
    """
    exact = np.ascontiguousarray(corners, dtype=np.float32) + np.float32(0.0)  # no negative zero
    return int(directed_balance(exact.view(np.uint32)))
