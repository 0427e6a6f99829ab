"""Winding numbers by the plain formula, an oracle of those that are found by trees and columns."""

import numpy as np


def plain_windings(corners, points):
    """Solid angles of triangles ``(m, 3, 3)`` from points ``(3, n)``, over 4 pi, ``(n,)``.

    Van Oosterom & Strackee, "The solid angle of a plane triangle", IEEE Transactions on Biomedical
    Engineering 30, 125-126, 1983, eq. 8.
    """
    total = np.zeros(points.shape[1])
    for k, point in enumerate(points.T):
        a, b, c = np.moveaxis(corners - point, 1, 0)
        la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
        below = (
            la * lb * lc
            + np.einsum("ij,ij->i", a, b) * lc
            + np.einsum("ij,ij->i", b, c) * la
            + np.einsum("ij,ij->i", c, a) * lb
        )
        triple = np.einsum("ij,ij->i", a, np.cross(b, c))
        total[k] = np.arctan2(triple, below).sum() / (2 * np.pi)
    return total
