"""The box primitive."""

from __future__ import annotations

import numpy as np

from gradedesign.errors import CaseError
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh


def box_surface(size: tuple[float, float, float]) -> SurfaceMesh:
    """Surface of the box ``[0, a] x [0, b] x [0, c]``, twelve triangles.

    Raises CaseError if a side is not positive and finite.

    ``size``: (3,) floats, mm.

    Examples
    --------
    >>> from gradedesign.geometry.triangles.surface_mesh import enclosed_volume
    >>> enclosed_volume(box_surface((2.0, 3.0, 4.0)))
    24.0
    """
    sides = np.array(size, dtype=np.float64)
    if sides.shape != (3,) or not np.isfinite(sides).all() or (sides <= 0).any():
        raise CaseError(f"part.box has sides {list(size)} mm; give three positive lengths")
    index = np.arange(8)
    unit = np.stack([index & 1, index >> 1 & 1, index >> 2 & 1], axis=1)
    quads = np.array(
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    )
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return SurfaceMesh(vertices=unit * sides, faces=faces)
