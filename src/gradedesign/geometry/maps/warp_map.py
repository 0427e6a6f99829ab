"""Cells enlarged in spheres by warping space, after Raymont."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, lock
from gradedesign.errors import CaseError
from gradedesign.geometry.maps.cell_map import CellMap, along, constant_jacobian


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MorphingSphere:
    """A sphere within which cells change size."""

    centre: FloatArray  #: ``(3,)``, mm.
    #: mm. Within it cells are ``magnification`` times as large, and not distorted.
    stable_radius: float
    #: mm. Beyond it nothing changes; between the two, the transition zone, cells are squashed (or,
    #: for a magnification below 1, stretched) along the radius.
    outer_radius: float
    magnification: float

    def __post_init__(self) -> None:
        lock(self, centre=(3,))
        a, b, m = self.stable_radius, self.outer_radius, self.magnification
        if not (0 < a < b < np.inf and 0 < m < np.inf):
            raise CaseError(
                f"a morphing sphere has a stable radius of {a:g} mm, an outer radius of {b:g} mm "
                f"and a magnification of {m:g}; expected 0 < stable < outer and a positive "
                f"magnification"
            )
        if m <= 1 / 3:
            raise CaseError(
                f"a morphing sphere of magnification {m:g} folds whatever its radii; use more "
                f"than 1/3"
            )
        # The cubic of Hermite is monotone if no end slope exceeds three times the mean one.
        steepest = max(1.0, 1.0 / m) / 3.0
        least = a * (1 / m - steepest) / (1 - steepest)
        if b < least * (1 - 1e-12):
            raise CaseError(
                f"a morphing sphere of stable radius {a:g} mm and magnification {m:g} would fold "
                f"between it and {b:g} mm; use an outer radius of at least {least:.4g} mm"
            )


def warp_map(base: CellMap, spheres: Sequence[MorphingSphere]) -> CellMap:
    """Cells of another map, enlarged in spheres: u = base(Theta(x)).

    Theta moves points along the radii of the spheres: ``r -> r / magnification`` within the stable
    radius, unchanged beyond the outer one, and a cubic with continuous slope between.

    Returns CellMap: continuously differentiable where ``base`` is, and equal to it outside the
    spheres. Raises CaseError if two spheres overlap.

    ``spheres``: none may overlap.

    References
    ----------
    Raymont 2011, eq. 4.6 and figure 4.3; the source names stable and transition zones and gives
    no formula for them.
    """
    for number, current in enumerate(spheres):
        for neighbour in spheres[:number]:
            apart = float(np.linalg.norm(current.centre - neighbour.centre))
            if apart < current.outer_radius + neighbour.outer_radius:
                raise CaseError(
                    f"two morphing spheres of outer radius {neighbour.outer_radius:g} and "
                    f"{current.outer_radius:g} mm lie {apart:g} mm apart and overlap; move or "
                    f"shrink them"
                )
    chosen = tuple(spheres)

    def theta(points: FloatArray) -> FloatArray:
        x = np.asarray(points, dtype=np.float64)
        moved = x.copy()
        for sphere in chosen:
            away = x - along(sphere.centre, x)
            radius = np.sqrt((away**2).sum(axis=0))
            inside = radius < sphere.outer_radius
            share = _radial(sphere, radius[inside])[0]
            moved[:, inside] = along(sphere.centre, away[:, inside]) + share * away[:, inside]
        return moved

    def jacobian(points: FloatArray) -> FloatArray:
        x = np.asarray(points, dtype=np.float64)
        slope = constant_jacobian(np.eye(3), x)
        for sphere in chosen:
            away = x - along(sphere.centre, x)
            radius = np.sqrt((away**2).sum(axis=0))
            inside = radius < sphere.outer_radius
            r = radius[inside]
            share, rate = _radial(sphere, r)
            unit = away[:, inside] / np.where(r > 0, r, 1.0)
            radial = unit[:, None] * unit[None]
            slope[:, :, inside] = share * np.eye(3)[:, :, None] + (rate - share) * radial
        return np.einsum("ij...,jk...->ik...", base.jacobian(theta(x)), slope)

    return CellMap(
        name=f"warped {base.name}",
        coordinates=lambda points: base.coordinates(theta(points)),
        jacobian=jacobian,
        size=base.size,
        singular=base.singular,
        singular_name=base.singular_name,
    )


def _radial(sphere: MorphingSphere, radius: FloatArray) -> tuple[FloatArray, FloatArray]:
    """New radius over old one, and slope of the new one, inside the outer radius, ``(n,)``."""
    a, b, start = sphere.stable_radius, sphere.outer_radius, 1 / sphere.magnification
    s = np.clip((radius - a) / (b - a), 0.0, 1.0)
    first, last, span = a * start, b, b - a
    rise = last - first
    # The cubic with values a start and b and slopes start and 1 at both ends of the zone.
    c2 = 3 * rise - span * (2 * start + 1)
    c3 = span * (start + 1) - 2 * rise
    new = first + s * (span * start + s * (c2 + s * c3))
    slope = (span * start + s * (2 * c2 + 3 * s * c3)) / span
    stable = radius <= a
    share = np.where(stable, start, new / np.where(radius > 0, radius, 1.0))
    return share, np.where(stable, start, slope)
