"""Distance to the struts of a periodic graph: round struts and prisms, thick and thin ones."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import Field, FloatArray
from gradedesign.errors import PluginError
from gradedesign.geometry.fields._graph_kernels import filleted_distance, least_gauge
from gradedesign.geometry.fields.compiled_values import compiled_values
from gradedesign.geometry.fields.graph import graph_segments
from gradedesign.geometry.fields.near_segments import BINS, NearSegments, nearest_candidates

#: Bins along a cell of a long period: few of its thousands of struts matter in one. Chosen, not
#: measured.
_BINS_OF_LONG_PERIODS = 8


def periodic_distance_to_graph(nodes: ArrayLike, edges: ArrayLike) -> Field:
    """Distance to the struts of a periodic graph, cell units; see `graph_segments`.

    Examples
    --------
    >>> corner = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> distance = periodic_distance_to_graph(corner, [[0, 1], [0, 2], [0, 3]])
    >>> float(distance(np.array([0.5, 0.25, 2.0])))
    0.25
    """
    return periodic_distance_to_segments(graph_segments(nodes, edges))


def periodic_distance_to_segments(
    segments: ArrayLike,
    *,
    thickness: ArrayLike = 1.0,
    normals: ArrayLike | None = None,
    period: int = 1,
) -> Field:
    """Distance to periodic segments, divided by their relative thickness.

    Level ``t`` bounds struts of radius ``t`` times their thickness, with round ends. With normals
    the struts are prisms: the value is the largest of the heights over their sides and of the
    distance beyond an end, so that struts end in flat faces ``t`` beyond their nodes.

    Parameters
    ----------
    segments : (m, 2, 3) array_like, cell units
        Both ends; a point where they coincide. One of each set of copies.
    thickness : float or (m,) array_like
        Relative thickness, positive.
    normals : (m, s, 3) array_like, optional
        Unit normals of the three or more sides of each prism, perpendicular to its segment.
    period : int, cells
        After which the segments repeat.

    Returns
    -------
    callable
        Points ``(3, ...)`` to values ``(...)`` of the same float type; exact, threaded.

    Raises
    ------
    PluginError
        If the arrays do not fit together, or a thickness is not positive.

    Examples
    --------
    >>> strut = periodic_distance_to_segments([[[0, 0, 0], [1, 0, 0]]])
    >>> round(float(strut(np.array([0.5, 0.7, 0.0]))), 6)
    0.3
    """
    ends = np.array(segments, dtype=np.float64) / period
    sides = np.zeros((len(ends), 0, 3)) if normals is None else np.array(normals, dtype=np.float64)
    relative = np.array(np.broadcast_to(np.asarray(thickness, dtype=np.float64), (len(ends),)))
    _check(ends, relative, sides)

    @cache
    def listed() -> NearSegments:
        bins = BINS if period == 1 else _BINS_OF_LONG_PERIODS * period
        return nearest_candidates(ends, relative, sides, bins=bins)

    def evaluate(u: FloatArray) -> FloatArray:
        near = listed()
        points = np.asarray(u) / period if period > 1 else u
        value = compiled_values(
            least_gauge, points, near.bins, near.first, near.member, near.start, near.axis,
            near.length, relative[near.owner], sides[near.owner],
        )  # fmt: skip
        value *= period
        return value

    return evaluate


def _check(ends: FloatArray, thickness: FloatArray, sides: FloatArray) -> None:
    """Refuse arrays that do not describe struts."""
    if ends.ndim != 3 or ends.shape[1:] != (2, 3) or len(ends) == 0:
        raise PluginError(f"segments have shape {ends.shape}, expected (m, 2, 3) with m above 0")
    if sides.ndim != 3 or sides.shape[::2] != (len(ends), 3) or sides.shape[1] in (1, 2):
        raise PluginError(
            f"normals have shape {sides.shape}, expected ({len(ends)}, s, 3) with s of 3 or more"
        )
    if not (np.isfinite(ends).all() and np.isfinite(sides).all()):
        raise PluginError("segments and normals must be finite")
    if not (np.isfinite(thickness).all() and (thickness > 0).all()):
        raise PluginError(f"a relative thickness of {thickness.min():g} is impossible; use above 0")


#: Largest radius of a fillet over that of its struts: a larger one fills whole windows. Chosen, not
#: measured.
LARGEST = 2.0


def periodic_filleted_segments(segments: ArrayLike, fillet: float) -> Field:
    """Radius of struts that are filleted where they meet, as a field of period 1.

    Level ``t`` bounds struts of radius ``t`` with fillets of radius ``f t``: where several struts
    come within ``(1 + f) t``, the surface is that of points whose depths ``(1 + f) t - d`` below
    the offset struts, taken together as ``sqrt(sum depth^2)``, equal ``f t``. This is
    `blend_union` of any number of struts: between two at a right angle the exact arc of radius
    ``f t``. The value changes by at most the distance moved, and away from joints it is the
    distance to the axis.

    Parameters
    ----------
    segments : (m, 2, 3) array_like, cell units
        Both ends of every strut; one of each set of copies. Two that continue each other are
        thickened a little where they meet.
    fillet : float
        f, at least 0 and at most 2.

    Returns
    -------
    callable
        Points ``(3, ...)`` to values ``(...)`` of the same float type, cell units; threaded.

    Raises
    ------
    PluginError
        If the segments are none, or the fillet is out of range.

    Examples
    --------
    >>> crossing = [[[0, 0, 0], [1, 0, 0]], [[0, 0, 0], [0, 1, 0]]]
    >>> sharp, rounded = (periodic_filleted_segments(crossing, f) for f in (0.0, 1.0))
    >>> corner = np.array([0.1, 0.1, 0.0])
    >>> float(sharp(corner)), round(float(rounded(corner)), 4)
    (0.1, 0.0764)
    """
    ends = np.array(segments, dtype=np.float64)
    if ends.ndim != 3 or ends.shape[1:] != (2, 3) or len(ends) == 0 or not np.isfinite(ends).all():
        raise PluginError(f"segments have shape {ends.shape}, expected finite (m, 2, 3)")
    if not 0 <= fillet <= LARGEST:
        raise PluginError(
            f"fillets have {fillet:g} times the radius of struts; use 0 to {LARGEST:g}"
        )
    near = nearest_candidates(
        ends, np.ones(len(ends)), np.zeros((len(ends), 0, 3)), widen=1.0 + fillet
    )
    most = int(np.diff(near.first).max())

    def evaluate(u: FloatArray) -> FloatArray:
        return compiled_values(
            filleted_distance, u, near.bins, near.first, near.member, near.start, near.axis,
            near.length, float(fillet), most,
        )  # fmt: skip

    return evaluate
