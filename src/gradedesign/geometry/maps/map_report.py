"""Quality of the cells that a map makes: size, angles between their axes, folds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import Field, FloatArray
from gradedesign.errors import LatticeError
from gradedesign.geometry.cell.shape import spread_points
from gradedesign.geometry.maps.cell_map import CellMap, require_regular

#: Points that are measured at a time. Bounds the memory of one step; the result does not depend on
#: it. Chosen, not measured.
_CHUNK = 1 << 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """Percentiles by volume of a quantity, with its least and largest value."""

    least: float
    p5: float
    p50: float
    p95: float
    p99: float
    most: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SizeError:
    """Deviation of local cell sizes from those wanted."""

    #: Of ``|size / wanted - 1|``, the three cell axes pooled: every place counts three times, once
    #: for each axis.
    error: Spread
    within_5: float  #: Share of the pooled volume whose error is at most 5 and 10 %.
    within_10: float  #: As `within_5`.
    worst_within_5: float  #: Share of volume in which all three axes are within 5 %.


@dataclass(frozen=True, slots=True, kw_only=True)
class MapReport:
    """The cells that a map makes in a part; shares and percentiles are by volume."""

    name: str  #: Of the map.
    points: int  #: Points looked at.
    size: Spread  #: mm. Local sizes ``1 / |grad(u_i)|``, the three axes pooled.
    size_by_axis: tuple[Spread, Spread, Spread]  #: mm.
    #: degrees. Largest departure of the angles between two cell axes from a right angle.
    shear: Spread
    turn: Spread  #: degrees. Largest angle between a cell axis and the axis of its coordinate.
    folds: float  #: Share of volume in which the cells are turned inside out, det(du/dx) <= 0.
    fold_at: tuple[float, float, float] | None  #: mm. The worst of these points.
    size_error: SizeError | None  #: If sizes were wanted.


def map_report(
    cell_map: CellMap,
    points: FloatArray,
    *,
    wanted: Field | float | None = None,
) -> MapReport:
    """Measure the cells that a map makes at points of a part.

    Raises LatticeError if the part reaches a place where the map cannot be used, or there are no
    points.

    ``points (3, n)``, mm: inside the part, such as :func:`volume_points` or centroids of its
    tetrahedra. ``wanted``, mm: specified size of the cells.
    """
    x = np.asarray(points, dtype=np.float64).reshape(3, -1)
    count = x.shape[1]
    share = np.ones(count)
    if count == 0:
        raise LatticeError(
            "no place of the part is left for cells: skin and solid regions fill it, or the part "
            "lies where no lattice was asked for; expected a place inside the part at least"
        )
    require_regular(cell_map, x)
    size, shear, turn, det = (np.zeros((n, count)) for n in (3, 1, 1, 1))
    for low in range(0, count, _CHUNK):
        part = slice(low, low + _CHUNK)
        slope = cell_map.jacobian(x[:, part])
        size[:, part], shear[0, part], turn[0, part], det[0, part] = _cells(slope)
    folded = det[0] <= 0
    worst = x[:, int(np.argmin(det[0]))] if folded.any() else None
    first, second, third = (spread(s, share) for s in size)
    return MapReport(
        name=cell_map.name,
        points=count,
        size=spread(size.ravel(), np.ones(3 * count)),
        size_by_axis=(first, second, third),
        shear=spread(shear[0], share),
        turn=spread(turn[0], share),
        folds=float(folded.mean()),
        fold_at=None if worst is None else (float(worst[0]), float(worst[1]), float(worst[2])),
        size_error=None if wanted is None else _size_error(size, _wanted(wanted, x)),
    )


def require_unfolded(report: MapReport) -> None:
    """Refuse a map that folds.

    Raises LatticeError, naming the share of volume and a place.
    """
    if report.fold_at is None:
        return
    x, y, z = report.fold_at
    raise LatticeError(
        f"the {report.name} cell map folds in {100 * report.folds:.3g} % of the part, at worst "
        f"near ({x:.4g}, {y:.4g}, {z:.4g}) mm: cells there are turned inside out; ask for a "
        f"narrower range of sizes or a smoother one, or take another map"
    )


def volume_points(
    inside: Field | None, lower: ArrayLike, upper: ArrayLike, count: int
) -> FloatArray:
    """Points that fill a part evenly and fall at every phase of its cells, ``(3, n)``, mm.

    Returns (3, n) array, mm: each stands for an equal volume.

    ``inside``: signed distance of the part, mm, negative inside; ``None`` for the whole box.
    ``lower (3,)``, ``upper (3,)``, mm: box around the part. ``count``: points in the box; those
    inside the part are returned.
    """
    start = np.asarray(lower, dtype=np.float64)[:, None]
    points = start + spread_points(count) * (np.asarray(upper, dtype=np.float64)[:, None] - start)
    if inside is None:
        return np.asarray(points)
    return np.asarray(points[:, np.asarray(inside(points)) <= 0])


def spread(values: FloatArray, weights: FloatArray) -> Spread:
    """Percentiles of values ``(n,)`` by weight ``(n,)``."""
    order = np.argsort(values, kind="stable")
    ranked = values[order]
    below = np.cumsum(weights[order])
    at = [int(np.searchsorted(below, q * below[-1])) for q in (0.05, 0.5, 0.95, 0.99)]
    p5, p50, p95, p99 = (float(ranked[min(i, len(ranked) - 1)]) for i in at)
    return Spread(least=float(ranked[0]), p5=p5, p50=p50, p95=p95, p99=p99, most=float(ranked[-1]))


def _cells(
    slope: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Sizes ``(3, n)``, shear and turn in degrees and determinant ``(n,)`` from ``(3, 3, n)``."""
    length = np.maximum(np.sqrt((slope**2).sum(axis=1)), 1e-300)
    unit = slope / length[:, None]
    cosine = np.abs(np.stack([(unit[i] * unit[i - 1]).sum(axis=0) for i in range(3)])).max(axis=0)
    shear = np.degrees(np.arcsin(np.minimum(cosine, 1.0)))
    ahead = np.einsum("iin->in", unit)
    turn = np.degrees(np.arccos(np.clip(ahead.min(axis=0), -1.0, 1.0)))
    det = (slope[0] * np.cross(slope[1], slope[2], axis=0)).sum(axis=0)
    return 1 / length, shear, turn, det


def _wanted(wanted: Field | float, points: FloatArray) -> FloatArray:
    value = wanted(points) if callable(wanted) else wanted
    return np.broadcast_to(np.asarray(value, dtype=np.float64), points.shape[1:])


def _size_error(size: FloatArray, wanted: FloatArray) -> SizeError:
    error = np.abs(size / wanted - 1)
    return SizeError(
        error=spread(error.ravel(), np.ones(error.size)),
        within_5=float((error <= 0.05).mean()),
        within_10=float((error <= 0.10).mean()),
        worst_within_5=float((error <= 0.05).all(axis=0).mean()),
    )
