"""Hexagonal and triangular honeycombs along z, slotted.

Both repeat in a rectangle of 1 by sqrt(3). They are computed in ``p = (u_x, sqrt(3) u_y, u_z)``, in
units of the cell's edge along x: in a cell of edges (a, sqrt(3) a, h) hexagons and triangles are
regular and plates equally thick; in a cubic cell everything is squeezed along y by 1 / sqrt(3).

Hexagons have the distance 1 between opposite sides, with centres at (0, 0) and (1/2, sqrt(3)/2):
``d = 1/2 - max_k |(p - c) . n_k|``, n_k at 0, 60 and 120 degrees, c the nearest centre. Triangles
are bounded by lines along 0, 60 and 120 degrees, sqrt(3) / 2 apart. Slots as in `slotted`. Without
them the densities are ``4 t - 4 t^2`` and ``1 - (1 - 2 sqrt(3) t)^2``.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from gradedesign import CellFamily
from gradedesign.fields import FloatArray
from gradedesign_cells_frep.slotted import PARAMETERS, slotted

#: Edges of the cell, by that along x, in which the honeycombs are regular.
STRETCH = (1.0, 3**0.5, 1.0)

_ROOT = 3**0.5


def hexagons(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance to the sides of hexagons and to the lines where these meet.

    Parameters
    ----------
    x, y : (...) arrays
        In units of the distance of opposite sides.

    Returns
    -------
    distance, crossing : (...) arrays
    """
    a, b = _offset(x, y, 0.0), _offset(x, y, 0.5)
    p, q = np.where((a * a).sum(axis=0) <= (b * b).sum(axis=0), a, b)
    # In the wedge of 30 degrees next to +x the nearest side is x = 1/2, the nearest corner
    # (1/2, 1 / (2 sqrt 3)); mirrors bring every place there.
    across = np.stack(
        [np.abs(p), np.abs(0.5 * p + 0.5 * _ROOT * q), np.abs(0.5 * p - 0.5 * _ROOT * q)]
    )
    nearest = across.max(axis=0)
    along = np.sqrt(np.maximum(p * p + q * q - nearest * nearest, 0.0))
    return 0.5 - nearest, np.hypot(0.5 - nearest, 0.5 / _ROOT - along)


def triangles(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance to the sides of triangles of side 1 and to their corners; see `hexagons`."""
    height = 0.5 * _ROOT
    rows = (y, 0.5 * (_ROOT * x + y), 0.5 * (_ROOT * x - y))
    sides = np.stack([np.abs(r / height - np.round(r / height)) * height for r in rows])
    corners = [(c * c).sum(axis=0) for c in (_offset(x, y, 0.0), _offset(x, y, 0.5))]
    return sides.min(axis=0), np.sqrt(np.minimum(*corners))


def honeycomb(
    u: FloatArray,
    *,
    polygons: Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]],
    frequency_z: float = 1.0,
    slot: float = 0.4,
    column: float = 0.1,
) -> FloatArray:
    """Shape function; ``polygons`` is `hexagons` or `triangles`, other parameters of `slotted`."""
    x, y, z = np.asarray(u)
    distance, crossing = polygons(x, _ROOT * y)
    return slotted(distance, crossing, z, frequency_z=frequency_z, slot=slot, column=column)


def _offset(x: FloatArray, y: FloatArray, start: float) -> FloatArray:
    """Place from the nearest point of a lattice of 1 by sqrt(3), ``(2, ...)``."""
    row = y / _ROOT - start
    column = x - start
    return np.stack([column - np.round(column), _ROOT * (row - np.round(row))])


#: Cells of these shapes.
FAMILIES = tuple(
    CellFamily(
        name=name,
        shape=partial(honeycomb, polygons=polygons),
        source=f"{source} of cell edges 1 : sqrt(3), slotted; elementary geometry",
        parameters=parameters,
        symmetry="orthotropic",
        sides=2,
    )
    for name, polygons, source, parameters in (
        ("honeycomb-plates", hexagons, "hexagons", PARAMETERS),
        ("triangle-plates", triangles, "triangles", PARAMETERS),
    )
)
