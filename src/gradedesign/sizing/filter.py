"""Density filters: from design variables to the density of every tetrahedron."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix, diags
from scipy.spatial import cKDTree

from gradedesign.arrays import FloatArray
from gradedesign.errors import DensityError


def cone_filter(points: FloatArray, volumes: FloatArray, radius: float) -> csr_matrix:
    """Row-stochastic filter with linearly falling, volume-weighted kernel.

    Parameters
    ----------
    points : (3, M) array, mm
        Centroids.
    volumes : (M,) array, mm^3
    radius : float, mm
        Where the kernel reaches zero.

    Returns
    -------
    (M, M) csr_matrix
        ``rho = H x``.

    References
    ----------
    T. E. Bruns, D. A. Tortorelli, Comput. Methods Appl. Mech. Eng. 190, 2001.
    """
    if not radius > 0:
        raise DensityError(f"filter radius is {radius:g} mm, expected a positive length")
    tree = cKDTree(points.T)
    pairs = tree.sparse_distance_matrix(tree, radius, output_type="coo_matrix")
    weight = (radius - pairs.data) * volumes[pairs.col]
    count = points.shape[1]
    kernel = csr_matrix((weight, (pairs.row, pairs.col)), shape=(count, count))
    # The distance matrix drops the zero distance of a point to itself.
    missing = radius * volumes - kernel.diagonal()
    kernel = kernel + diags(missing)
    return csr_matrix(diags(1.0 / np.asarray(kernel.sum(axis=1)).ravel()) @ kernel)


def uniform_filter(count: int) -> csr_matrix:
    """Filter of one variable: every tetrahedron has the same density."""
    return csr_matrix(np.ones((count, 1)))
