"""Body-centred cubic struts from straight to helical, in sixteen increments.

Aremu et al. 2017, fig. 21: helical struts whose amplitude falls to zero. Increment k has the
amplitude ``A k / 15`` cells about the struts from the middle of the cell to its corners, with
``A = 0.12`` and two right-handed turns each; the amplitude rises from zero over the first and falls
over the last fifth of a strut, so that struts meet at their nodes.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from gradedesign.fields import (
    Field,
    FloatArray,
    bond_graph,
    graph_segments,
    periodic_distance_to_segments,
)
from gradedesign_cells_voxel.increments import cell_from_increments

COUNT = 16
AMPLITUDE, TURNS = 0.12, 2

#: Straight pieces of each strut, and the share of it over which the amplitude rises.
PIECES, RAMP = 48, 0.2


def helices(amplitude: float) -> FloatArray:
    """Struts of one cell as polylines, ``(8 * 48, 2, 3)``, cell units; ``amplitude`` in cells."""
    straight = graph_segments(*bond_graph([[0.0, 0.0, 0.0], [0.5, 0.5, 0.5]], 0.75**0.5))
    start = straight[:, 0, None]
    along = straight[:, 1, None] - start
    unit = along / np.linalg.norm(along, axis=2, keepdims=True)
    # Across a space diagonal, towards x and completing a right-handed frame.
    first = np.array([1.0, 0.0, 0.0]) - unit[..., :1] * unit
    first /= np.linalg.norm(first, axis=2, keepdims=True)
    second = np.cross(unit, first)
    s = np.linspace(0.0, 1.0, PIECES + 1)[:, None]
    x = np.clip(np.minimum(s, 1 - s) / RAMP, 0.0, 1.0)
    radius, angle = amplitude * x * x * (3 - 2 * x), 2 * np.pi * TURNS * s
    line = start + s * along + radius * (np.cos(angle) * first + np.sin(angle) * second)
    return np.stack([line[:, :-1], line[:, 1:]], axis=2).reshape(-1, 2, 3)


def _increment(index: int) -> Field:
    """Distance to the struts of one increment."""
    return periodic_distance_to_segments(helices(AMPLITUDE * index / (COUNT - 1)))


#: Cells of this library.
FAMILIES = (
    cell_from_increments(
        [partial(_increment, index) for index in range(COUNT)],
        name="bcc-straight-to-helix",
        grey=128.0,
        source="body-centred cubic struts from straight to helical",
    ),
)
