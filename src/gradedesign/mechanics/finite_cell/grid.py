"""The plain grid of bricks, its planes laid on the plane faces of a part where that is possible."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import FloatArray, locked
from gradedesign.errors import CaseError

#: A plane face this far from a grid plane, over the brick's edge, counts as on it. Chosen, not
#: measured.
ON_PLANE = 1e-6
#: Bricks may become this much thinner along an axis to meet more plane faces. Chosen, not measured.
FINER = 1.3


@dataclass(frozen=True, slots=True, kw_only=True)
class Plane:
    """A plane face across an axis, to lay a grid plane on."""

    axis: int
    place: float  #: mm.
    area: float = 1.0  #: mm^2. Its weight: the largest area of faces is met first.


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Grid:
    """Equal bricks in a box."""

    lower: FloatArray  #: ``(3,)``, mm.
    edges: FloatArray  #: ``(3,)``, mm. Of one brick.
    shape: tuple[int, int, int]  #: (3,) ints. Bricks along x, y and z.
    missed: tuple[Plane, ...] = ()  #: Plane faces that lie between grid planes.

    def __post_init__(self) -> None:
        object.__setattr__(self, "lower", locked(self.lower, (3,), name="lower"))
        object.__setattr__(self, "edges", locked(self.edges, (3,), name="edges"))


def fit_grid(
    lower: ArrayLike,
    upper: ArrayLike,
    spacing: float,
    planes: Sequence[Plane] = (),
    *,
    multiple: int = 1,
) -> Grid:
    """Grid over a box, no coarser than a spacing, with as many plane faces on it as possible.

    The box's own faces always lie on it, so bricks may differ a little from cubes. Raises
    `CaseError` if the box is empty or the spacing not positive.

    ``lower (3,)``, ``upper (3,)``, mm. ``spacing``, mm: largest edge of a brick. ``multiple``: of
    which the number of bricks along each axis is one.
    """
    low, high = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    extent = high - low
    if not (np.isfinite(extent).all() and (extent > 0).all()):
        raise CaseError(f"the box of the finite cells is empty: {low} to {high} mm")
    if not (np.isfinite(spacing) and spacing > 0):
        raise CaseError(f"the spacing of the finite cells is {spacing:g} mm, expected more than 0")
    counts = [
        _best_count(low[a], extent[a], spacing, [p for p in planes if p.axis == a], multiple)
        for a in range(3)
    ]
    edges = extent / counts
    missed = tuple(p for p in planes if not _on_grid(p, low[p.axis], edges[p.axis]))
    return Grid(lower=low, edges=edges, shape=(counts[0], counts[1], counts[2]), missed=missed)


def _best_count(
    low: float, extent: float, spacing: float, planes: Sequence[Plane], multiple: int
) -> int:
    """Number of bricks that meets most area of planes, the smallest of equals."""
    least = max(1, int(np.ceil(extent / spacing * (1.0 - 1e-9))))
    least = -(-least // multiple) * multiple
    counts = range(least, max(least, int(FINER * least)) + 1, multiple)
    areas = [sum(p.area for p in planes if _on_grid(p, low, extent / n)) for n in counts]
    return counts[int(np.argmax(areas))]


def _on_grid(plane: Plane, low: float, edge: float) -> bool:
    """Whether a plane lies on a grid plane."""
    place = (plane.place - low) / edge
    return abs(place - round(place)) <= ON_PLANE
