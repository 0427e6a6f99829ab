"""Which share of every tetrahedron of the part stays solid: skin and kept regions."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.lattice.lattice import KeptRegion
from gradedesign.mesh.tet_mesh import TetMesh

#: Sample points per edge when the solid share of a tetrahedron is counted.
SHARE_SAMPLES = 4


def solid_share(
    mesh: TetMesh, distance: Field, skin: float | None, kept: tuple[KeptRegion, ...]
) -> FloatArray:
    """Share of every tetrahedron that stays solid, counted on interior points, ``(M,)``."""
    count = mesh.tets.shape[1]
    if skin is None and not kept:
        return np.zeros(count)
    weights = _interior_weights(SHARE_SAMPLES)
    corners = mesh.points[:, mesh.tets]
    points = np.einsum("dcm,qc->dqm", corners, weights)
    solid = np.zeros(points.shape[1:], dtype=bool)
    if skin is not None:
        solid |= distance(points) > -skin
    for region in kept:
        solid |= region.distance(points) < region.margin
    return np.asarray(solid.mean(axis=0), dtype=np.float64)


def _interior_weights(n: int) -> FloatArray:
    """Barycentric coordinates of evenly spread interior points, ``(k, 4)``."""
    return np.array(
        [
            ((i + 0.25) / n, (j + 0.25) / n, (k + 0.25) / n, (n - 1 - i - j - k + 0.25) / n)
            for i in range(n)
            for j in range(n - i)
            for k in range(n - i - j)
        ]
    )
