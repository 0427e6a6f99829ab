"""The cells that one periodic surface gives: sheet, networks and constant-thickness wall."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache

import numpy as np

from gradedesign import CellFamily
from gradedesign.fields import Field, FloatArray, periodic_distance_to_level_set

#: Tables of distances that a wall keeps, for as many values of its parameters.
_TABLES = 4


def surface_families(
    name: str,
    function: Callable[..., FloatArray],
    source: str,
    *,
    variant: str = "",
    below: str | None = "",
    above: str | None = None,
    resolution: int = 48,
    parameters: Mapping[str, float] | None = None,
) -> tuple[CellFamily, ...]:
    """Sheet, networks and wall of the surface ``function = 0``.

    Parameters
    ----------
    name : str
        Of the surface; the families are ``<name>-sheet``, ``-network`` and ``-wall``.
    function : callable
        Points ``(3, ...)`` in cell units to ``(...)``; period 1, cubic, smooth.
    source : str
        Formula and where it comes from.
    variant : str
        Ends every name, such as ``"-raymont"``.
    below, above : str or None
        Ends the name of the network ``f <= t``, and of the network ``f >= -t`` on the other side of
        the surface; None where the other side is the same cell, moved or turned.
    resolution : int
        Steps per cell of the table of distances behind the wall.
    parameters : mapping of str to float, optional
        Defaults of the function's keyword arguments: parameters of sheet and wall. Networks have
        the defaults.
    """

    def opposite(u: FloatArray) -> FloatArray:
        return np.negative(function(u))

    def sheet(u: FloatArray, **values: float) -> FloatArray:
        return np.abs(function(u, **values))

    signed_wall, wall = _walls(function, resolution)
    family_parameters = dict(parameters or {})

    networks = [
        CellFamily(
            name=f"{name}-network{variant}{end}", shape=shape, source=f"{solid}, f = {source}"
        )
        for end, shape, solid in ((below, function, "f <= t"), (above, opposite, "-f <= t"))
        if end is not None
    ]
    return (
        CellFamily(
            name=f"{name}-sheet{variant}",
            shape=sheet,
            source=f"|f| <= t, f = {source}",
            parameters=family_parameters,
            sides=2,
            signed=function,
        ),
        *networks,
        CellFamily(
            name=f"{name}-wall{variant}",
            shape=wall,
            source=f"distance to f = 0 at most t, f = {source}",
            parameters=family_parameters,
            distance=True,
            sides=2,
            signed=signed_wall,
        ),
    )


def _walls(
    function: Callable[..., FloatArray], resolution: int
) -> tuple[Callable[..., FloatArray], Callable[..., FloatArray]]:
    """Distance from the surface with the sign of its side, and without."""

    # Tabulated when first needed: it takes seconds.
    @lru_cache(maxsize=_TABLES)
    def distance(values: tuple[tuple[str, float], ...]) -> Field:
        def surface(u: FloatArray) -> FloatArray:
            return function(u, **dict(values))

        return periodic_distance_to_level_set(surface, resolution=resolution)

    def signed_wall(u: FloatArray, **values: float) -> FloatArray:
        return distance(tuple(sorted(values.items())))(u)

    def wall(u: FloatArray, **values: float) -> FloatArray:
        return np.abs(signed_wall(u, **values))

    return signed_wall, wall
