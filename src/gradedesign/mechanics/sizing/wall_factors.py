"""Walls of few cells in sizing: how the lattice's stiffness varies over their thickness.

In the axes of the cells the stiffness at a point becomes ``D C D`` with a diagonal ``D``, which
keeps it positive definite. For each axis that is normal to a wall, the entries in its plane follow
a profile over the thickness whose mean and second moment are the wall's membrane and bending
ratios, and the transverse ones a constant that gives the wall its shear stiffness. Ratios of
several axes multiply.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray, locked
from gradedesign.common.system.threads import in_ranges
from gradedesign.errors import DensityError
from gradedesign.mechanics.fe.stiffness import pair_products
from gradedesign.mechanics.sizing._wall_kernels import wall_moments

#: Exponents of profiles, the least one that reaches the asked second moment is taken: outward
#: ``|z|^p`` raises it to ``3 (p + 1) / (p + 3)``, inward ``(1 - z^2)^p`` lowers it to
#: ``3 / (2 p + 3)``.
EXPONENTS = (8, 16, 32)
#: At most this share of a profile is not uniform, so that it stays positive.
MOST = 0.95

#: Heights over half a wall at which the profile is integrated. Chosen, not measured.
_HEIGHTS = 2001


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WallClass:
    """Ratios of one kind of wall at the densities of `WallFactors`."""

    solid: FloatArray  #: ``(k,)``. Density of the wall over that of the periodic lattice.
    #: ``(k, 3)``. Uniform part of the profiles and their parts towards the faces and the middle:
    #: along the first in-plane axis, the second, and shear between them.
    mean: FloatArray
    outward: FloatArray
    inward: FloatArray
    #: ``(k, 2)``. Factor on the transverse shear stiffness along the first axis and the second.
    shear: FloatArray
    exponent: int  #: Of both profiles.


def wall_class(
    solid: FloatArray, membrane: FloatArray, bending: FloatArray, shear: FloatArray
) -> WallClass:
    """Profiles that have the membrane, bending and shear ratios of a wall.

    Raises `DensityError` if no profile has such a bending stiffness: more than all solid at the
    faces has, or less than all in the middle.

    ``solid (k,)``: by density. ``membrane``, ``bending``, each ``(k, 3)``. ``shear (k, 2)``: over
    ``5/6 G h``, that of a uniform plate.
    """
    relative = bending / membrane - 1
    for exponent in EXPONENTS:
        far, near = _second_moments(exponent)
        outward = np.maximum(relative, 0.0) / (far - 1)
        inward = np.maximum(-relative, 0.0) / (1 - near)
        if max(outward.max(), inward.max()) <= MOST:
            break
    else:
        least, most = 1 - MOST * (1 - near), 1 + MOST * (far - 1)
        raise DensityError(
            f"a wall is {1 + relative.max():.3g} or {1 + relative.min():.3g} times as stiff in "
            f"bending as a uniform one of its membrane stiffness; expected {least:.2g} to "
            f"{most:.3g}: move the origin of the cells"
        )
    # Transverse stress follows the profile of the stiffness along its own direction.
    share = [
        [_shear_share(outward[i, d], inward[i, d], exponent) for d in range(2)]
        for i in range(len(solid))
    ]
    return WallClass(
        solid=solid,
        mean=membrane,
        outward=outward * membrane,
        inward=inward * membrane,
        shear=shear * (5 / 6) / np.array(share),
        exponent=exponent,
    )


def _second_moments(exponent: int) -> tuple[float, float]:
    """Second moments over a uniform profile's: outward, inward."""
    return 3 * (exponent + 1) / (exponent + 3), 3 / (2 * exponent + 3)


def _parts(z: FloatArray, exponent: int) -> tuple[FloatArray, FloatArray]:
    """Outward and inward profiles at heights -1 to 1, each of mean 1."""
    middle = np.cumprod([1.0] + [2 * k / (2 * k + 1) for k in range(1, exponent + 1)])[-1]
    return (exponent + 1) * np.abs(z) ** exponent, (1 - z * z) ** exponent / middle


