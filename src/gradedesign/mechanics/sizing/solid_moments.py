"""Where the solid of skins and passive regions lies in the tetrahedra of the part.

A skin is much thinner than a tetrahedron and lies at its face: its stiffness depends on where in
the element it is, not on its volume alone. Strain is linear in a straight-sided quadratic
tetrahedron, so its energy needs the means of the solid's indicator with the products of two
barycentric coordinates, as in `gradedesign.mechanics.fe.stiffness.MomentStiffness`.
"""

from __future__ import annotations

from itertools import permutations, product

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.system.threads import in_ranges
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.drain import drain_value
from gradedesign.geometry.lattice.skin import skin_value
from gradedesign.geometry.tets.tet_mesh import TetMesh
from gradedesign.mechanics.fe.stiffness import PAIRS, mean_of
from gradedesign.mechanics.sizing._solid_moment_kernels import negative_moments

#: Pieces of every edge of a tetrahedron between which distances to the solid are linear. Chosen,
#: not measured.
DIVISIONS = 4
#: Tetrahedra that are evaluated at a time. Bounds the memory of one step; the result does not
#: depend on it. Chosen, not measured.
_BATCH = 4096
#: Shares this near 0 and 1 are none and all. Above the rounding of the moments, far below any solid
#: that matters.
_ROUNDING = 1e-9


def solid_value(domain: DesignDomain, points: FloatArray) -> FloatArray:
    """Distance to the solid of skins, fillings and passive regions, about, negative in it.

    Parameters
    ----------
    domain : DesignDomain
        With a skin or a passive region.
    points : (3, ...) array, mm
        Of the part.

    Returns
    -------
    (...) array, mm
    """
    whole = any(skin.faces is None for skin in domain.skins)
    to_part = domain.distance(points) if whole else None
    values = [skin_value(skin, points, to_part) for skin in domain.skins]
    values += [filling.distance(points) for filling in domain.fillings]
    values += [region.distance(points) - region.margin for region in domain.passive]
    value = np.minimum.reduce(values)
    for drain in domain.drains:
        value = np.maximum(value, -drain_value(drain, points))
    return np.asarray(value)


def solid_moments(domain: DesignDomain, mesh: TetMesh) -> FloatArray:
    """Means over every tetrahedron of the solid's indicator with pairs of its coordinates.

    The distance to the solid is taken as linear in each of `DIVISIONS` ** 3 pieces of every
    tetrahedron: exact for plane layers whose faces lie a piece apart or more.

    Parameters
    ----------
    domain : DesignDomain
    mesh : TetMesh
        Of the part.

    Returns
    -------
    (10, m) array
        In the order of `gradedesign.mechanics.fe.stiffness.PAIRS`.
    """
    count = mesh.tets.shape[1]
    if domain.lattice_only:
        return np.zeros((len(PAIRS), count))
    nodes, pieces = _divided(DIVISIONS)
    moments = np.zeros((count, len(PAIRS)))
    for start in range(0, count, _BATCH):
        corners = mesh.points[:, mesh.tets[:, start : start + _BATCH]]
        values = solid_value(domain, np.einsum("dcm,qc->dmq", corners, nodes))
        in_ranges(
            negative_moments,
            range(len(values)),
            np.ascontiguousarray(values, dtype=np.float64),
            nodes,
            pieces,
            moments[start : start + _BATCH],
        )
    return np.ascontiguousarray(moments.T)


def solid_fraction(moments: FloatArray) -> FloatArray:
    """Solid volume fraction of every tetrahedron, ``(m,)``, of its moments ``(10, m)``."""
    share = mean_of(moments)
    share[np.abs(share) < _ROUNDING] = 0.0
    share[np.abs(share - 1.0) < _ROUNDING] = 1.0
    return share


def _divided(n: int) -> tuple[FloatArray, IntArray]:
    """Nodes ``(q, 4)`` and pieces ``(n^3, 4)`` of a tetrahedron whose edges are cut into n.

    Of the cubes of a grid, each cut into six along its diagonal, those in ``x >= y >= z`` fill one
    such tetrahedron with pieces of one volume (Kuhn's division).
    """
    places = [p for p in product(range(n + 1), repeat=3) if p[0] >= p[1] >= p[2]]
    number = {place: at for at, place in enumerate(places)}
    pieces = []
    for cube, order in product(product(range(n), repeat=3), permutations(range(3))):
        path = [np.array(cube)]
        for axis in order:
            path.append(path[-1] + np.eye(3, dtype=int)[axis])
        if all(tuple(step.tolist()) in number for step in path):
            pieces.append([number[tuple(step.tolist())] for step in path])
    x = np.array(places, dtype=np.float64) / n
    nodes = np.stack([1 - x[:, 0], x[:, 0] - x[:, 1], x[:, 1] - x[:, 2], x[:, 2]], axis=1)
    return nodes, np.array(pieces, dtype=np.int64)
