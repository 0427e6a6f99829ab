"""A Gaussian random field of one wavelength, exactly periodic, with waves in chosen directions."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gradedesign import CaseError
from gradedesign.fields import Field, FloatArray, periodic_spline
from gradedesign_cells_stochastic.random_numbers import uniform

#: Half angles of cones of wave vectors, degrees; narrower cones hold too few waves.
_LEAST_ANGLE, _LARGEST_ANGLE = 15.0, 90.0

#: Steps of the table to a wavelength: the spline departs from the sum of waves by 1e-4 of its
#: standard deviation.
_STEPS = 16

_STREAM = 2


def wave_vectors(period: int, angles: tuple[float, float, float]) -> NDArray[np.int64]:
    """Waves that fit into the window and are about one cell long, one of each opposite pair.

    Parameters
    ----------
    period : int, cells
    angles : (float, float, float), degrees
        Half angles of the cones about x, y and z within which waves run, 0 for none.

    Returns
    -------
    (w, 3) int array
        Whole waves in the window along each axis, of length ``period`` to half a wave.

    Raises
    ------
    CaseError
        If an angle is not 0 or 15 to 90 degrees, or all are 0.
    """
    for angle in angles:
        if not (angle == 0 or _LEAST_ANGLE <= angle <= _LARGEST_ANGLE):
            raise CaseError(
                f"a cone of waves has the half angle {angle:g} degrees, expected 0 for none or "
                f"{_LEAST_ANGLE:g} to {_LARGEST_ANGLE:g}"
            )
    if not any(angles):
        raise CaseError("all cones of waves have the half angle 0; open one at least")
    axis = np.arange(-period - 1, period + 2)
    whole = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    # Rows come in order of x, then y, then z, and each vector mirrors its opposite in the list.
    whole = whole[len(whole) // 2 + 1 :]
    length = np.linalg.norm(whole, axis=1)
    whole, length = whole[length > 0], length[length > 0]
    cosine = np.abs(whole) / length[:, None]
    within = (cosine >= np.cos(np.radians(angles)) - 1e-12) & (np.array(angles) > 0)
    return np.asarray(whole[(np.abs(length - period) <= 0.5) & within.any(axis=1)])


def wave_phases(seed: float, count: int) -> FloatArray:
    """Random phases of waves, radians, ``(count,)``."""
    return 2 * np.pi * uniform(seed, _STREAM, count)


@lru_cache(maxsize=8)
def random_field(seed: float, period: int, angles: tuple[float, float, float]) -> Field:
    """Sum of waves of one amplitude and random phase, with mean 0 and variance 1.

    ``f(u) = sqrt(2 / w) sum cos(2 pi m . u / period + phase)`` over the w vectors m of
    `wave_vectors`; over the window its mean is exactly 0 and its variance exactly 1, and its values
    are normally distributed, the better the more waves. It is tabulated and interpolated by cubic
    splines.

    Parameters
    ----------
    seed : float
        A whole number; it sets the phases.
    period : int, cells
    angles : (float, float, float), degrees
        As of `wave_vectors`.

    Returns
    -------
    callable
        Points ``(3, ...)`` in cell units to values ``(...)`` of the same float type.

    Raises
    ------
    CaseError
        If the seed or an angle is out of range.

    References
    ----------
    Cahn, Journal of Chemical Physics 42 (1965) 93; the cones: Kumar, Tan, Zheng & Kochmann, npj
    Computational Materials 6 (2020) 73, eqs. 1 to 4, where waves have any direction in the cones
    and the field does not repeat.
    """
    waves = wave_vectors(period, angles)
    phase = wave_phases(seed, len(waves))
    steps = _STEPS * period
    spectrum = np.zeros((steps, steps, steps), dtype=np.complex128)
    x, y, z = waves.T
    spectrum[x, y, z] = (2.0 / len(waves)) ** 0.5 * steps**3 * np.exp(1j * phase)
    nodes = np.fft.ifftn(spectrum).real
    spline = periodic_spline(nodes, single=True)
    return lambda u: spline(np.asarray(u) / period)