def _shear_share(outward: float, inward: float, exponent: int) -> float:
    """Shear stiffness over ``G h`` for a profile of the stiffness along the wall and uniform G.

    The shear flow is the moment of the profile beyond a height; 5/6 for a uniform one.
    """
    z = np.linspace(0.0, 1.0, _HEIGHTS)
    far, near = _parts(z, exponent)
    profile = 1 + outward * (far - 1) + inward * (near - 1)
    steps = 0.5 * np.diff(z) * (profile[1:] * z[1:] + profile[:-1] * z[:-1])
    flow = np.append(np.cumsum(steps[::-1])[::-1], 0.0)
    return float(np.trapezoid(flow, z) ** 2 / np.trapezoid(flow**2, z))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WallFactors:
    """Walls about every tetrahedron, at the points of an integration rule."""

    density: FloatArray  #: ``(k,)``. Increasing; the ratios are linear between them.
    classes: tuple[WallClass, ...]
    #: ``(3, M)``. Class of the wall across each axis of the cells; -1 where there is none.
    kind: IntArray
    height: FloatArray  #: ``(3, q, M)``. Place of every point in that wall, -1 and 1 at its faces.
    #: ``(q, 4) and (q,)``. The rule.
    points: FloatArray
    weights: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "density", locked(self.density, (None,), name="density"))
        if self.density.size < 2 or not (np.diff(self.density) > 0).all():
            raise ValueError("densities must increase, two or more")
        if np.abs(self.height).max(initial=0.0) > 1:
            raise ValueError("heights lie between the faces of a wall, from -1 to 1")

    def stiffness(self, C: FloatArray, rho: FloatArray) -> FloatArray:
        """Moments of ``D C D`` in cell axes, ``(6, 6, 10, M)``, at densities ``(M,)``.

        ``C (6, 6, M)``: of the periodic lattice. As in
        `gradedesign.mechanics.fe.stiffness.MomentStiffness`.
        """
        return self._moments(C, np.zeros((6, 6, 0)), rho)

    def stiffness_slope(self, C: FloatArray, slope: FloatArray, rho: FloatArray) -> FloatArray:
        """Derivative of `stiffness` by density, where that of ``C`` is ``slope``."""
        return self._moments(C, slope, rho)

    def _moments(self, C: FloatArray, slope: FloatArray, rho: FloatArray) -> FloatArray:
        ratio, rise = np.zeros((2, 3, 11, rho.size))
        exponent = np.zeros(self.kind.shape, dtype=np.int64)
        for axis, tets, wall in self._walls():
            rows = np.concatenate([wall.mean, wall.outward, wall.inward, wall.shear], axis=1)
            ratio[axis][:, tets], rise[axis][:, tets] = self._between(rows, rho[tets])
            exponent[axis, tets] = wall.exponent
        turn = pair_products(self.points, self.weights)
        moments = np.zeros((6, 6, len(turn), rho.size))
        in_ranges(
            wall_moments, range(rho.size), exponent, self.height, ratio, rise, turn, C, slope,
            moments,
        )  # fmt: skip
        return moments

    def solid(self, rho: FloatArray) -> FloatArray:
        """Effective over nominal density of the walls, ``(M,)``."""
        return self._solid(rho)[0]

    def solid_slope(self, rho: FloatArray) -> FloatArray:
        """d(solid)/d(rho), ``(M,)``."""
        value, relative = self._solid(rho)
        return value * relative

    def _solid(self, rho: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Ratio of solid and the derivative of its logarithm."""
        value, relative = np.ones(rho.size), np.zeros(rho.size)
        for _, tets, wall in self._walls():
            at, slope = self._between(wall.solid[:, None], rho[tets])
            value[tets] *= at[0]
            relative[tets] += slope[0] / at[0]
        return value, relative

    def _walls(self) -> list[tuple[int, IntArray, WallClass]]:
        """Axis, tetrahedra and class of every wall."""
        walls = []
        for axis in range(3):
            for number, wall in enumerate(self.classes):
                tets = np.flatnonzero(self.kind[axis] == number)
                if tets.size:
                    walls.append((axis, tets, wall))
        return walls

    def _between(self, rows: FloatArray, rho: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Rows ``(k, n)`` at densities ``(t,)`` and their slopes, ``(n, t)`` each."""
        piece = _density_piece(self.density, rho, "ratios of walls")
        width = self.density[piece + 1] - self.density[piece]
        slope = (rows[piece + 1] - rows[piece]) / width[:, None]
        value = rows[piece] + slope * (rho - self.density[piece])[:, None]
        return value.T, slope.T


def _density_piece(density: FloatArray, rho: FloatArray, quantity: str) -> IntArray:
    """Interval, from 0 to ``k - 2``, between increasing densities ``(k,)`` that holds each ``rho``.

    ``quantity`` names what is known there, in the plural. Raises `DensityError` if a density lies
    beyond the first or the last.
    """
    low, high = density[0], density[-1]
    if not ((rho >= low - 1e-9) & (rho <= high + 1e-9)).all():
        raise DensityError(
            f"{quantity} are known for relative densities {low:g} to {high:g}, but were asked for "
            f"{np.min(rho):g} to {np.max(rho):g}; narrow [lattice] density"
        )
    place = np.searchsorted(density, rho, side="right") - 1
    return np.clip(place, 0, density.size - 2)
