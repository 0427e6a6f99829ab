"""Bearing loads: what a pin presses on the wall of its bore, as a cosine over half of it.

The pressure is ``p0 cos(theta)`` on the half that the force presses on, radial and without
friction: the usual assumption for a pin that fits with clearance (Bickley 1928, The distribution of
stress round a circular hole in a plate). Its resultant on a whole bore of radius r and length l is
``p0 pi r l / 2``.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import CaseError, SolverError
from gradedesign.geometry.part.bore import Bore
from gradedesign.geometry.part.regions import Region

#: How far from square to the axis of the bore a bearing load may act, degrees. Chosen, not
#: measured: more than axes that were fitted to facets turn, less than a user would mean.
_OFF_SQUARE = 1.0
#: How wide a gap the loaded half may have at its ends or between facets, degrees. Chosen like it.
MISSING = 1.0
#: Newton steps to the pressure, which take 2 to 6, and the share of the force that may be missed.
STEPS, _MISSED = 50, 1e-11
#: How much larger than the load the sum of the pressures may be: 4/pi on a whole bore, 2 on two
#: strips 60 degrees off the force. Beyond, what is there of the wall is wedged apart.
_WEDGED = 2.0


def loaded_bore(region: Region, force: FloatArray) -> Bore:
    """The bore of a region that can carry a bearing load.

    Raises `CaseError` if the region is not the wall of one bore, the force does not act square to
    its axis, or some of the half that it presses on is missing.

    ``force (3,)``, N.
    """
    bore = region.bore
    if bore is None:
        raise CaseError(
            f"region '{region.name}' is not the wall of one bore, on which a bearing load presses; "
            'select one hole, such as cylinder = {diameter = "8 mm", axis = "z"} with nearest, or '
            "give the load as force"
        )
    along, size = float(force @ bore.axis), float(np.linalg.norm(force))
    if abs(along) > np.sin(np.radians(_OFF_SQUARE)) * size:
        raise CaseError(
            f"found {along:.4g} of {size:.4g} N along the axis of the bore of region "
            f"'{region.name}', {_triple(bore.axis)}, along which its wall carries no pressure; "
            "expected a bearing load square to the axis; give what acts along it as force"
        )
    gap = _gap(region, bore, force)
    if gap is not None:
        raise CaseError(
            f"region '{region.name}' is less than the half of its bore that a bearing load of "
            f"{_triple(force)} N presses on: from {gap[0]:.4g} to {gap[1]:.4g} degrees about the "
            "force its wall is missing, of -90 to 90; select the whole bore, or give the load as "
            "force"
        )
    return bore


def bearing_traction(
    bore: Bore, force: FloatArray, points: FloatArray, area: FloatArray
) -> Callable[[FloatArray], FloatArray]:
    """Traction of a bearing load, whose resultant square to the axis is exactly that of the load.

    The traction is ``max(m . n, 0) n`` with the unit radius n. The vector m along the peak solves
    ``integral of it = force``; where the wall is even all around, it is along the force. Raises
    `SolverError` if the points cannot carry the force.

    ``force (3,)``, N. ``points (3, ...)``, mm: points of quadrature on the wall. ``area (...)``,
    mm^2: their weights.

    Returns
    -------
    callable
        Of points ``(3, ...)`` in mm, in MPa.
    """
    radial = bore.radial(points.reshape(3, -1))
    weight = area.ravel()
    wanted = bore.across(force)
    peak, size = wanted, float(np.linalg.norm(wanted))
    # The resultant is the slope of the convex energy of the wall, half the integral of the squared
    # pressure, so that Newton's method finds the peak in as many steps as its front moves.
    for _ in range(STEPS):
        pressed = peak @ radial > 0.0
        normal, share = radial[:, pressed], weight[pressed]
        push = share * (peak @ normal)
        if np.linalg.norm(normal @ push - wanted) <= _MISSED * size:
            if push.sum() > _WEDGED * size:
                break
            return _CosinePressure(bore, peak)
        stiff = (normal * share) @ normal.T + weight.sum() * np.outer(bore.axis, bore.axis)
        if not np.linalg.cond(stiff) < 1.0 / _MISSED:
            break
        peak = np.linalg.solve(stiff, wanted)
    raise SolverError(
        f"what there is of the wall of a bore about the axis {_triple(bore.axis)} through "
        f"{_triple(bore.point)} mm cannot carry a bearing load of {_triple(force)} N; keep the "
        "wall solid with [[keep]] on its region, or refine the mesh"
    )


class _CosinePressure:
    """Radial traction that grows with the cosine of the angle from its peak, on half of a bore."""

    __slots__ = ("bore", "peak")

    def __init__(self, bore: Bore, peak: FloatArray) -> None:
        self.bore, self.peak = bore, peak

    def __call__(self, points: FloatArray) -> FloatArray:
        radial = self.bore.radial(points)
        return np.asarray(np.maximum(np.tensordot(self.peak, radial, axes=1), 0.0) * radial)


def _gap(region: Region, bore: Bore, force: FloatArray) -> tuple[float, float] | None:
    """Angles about the force of the widest gap between facets on the loaded half, degrees."""
    ahead = bore.across(force)
    aside = np.cross(bore.axis, ahead)
    corners = bore.radial(np.moveaxis(region.corners, 2, 0))
    centres = bore.radial(region.corners.mean(axis=1).T)
    middle = np.degrees(np.arctan2(aside @ centres, ahead @ centres))
    angle = np.degrees(
        np.arctan2(np.tensordot(aside, corners, axes=1), np.tensordot(ahead, corners, axes=1))
    )
    # About the facet's own middle, so that a facet behind the force does not reach all around.
    apart = (angle - middle[:, None] + 180.0) % 360.0 - 180.0
    first, last = middle + apart.min(axis=1), middle + apart.max(axis=1)
    gaps, reached = [], -90.0
    for k in np.argsort(first):
        gaps.append((reached, float(min(first[k], 90.0))))
        reached = max(reached, float(last[k]))
    gaps.append((min(reached, 90.0), 90.0))
    widest = max(gaps, key=lambda gap: gap[1] - gap[0])
    return widest if widest[1] - widest[0] > MISSING else None


def _triple(values: FloatArray) -> str:
    return f"({', '.join(f'{value:.4g}' for value in values)})"
