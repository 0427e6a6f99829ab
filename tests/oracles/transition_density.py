"""Density of a transition between two families, cell by cell."""

import numpy as np

from gradedesign.geometry.cell.shape import spread_points


def density_error(transition, density, *, length=2, pure=1):
    """Largest error of the density of a slab of one cell, by evenly spread points."""
    points = spread_points(40_000)
    worst = 0.0
    for n in range(2 * pure + length):
        u = points + np.array([[n], [0], [0]])
        s = np.clip((u[0] - pure) / length, 0.0, 1.0)
        share = s**2 * (3 - 2 * s)
        values = transition.shape(np.concatenate([u, [1 - share, share]]))
        worst = max(worst, abs(float(np.mean(values <= density)) - density))
    return worst
