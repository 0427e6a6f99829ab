"""A file of triangles compared with the surface that was written to it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gradedesign.errors import ResourceError
from gradedesign.geometry.triangles._triangle_kernels import cone_volume
from gradedesign.geometry.triangles.edge_balance import edge_balance
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
