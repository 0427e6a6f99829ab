"""Lists of the copies of a periodic cell's segments that matter at each place of the cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray, locked
from gradedesign.errors import PluginError
from gradedesign.geometry.fields._graph_kernels import fill_nearest, fill_within, greatest_gap

#: Bins of the cell along each axis. Chosen, not measured.
BINS = 16

#: Bins for a first bound, and bins along the edge of one for which candidates are listed before
#: those of its parts. Chosen, not measured.
_COARSE, _SPLIT = 8, 4

#: The gauge of any prism of three sides or more is at least the distance over this: a triangle's
#: corner lies twice its height over a side from the axis, and its end one height beyond.
_SHARPEST = 5.0**0.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NearSegments:
    """Segments by bin of the unit cell.

    Attributes
    ----------
    bins : int
        Bins along each axis; bin ``(i, j, k)`` is number ``(i bins + j) bins + k``.
    first : (bins^3 + 1,) int array
        Where the entries of each bin begin in ``member``.
    member : (e,) int array
        Row of a segment in the arrays that follow.
    start, axis : (c, 3) array
        End of each copy and its unit direction (zero for a point), cell units.
    length : (c,) array, cell units
    owner : (c,) int array
        The segment of which it is a copy.
    """

    bins: int
    first: IntArray
    member: IntArray
    start: FloatArray
    axis: FloatArray
    length: FloatArray
    owner: IntArray

    def __post_init__(self) -> None:
        for name, shape in (("start", (None, 3)), ("axis", (None, 3)), ("length", (None,))):
            object.__setattr__(self, name, locked(getattr(self, name), shape, name=name))
        for name in ("first", "member", "owner"):
            value = locked(getattr(self, name), (None,), dtype=np.int64, name=name)
            object.__setattr__(self, name, value)


def near_segments(segments: FloatArray, reach: float, *, bins: int = BINS) -> NearSegments:
    """List, by bin, all copies of segments within reach of some point of the bin.

    Parameters
    ----------
    segments : (m, 2, 3) array, cell units
        Both ends; one of each set of copies.
    reach : float, cell units

    Raises
    ------
    PluginError
        If the reach is not between 0 and 4 cells.

    Examples
    --------
    >>> near = near_segments(np.array([[[0.0, 0, 0], [1, 0, 0]]]), 0.1, bins=4)
    >>> int(np.diff(near.first).max())  # the most copies of any bin
    2
    """
    if not 0 < reach <= 4:
        raise PluginError(f"a reach of {reach:g} cells is impossible; use above 0 and at most 4")
    start, axis, length, owner = _copies(segments, reach)
    first = np.zeros(bins**3 + 1, dtype=np.int64)
    none = np.zeros(0, dtype=np.int64)
    member = np.zeros(fill_within(bins, start, axis, length, reach, first, none), dtype=np.int64)
    fill_within(bins, start, axis, length, reach, first, member)
    return NearSegments(
        bins=bins, first=first, member=member, start=start, axis=axis, length=length, owner=owner
    )


def nearest_candidates(
    segments: FloatArray,
    thickness: FloatArray,
    normals: FloatArray,
    *,
    widen: float = 1.0,
    bins: int = BINS,
) -> NearSegments:
    """List, by bin, the copies of segments that are the nearest at some point of the bin.

    Or at most ``widen`` times as far as the nearest. Nearest by gauge over relative thickness; see
    `periodic_distance_to_segments` for both.

    Examples
    --------
    >>> strut = np.array([[[0.0, 0, 0], [1, 0, 0]]])
    >>> found = nearest_candidates(strut, np.ones(1), np.zeros((1, 0, 3)), bins=4)
    >>> set(found.owner.tolist())
    {0}
    """
    # Every point has a copy of every node within half of the cell's diagonal; that bounds what
    # matters, first roughly, then by the widest gap that was found on coarse bins.
    stretch = float(thickness.max()) * (_SHARPEST if normals.shape[1] else 1.0)
    thinnest = float(thickness.min())
    start, axis, length, owner = _copies(segments, widen * 0.5 * 3.0**0.5 / thinnest * stretch)
    gap = greatest_gap(_COARSE, start, axis, length, thickness[owner], normals[owner])
    reach = widen * (gap + 3.0**0.5 / _COARSE / thinnest) * stretch
    start, axis, length, owner = _copies(segments, reach)
    geometry = (start, axis, length, thickness[owner], normals[owner], widen)
    first, member = np.array([0, len(owner)]), np.arange(len(owner))
    none = np.zeros(0, dtype=np.int64)
    split = _SPLIT if bins % _SPLIT == 0 else 1
    for fine, parts in ((bins // split, bins // split), (bins, split)):
        lists, first = (fine, parts, first, member), np.zeros(fine**3 + 1, dtype=np.int64)
        member = np.zeros(fill_nearest(*lists, *geometry, first, none), dtype=np.int64)
        fill_nearest(*lists, *geometry, first, member)
    return NearSegments(
        bins=bins, first=first, member=member, start=start, axis=axis, length=length, owner=owner
    )


def _copies(
    segments: FloatArray, reach: float
) -> tuple[FloatArray, FloatArray, FloatArray, IntArray]:
    """Copies of segments that may come within reach of the unit cell, with their owners."""
    ends = segments - np.floor(segments.mean(axis=1))[:, None]
    along = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(along, axis=1)
    axis = along / np.where(length > 0, length, 1.0)[:, None]
    span = int(np.ceil(reach + 0.5 * float(length.max()))) + 1
    shifts = np.stack(np.meshgrid(*[np.arange(-span, span + 1.0)] * 3), axis=-1).reshape(-1, 3)
    start = ends[:, 0] + shifts[:, None]
    # Distance from the cell's centre to each copy, against the cell's half diagonal.
    foot = np.clip(((0.5 - start) * axis).sum(axis=2), 0.0, length)
    away = np.linalg.norm(start + foot[..., None] * axis - 0.5, axis=2)
    shift, owner = np.nonzero(away <= reach + 0.5 * 3.0**0.5)
    return (
        np.ascontiguousarray(start[shift, owner]),
        np.ascontiguousarray(axis[owner]),
        np.ascontiguousarray(length[owner]),
        owner.astype(np.int64),
    )
