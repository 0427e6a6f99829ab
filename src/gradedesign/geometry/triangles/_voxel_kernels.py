"""Compiled voxels of a closed surface: the winding number at every centre of a grid."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit, prange

from gradedesign.geometry.triangles._column_kernels import _coverage, _height


@njit(cache=True)
def add_triangles(corners, steps):
    """Add to every column where its winding number changes, seen from above.

    ``corners`` are in grid steps from the first centre. ``steps[i, j, k]`` receives what changes
    below a triangle between the centres k and k + 1 of the column; nothing where all lie above it.
    """
    nx, ny, nz = steps.shape
    for t in range(len(corners)):
        i0 = max(0, int(np.floor(corners[t, :, 0].min())))
        i1 = min(nx - 1, int(np.ceil(corners[t, :, 0].max())))
        j0 = max(0, int(np.floor(corners[t, :, 1].min())))
        j1 = min(ny - 1, int(np.ceil(corners[t, :, 1].max())))
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                covered = _coverage(corners, t, float(i), float(j))
                if covered != 0:
                    k = int(np.ceil(_height(corners, t, float(i), float(j)))) - 1
                    if k >= 0:
                        steps[i, j, min(k, nz - 1)] += covered


@njit(cache=True, parallel=True, nogil=True)
def fill_solid(steps, solid):
    """Mask of the voxels whose winding number, the sum of all steps from above, is at least 1."""
    nx, ny, nz = steps.shape
    for i in prange(nx):
        for j in range(ny):
            winding = 0
            for k in range(nz - 1, -1, -1):
                winding += steps[i, j, k]
                solid[i, j, k] = winding > 0
