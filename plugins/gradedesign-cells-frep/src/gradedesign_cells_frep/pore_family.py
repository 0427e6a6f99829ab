"""Cells of pores of any shape, replicated in the cell and taken out of the solid.

A pore shape is a gauge: a function of the place from the pore's centre, proportional to the
distance from it along every ray, so that ``gauge <= r`` is the pore of size r. The replicated pores
are ``F(u) = min gauge(q u - c - n) / q`` over centres c and whole n, the solid is ``F >= r``:

    g = -F,   t = -r.

Round channels may join the pores: ``F = min(F, D / channel)``, D the distance to their axes.
Pasko et al. 2009, section 4, replicate by ``x' = sin(q x)``, which bends the pores (see
`sine_pores`); here space is repeated as it is. Solid noise is added to the place, which is the
paper's phase, and to F.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from gradedesign import CellFamily, PluginError
from gradedesign.fields import Field, FloatArray, periodic_distance_to_segments
from gradedesign_cells_frep.parameters import repeats, within
from gradedesign_cells_frep.solid_noise import solid_noise

SOURCE = "pores replicated in a solid (Pasko et al., TR-NCCA-2009-02 (2009), section 4)"

#: Parameters of the replication.
PLACES = {"frequency": 1.0, "phase": 0.0}

#: Parameter of pores with channels.
_CHANNEL = {"channel": 0.3}

#: Parameters of pores with solid noise.
_NOISE = {"noise_place": 0.03, "noise_size": 0.02, "seed": 7.0}
_QUIET = {"noise_place": 0.0, "noise_size": 0.0, "seed": 7.0}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pores:
    """The pores of a cell of edge 1.

    Attributes
    ----------
    gauge : callable
        ``gauge(p, **parameters)``: places ``(3, ...)`` from the pore's centre to ``(...)``,
        positive and proportional to the distance from the centre along every ray.
    centres : (k, 3) array_like, cell units
        Centres of the pores.
    channels : (m, 2, 3) array_like, cell units, optional
        Ends of the axes of channels; adds the parameter ``channel``, their radius by the size of
        the pores, 0.05 to 1.
    mirrored : bool
        True if the gauge rises with each of ``abs(x), abs(y), abs(z)``: then only the nearest copy
        of each pore is looked at, else eight.
    full : float
        Size at which walls between the pores have no thickness. Above 0 the levels count from
        there, ``t = full / q - r``, and have to be half of the walls' thickness in cell units.
    """

    gauge: Callable[..., FloatArray]
    centres: ArrayLike = ((0.0, 0.0, 0.0),)
    channels: ArrayLike | None = None
    mirrored: bool = False
    full: float = 0.0


def pore_family(
    name: str,
    pores: Pores,
    *,
    parameters: dict[str, float] | None = None,
    symmetry: Literal["cubic", "tetragonal", "orthotropic", "none"] = "none",
    noise: bool = False,
    source: str = "",
) -> CellFamily:
    """Make a cell family of replicated pores.

    Parameters
    ----------
    parameters : dict of str to float
        Defaults of the gauge's keyword arguments.
    symmetry : {"cubic", "tetragonal", "orthotropic", "none"}
        Of the pores and their places together; with noise there is none.
    noise : bool
        Add `_NOISE`: the parameters ``noise_place`` and ``noise_size``, root mean square shift of
        the pores and change of their size in cell units, and ``seed``.
    source : str
        Where the shape comes from.

    Returns
    -------
    CellFamily
        With the parameters ``frequency``, pores along the cell, a whole number, and ``phase``,
        their shift along each axis in spacings.

    Raises
    ------
    PluginError
        If the centres are not finite points, or the gauge's parameters have a taken name.

    Examples
    --------
    >>> pores = Pores(gauge=lambda p: np.linalg.norm(p, axis=0), mirrored=True)
    >>> family = pore_family("round", pores)
    >>> float(family.shape(np.array([1.0, 0.25, 0.0])))
    -0.25
    """
    places = np.array(pores.centres, dtype=np.float64)
    if places.ndim != 2 or places.shape[1:] != (3,) or not np.isfinite(places).all():
        raise PluginError(
            f"cell '{name}': centres of pores have shape {places.shape}, expected (k, 3), finite"
        )
    own = dict(parameters or {})
    taken = {*PLACES, *_CHANNEL, *_NOISE} & set(own)
    if taken:
        raise PluginError(
            f"cell '{name}': the gauge's parameter {', '.join(sorted(taken))} has a name of the "
            f"replication's own; rename it"
        )
    axes = None if pores.channels is None else periodic_distance_to_segments(pores.channels)
    walls = pores.full > 0 and not noise
    return CellFamily(
        name=name,
        shape=_shape(pores, places, axes, _NOISE if noise else _QUIET),
        source=f"{SOURCE}: {source or 'a shape'}" + (", with solid noise" if noise else ""),
        parameters={**PLACES, **own, **(_CHANNEL if axes else {}), **(_NOISE if noise else {})},
        symmetry="none" if noise else symmetry,
        distance=walls,
        sides=2 if walls else 1,
    )


def replicated(gauge: Field, centres: FloatArray, *, mirrored: bool) -> Field:
    """Least gauge of all copies of pores of period 1; see `pore_family`.

    Parameters
    ----------
    gauge : callable
        Places ``(3, ...)`` from a pore's centre to values ``(...)``.
    centres : (k, 3) array
    mirrored : bool
        Whether the nearest copy has the least value; else the eight around a point are compared.

    Returns
    -------
    callable
        Points ``(3, ...)`` to values ``(...)``, period 1.
    """
    corners = np.array(list(product((0.0, 1.0), repeat=3)))

    def evaluate(points: FloatArray) -> FloatArray:
        column = (3, *[1] * (points.ndim - 1))
        least: FloatArray = np.full(points.shape[1:], np.inf, dtype=points.dtype)
        for centre in centres.astype(points.dtype):
            place = points - centre.reshape(column)
            low = place - (np.round(place) if mirrored else np.floor(place))
            for corner in corners[:1] if mirrored else corners.astype(points.dtype):
                least = np.minimum(least, gauge(low - corner.reshape(column)))
        return least

    return evaluate


def _shape(
    pores: Pores,
    centres: FloatArray,
    axes: Field | None,
    noise: dict[str, float],
) -> Callable[..., FloatArray]:
    """Shape function of pores at ``centres``, with channels along ``axes``."""

    def shape(
        u: FloatArray,
        *,
        frequency: float = 1.0,
        phase: float = 0.0,
        channel: float = _CHANNEL["channel"],
        noise_place: float = noise["noise_place"],
        noise_size: float = noise["noise_size"],
        seed: float = noise["seed"],
        **settings: float,
    ) -> FloatArray:
        count = repeats("frequency", frequency)
        shift = within("phase", phase, -1.0, 1.0, "spacings of the pores")
        wide = within("channel", channel, 0.05, 1.0, "radius of channels by the size of pores")
        within("noise_place", noise_place, 0.0, 0.2, "root mean square shift in cells")
        within("noise_size", noise_size, 0.0, 0.2, "root mean square change of size in cells")
        u = np.asarray(u)
        points, swell = u, None
        if noise_place or noise_size:
            *moves, swell = solid_noise(u, seed)
            points = u + noise_place * np.stack(moves)
        points = count * points - shift
        value = replicated(lambda p: pores.gauge(p, **settings), centres, mirrored=pores.mirrored)(
            points
        )
        if axes is not None:
            value = np.minimum(value, axes(points) / wide)
        value = (pores.full - value) / count
        return value if swell is None else value - noise_size * swell

    return shape
