"""Points of a region that govern its displacement limit, one after the other or together.

The largest displacement of a region may change places from one design to the next: of a pin in two
ears now one ear moves most, now the other. Its gradient at the present place alone makes sizing
stiffen one at the cost of the other, for ever. Places that governed before stay limits of their
own, so that all of them are held at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.fe.solution import Solution
from gradedesign.sizing.responses import DisplacementLimit, largest_displacement

#: Nodes nearer than this share of the region's extent count as one place.
APART = 0.2
#: A place that moves less than this share of the largest displacement governs no more.
RELEVANT = 0.5
#: Places of a limit that are followed.
MOST_PLACES = 4


@dataclass(frozen=True, slots=True)
class GoverningPoints:
    """Nodes of every limit that governed it so far, the latest first."""

    nodes: tuple[tuple[int, ...], ...]


def no_points(count: int) -> GoverningPoints:
    """Nothing has governed yet, for ``count`` limits."""
    return GoverningPoints(((),) * count)


def remember_points(
    known: GoverningPoints,
    limits: Sequence[DisplacementLimit],
    solutions: Sequence[Solution],
    points: FloatArray,
) -> GoverningPoints:
    """Add the present place of every limit, drop those that move little.

    Parameters
    ----------
    known : GoverningPoints
    limits : sequence of DisplacementLimit
    solutions : sequence of Solution
    points : (3, n) array, mm
        Nodes of the space.
    """
    by_name = {s.name: s for s in solutions}
    found = []
    for limit, before in zip(limits, known.nodes, strict=True):
        u = by_name[limit.load_case].displacement
        largest, node = largest_displacement(u, limit.nodes, limit.component)
        extent = float(np.linalg.norm(np.ptp(points[:, limit.nodes], axis=1)))
        places = [node]
        for other in before:
            away = np.linalg.norm(points[:, places] - points[:, [other]], axis=0)
            value, _ = largest_displacement(u, np.array([other]), limit.component)
            if away.min() > APART * extent and value >= RELEVANT * largest:
                places.append(other)
        found.append(tuple(places[:MOST_PLACES]))
    return GoverningPoints(tuple(found))


def point_limits(
    known: GoverningPoints, limits: Sequence[DisplacementLimit]
) -> tuple[DisplacementLimit, ...]:
    """A limit of one node for every place that is followed, in the order of the limits."""
    return tuple(
        replace(limit, nodes=np.array([node]))
        for limit, nodes in zip(limits, known.nodes, strict=True)
        for node in nodes
    )
