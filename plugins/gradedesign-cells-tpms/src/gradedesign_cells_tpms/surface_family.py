"""The cells that one periodic surface gives: sheet, networks and constant-thickness wall."""

from __future__ import annotations

from functools import cache

import numpy as np

from gradedesign import CellFamily
from gradedesign.fields import Field, FloatArray, periodic_distance_to_level_set


def surface_families(
    name: str,
    function: Field,
    source: str,
    *,
    variant: str = "",
    below: str | None = "",
    above: str | None = None,
    resolution: int = 48,
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

    Returns
    -------
    tuple of CellFamily
    """

    def opposite(u: FloatArray) -> FloatArray:
        return np.negative(function(u))

    def sheet(u: FloatArray) -> FloatArray:
        return np.abs(function(u))

    # Tabulated when first needed: it takes seconds.
    @cache
    def distance() -> Field:
        return periodic_distance_to_level_set(function, resolution=resolution)

    def wall(u: FloatArray) -> FloatArray:
        return np.abs(distance()(u))

    networks = [
        CellFamily(
            name=f"{name}-network{variant}{end}", shape=shape, source=f"{solid}, f = {source}"
        )
        for end, shape, solid in ((below, function, "f <= t"), (above, opposite, "-f <= t"))
        if end is not None
    ]
    return (
        CellFamily(
            name=f"{name}-sheet{variant}", shape=sheet, source=f"|f| <= t, f = {source}", sides=2
        ),
        *networks,
        CellFamily(
            name=f"{name}-wall{variant}",
            shape=wall,
            source=f"distance to f = 0 at most t, f = {source}",
            distance=True,
            sides=2,
        ),
    )
