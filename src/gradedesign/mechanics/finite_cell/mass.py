"""Consistent mass of finite cells, by the weights that integrate their stiffness.

The void of cut elements is massless, though it keeps a little stiffness: a soft void that weighed
something would vibrate by itself.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.finite_cell.basis import (
    CUT_POINTS,
    gauss_places,
    gauss_weights,
    shapes_at,
)
from gradedesign.mechanics.finite_cell.elements import Elements, element_volumes
from gradedesign.mechanics.finite_cell.hanging import fill_hanging, gather_hanging
from gradedesign.mechanics.finite_cell.space import BrickSpace

#: Elements worked on at once: their values at the Gauss points stay in the cache. Chosen, not
#: measured.
_CHUNK = 512


def mass_product(
    elements: Elements, space: BrickSpace, density: float, u: FloatArray
) -> FloatArray:
    """Product of the mass matrix with nodal values ``(N, 3)``, whose hanging rows are set.

    ``space``: of order 2. ``density``, t/mm^3.
    """
    fill_hanging(space.hanging, u)
    out = np.zeros_like(u)
    shapes = shapes_at(gauss_places(CUT_POINTS))
    whole = shapes.T @ (gauss_weights(CUT_POINTS)[:, None] * shapes)
    masses = density * element_volumes(elements)
    for colours in elements.colours:
        # Elements of one colour share no node, so that their forces are added at once.
        for low, high in pairwise(colours.tolist()):
            for first in range(low, high, _CHUNK):
                part = slice(first, min(first + _CHUNK, high))
                nodes, count = space.nodes[part], min(first + _CHUNK, high) - first
                own = (masses[part, None, None] * u[nodes]).transpose(1, 0, 2).reshape(27, -1)
                if first < elements.whole:
                    force = whole @ own
                else:
                    weights = elements.weights[first - elements.whole :][:count].T
                    at = (shapes @ own).reshape(-1, count, 3)
                    at *= weights[:, :, None]
                    force = shapes.T @ at.reshape(len(at), -1)
                out[nodes] += force.reshape(27, count, 3).transpose(1, 0, 2)
    gather_hanging(space.hanging, out)
    return out
