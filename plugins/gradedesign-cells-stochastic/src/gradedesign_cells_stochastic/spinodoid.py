"""Spinodoids: level sets of a Gaussian random field whose waves run within cones.

The solid is ``f <= t`` with f of mean 0 and variance 1, so that the density is nearly that of the
normal distribution at t. Waves within cones about one axis make layers across it, about two axes
columns along the third, about three a cubic texture; wide cones make it isotropic. Kumar, Tan,
Zheng & Kochmann, npj Computational Materials 6 (2020) 73. The sheet ``|f| <= t`` follows the
surface between solid and void at density 1/2: Hsieh, Endo, Zhang, Bauer & Valdevit, Journal of
the Mechanics and Physics of Solids 125 (2019) 401.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gradedesign import CellFamily
from gradedesign.fields import FloatArray
from gradedesign_cells_stochastic.random_field import random_field

#: Cells along the window, a wavelength each.
PERIOD = 6

#: Half angles of the cones of waves about x, y and z, degrees.
CONES = {
    "isotropic": (90.0, 90.0, 90.0),
    "lamellar": (0.0, 0.0, 30.0),
    "columnar": (30.0, 30.0, 0.0),
    "cubic": (30.0, 30.0, 30.0),
}


def spinodoid(
    u: FloatArray,
    *,
    seed: float = 7.0,
    angle_x: float = 90.0,
    angle_y: float = 90.0,
    angle_z: float = 90.0,
) -> FloatArray:
    """Gaussian random field; the level is in standard deviations.

    Parameters
    ----------
    u : (3, ...) array, cell units
        A wave is a cell long, to 8 %.
    seed : float
        A whole number; each has its own field.
    angle_x, angle_y, angle_z : float, degrees
        Half angles of the cones within which waves run: 0 for none, or 15 to 90.

    Returns
    -------
    (...) array
    """
    return random_field(seed, PERIOD, (angle_x, angle_y, angle_z))(u)


def spinodoid_sheet(
    u: FloatArray,
    *,
    seed: float = 7.0,
    angle_x: float = 90.0,
    angle_y: float = 90.0,
    angle_z: float = 90.0,
) -> FloatArray:
    """Magnitude of the field of `spinodoid`."""
    return np.abs(spinodoid(u, seed=seed, angle_x=angle_x, angle_y=angle_y, angle_z=angle_z))


def _families() -> Iterator[CellFamily]:
    """A network and a sheet of each kind."""
    for kind, angles in CONES.items():
        parameters = {
            "seed": 7.0,
            **dict(zip(("angle_x", "angle_y", "angle_z"), angles, strict=True)),
        }
        source = f"{kind} spinodoid (Kumar et al., npj Comput. Mater. 6 (2020) 73), periodic"
        yield CellFamily(
            name=f"spinodoid-{kind}-network",
            shape=spinodoid,
            source=source,
            parameters=parameters,
            symmetry="none",
            period=PERIOD,
        )
        yield CellFamily(
            name=f"spinodoid-{kind}-sheet",
            shape=spinodoid_sheet,
            source=f"sheet of the {source}",
            parameters=parameters,
            symmetry="none",
            sides=2,
            period=PERIOD,
        )


#: The cells.
FAMILIES = tuple(_families())
