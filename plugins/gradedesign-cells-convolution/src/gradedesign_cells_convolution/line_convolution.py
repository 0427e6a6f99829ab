"""The convolution of the struts of a periodic graph with a Gaussian, in closed form."""

from __future__ import annotations

import numpy as np

from gradedesign import CaseError
from gradedesign.fields import (
    Field,
    FloatArray,
    compiled_values,
    near_segments,
    periodic_distance_to_segments,
)
from gradedesign_cells_convolution._convolution_kernels import line_integrals

#: A strut is left out where its squared distance exceeds that of the nearest one by more than this
#: many sigma squared: each is then less than about exp(-5.5^2 / 2) = 2.7e-7 of the field.
CUT_OFF = 5.5

#: Range of sigma in cell units: narrower, the field underflows in the largest voids; wider, it is
#: nearly constant over the cell.
_LEAST_SIGMA, _LARGEST_SIGMA = 0.03, 0.4


def line_convolution(segments: FloatArray, sigma: float) -> Field:
    """Sum over struts of the line integral of ``exp(-r^2 / (2 sigma^2))``.

    For a strut from q0 of unit direction d and length l, with ``s = (p - q0) . d`` and
    ``h^2 = |p - q0|^2 - s^2``,
    ``F = sigma sqrt(pi/2) exp(-h^2 / (2 sigma^2)) [erf(s / (sigma sqrt 2)) - erf((s - l) / (sigma
    sqrt 2))]``. Evaluation is local: struts far from a point, by `CUT_OFF`, are left out.

    Parameters
    ----------
    segments : (m, 2, 3) array, cell units
        One of each set of copies; they may cross but not overlap.
    sigma : float, cell units
        0.03 to 0.4.

    Returns
    -------
    callable
        Points ``(3, ...)`` to values ``(...)`` of the same float type, cell units; positive.

    Raises
    ------
    CaseError
        If sigma is out of range.

    References
    ----------
    Tang, Xiong, Park, Boddeti & Rosen, Proceedings of CAD'19 (2019) 69-74, doi
    10.14733/cadconfP.2019.69-74; it prints the exponent without its minus sign.
    """
    if not _LEAST_SIGMA <= sigma <= _LARGEST_SIGMA:
        raise CaseError(
            f"sigma is {sigma:g} cells, expected {_LEAST_SIGMA:g} to {_LARGEST_SIGMA:g}; about the "
            f"radius of the struts keeps their joints short"
        )
    near = near_segments(segments, float(np.hypot(CUT_OFF * sigma, _widest_gap(segments))))

    def evaluate(u: FloatArray) -> FloatArray:
        return compiled_values(
            line_integrals, u, near.bins, near.first, near.member, near.start, near.axis,
            near.length, float(sigma), CUT_OFF,
        )  # fmt: skip

    return evaluate


def _widest_gap(segments: FloatArray, steps: int = 24) -> float:
    """Bound of the distance of any point to its nearest strut, cell units."""
    axis = (np.arange(steps) + 0.5) / steps
    nodes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"))
    gap = float(periodic_distance_to_segments(segments)(nodes).max())
    return gap + float(0.5 * 3.0**0.5 / steps)
