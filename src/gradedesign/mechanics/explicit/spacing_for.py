"""The spacing at which an analysis has a number of unknowns."""

from __future__ import annotations

from collections.abc import Callable

from scipy.optimize import brentq

from gradedesign.mechanics.explicit.analysis import AnalysisEstimate, PlannedSolid


def spacing_for(
    estimate: Callable[[PlannedSolid, float], AnalysisEstimate],
    planned: PlannedSolid,
    unknowns: float,
    fine: float,
    coarse: float,
) -> float | None:
    """Least spacing from ``fine`` to ``coarse``, mm, that needs at most a number of unknowns.

    None where ``coarse`` needs more, or ``fine`` needs fewer, so that no spacing between them has
    this number.
    """

    def beyond(spacing: float) -> float:
        return estimate(planned, spacing).unknowns - unknowns

    if beyond(coarse) > 0 or beyond(fine) < 0:
        return None
    return float(brentq(beyond, fine, coarse, xtol=1e-6 * fine))
