"""Places of a region that a design moves each for itself."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.mechanics.solver.rigid_modes import rigid_body_modes

#: Clusters of a region's nodes, at most: each costs sizing an adjoint problem in every iteration.
CLUSTERS = 8
#: Strain of a kept solid, as motion beside that of a rigid body over the region's largest
#: displacement, up to which its nodes are one cluster: a node that moves so much less has half the
#: weight. `bracket` in solid and void, whose lug is kept: 1 cluster instead of 8 a load case, 72.5
#: instead of 73.2 g of shares, in less than half of the time.
_RIGID = 0.05


def moving_parts(
    points: FloatArray, moved: FloatArray, solids: IntArray | None, apart: float
) -> list[IntArray]:
    """Divide places into those that a design moves each for itself.

    Each kept solid that moves as a rigid body is one, of the others those that lie together: see
    `clusters`.

    - ``points (3, k)``, mm
    - ``moved (3, k)``, mm: their displacements
    - ``solids (k,)``: number of the kept solid that each belongs to, -1 for none; None: there is
      none
    - ``apart``, mm
    """
    rigid: list[IntArray] = []
    left = np.arange(points.shape[1])
    if solids is not None:
        most = _RIGID * float(np.linalg.norm(moved, axis=0).max())
        for number in np.unique(solids[solids >= 0]):
            mine = np.flatnonzero(solids == number)
            if largest_strain(points[:, mine], moved[:, mine]) <= most:
                rigid.append(mine)
                left = np.setdiff1d(left, mine)
    if left.size == 0:
        return rigid
    return rigid + [left[mine] for mine in clusters(points[:, left], CLUSTERS, apart)]


def largest_strain(points: FloatArray, moved: FloatArray) -> float:
    """Largest displacement, mm, beside the rigid motion nearest to all, of points ``(3, k)``.

    ``moved (3, k)``, mm.
    """
    modes = rigid_body_modes(points).reshape(-1, 6)
    all_moved = moved.T.ravel()
    left = all_moved - modes @ np.linalg.lstsq(modes, all_moved, rcond=None)[0]
    return float(np.linalg.norm(left.reshape(-1, 3), axis=1).max())


def clusters(points: FloatArray, count: int, apart: float = 0.0) -> list[IntArray]:
    """Divide points ``(3, k)`` into at most so many clusters, each around a point of its own.

    These lie more than ``apart`` from each other. The next one is the farthest from those before
    (Gonzalez, Theor. Comput. Sci. 38, 1985, 293-306), and each point belongs to the nearest of
    them.

    Examples
    --------
    >>> x = np.array([0.0, 0.1, 5.0, 5.2])
    >>> [mine.tolist() for mine in clusters(np.array([x, 0 * x, 0 * x]), 2)]
    [[0, 1], [2, 3]]
    """
    distance = np.full(points.shape[1], np.inf)
    nearest = np.zeros(points.shape[1], dtype=np.int64)
    centre = 0
    for number in range(count):
        away = np.linalg.norm(points - points[:, [centre]], axis=0)
        nearest[away < distance] = number
        distance = np.minimum(distance, away)
        centre = int(np.argmax(distance))
        if distance[centre] <= apart:
            break
    return [np.flatnonzero(nearest == number) for number in range(int(nearest.max()) + 1)]
