"""Round struts of a periodic graph with fillets where they meet."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import Field, FloatArray
from gradedesign.errors import PluginError
from gradedesign.geometry.fields._graph_kernels import filleted_distance
from gradedesign.geometry.fields.compiled_values import compiled_values
from gradedesign.geometry.fields.near_segments import nearest_candidates

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
