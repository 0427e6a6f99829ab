"""Paths of struts between their nodes: waves and helices as fine polylines."""

from __future__ import annotations

import numpy as np

from gradedesign import CaseError
from gradedesign.fields import FloatArray
from gradedesign_cells_strut.sections import strut_frames

#: Straight pieces of each turn: the polyline is off its curve by 0.9 % of the amplitude at most.
PIECES = 24

#: Share of a helical strut over which its radius grows from zero at each end.
RAMP = 0.2

#: Defaults of the parameters of each path.
PARAMETERS = {
    "straight": {},
    "wave": {"amplitude": 0.05, "waves": 1.0},
    "helix": {"amplitude": 0.05, "turns": 2.0},
}


def bent_segments(segments: FloatArray, path: str, amplitude: float, turns: float) -> FloatArray:
    """Replace straight struts by polylines that begin and end at the same nodes.

    With s from 0 to 1 along a strut, e1 and e2 across it (`strut_frames`) and n turns, a wave is
    off its axis by ``A sin(2 pi n s) e1`` and a helix by
    ``A w(s) (cos(2 pi n s) e1 + sin(2 pi n s) e2)``, right-handed, where w rises smoothly from
    0 to 1 over the first and falls over the last fifth. Amplitude 0 is the straight strut.

    Parameters
    ----------
    segments : (m, 2, 3) array, cell units
    path : {"wave", "helix"}
    amplitude : float, cell units
        0 to 0.5.
    turns : float
        Whole number of waves or turns along each strut.

    Returns
    -------
    (m k, 2, 3) array, cell units

    Raises
    ------
    CaseError
        If the amplitude or the number of turns is out of range.

    References
    ----------
    Aremu et al., Additive Manufacturing 13 (2017) 1-13 grades cells from helical to straight
    struts; it gives no formula.
    """
    if not 0 <= amplitude <= 0.5:
        raise CaseError(f"the amplitude of struts is {amplitude:g} cells, expected 0 to 0.5")
    if not (turns == round(turns) and 1 <= turns <= 12):
        raise CaseError(f"a strut has {turns:g} turns or waves, expected a whole number, 1 to 12")
    if amplitude == 0:
        return segments
    along, first, second = strut_frames(segments)
    forward = ((segments[:, 1] - segments[:, 0]) * along).sum(axis=1) > 0
    start = np.where(forward[:, None], segments[:, 0], segments[:, 1])
    length = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
    s = np.linspace(0.0, 1.0, PIECES * int(turns) + 1)
    across, sideways = _offsets(s, path, amplitude, turns)
    line = (
        start[:, None]
        + (length[:, None] * s)[:, :, None] * along[:, None]
        + across[None, :, None] * first[:, None]
        + sideways[None, :, None] * second[:, None]
    )
    return np.stack([line[:, :-1], line[:, 1:]], axis=2).reshape(-1, 2, 3)


def _offsets(
    s: FloatArray, path: str, amplitude: float, turns: float
) -> tuple[FloatArray, FloatArray]:
    """Distances off the axis in both directions across it, cell units."""
    angle = 2 * np.pi * turns * s
    if path == "wave":
        # Round-off at the far end would part the strut from its node.
        across = amplitude * np.where(s < 1, np.sin(angle), 0.0)
        return across, np.zeros_like(s)
    x = np.clip(np.minimum(s, 1 - s) / RAMP, 0.0, 1.0)
    radius = amplitude * x * x * (3 - 2 * x)
    return radius * np.cos(angle), radius * np.sin(angle)
