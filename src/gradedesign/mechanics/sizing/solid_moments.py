"""Where the solids of a lattice lie in the tetrahedra of the part.

A skin is much thinner than a tetrahedron and lies at its face: its stiffness depends on where in
the element it is, not on its volume alone. Strain is linear in a straight-sided quadratic
tetrahedron, so its energy needs the means of the solid's indicator with the products of two
barycentric coordinates, as in `gradedesign.mechanics.fe.stiffness.MomentStiffness`.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations, product

import numpy as np

from gradedesign.arrays import Field, FloatArray, IntArray
from gradedesign.common.system.threads import in_ranges
from gradedesign.geometry.lattice.component import Slab, SolidComponent
from gradedesign.geometry.lattice.domain import DesignDomain
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


def _solid_value(
    domain: DesignDomain, solids: Sequence[SolidComponent], points: FloatArray
) -> FloatArray:
    """Distance to solids less the cuts at points ``(3, ...)`` mm of the part, ``(...)``, mm."""
    to_part = domain.distance(points) if any(solid.part_depth for solid in solids) else None
    value = np.minimum.reduce([solid.distance(points, to_part) for solid in solids])
    for cut in domain.cuts:
        value = np.maximum(value, -cut.distance(points))
    return np.asarray(value)


def solid_moments(domain: DesignDomain, mesh: TetMesh) -> FloatArray:
    """Means over every tetrahedron of the solid's indicator with pairs of its coordinates.

    The distance to the solid is taken as linear in each of `DIVISIONS` ** 3 pieces of every
    tetrahedron: exact for plane layers whose faces lie a piece apart or more. Slabs, which may be
    thinner, are exact by themselves, and spread evenly over what other solids leave of a
    tetrahedron. Returns ``(10, m)``: in the order of `gradedesign.mechanics.fe.stiffness.PAIRS`.

    ``mesh``: of the part.
    """
    moments = np.zeros((len(PAIRS), mesh.tets.shape[1]))
    others = [solid for solid in domain.solids if solid.slab is None]
    slabs = [solid.slab for solid in domain.solids if solid.slab is not None]
    if others:
        moments = _moments(mesh, lambda points: _solid_value(domain, others, points))
    if not slabs:
        return moments
    free = np.ones(mesh.tets.shape[1])
    for cut in domain.cuts:
        free = free * (1.0 - mean_of(_moments(mesh, cut.distance)))
    for slab in slabs:
        moments += free * (1.0 - mean_of(moments)) * _slab_moments(mesh, slab)
    return moments


def _moments(mesh: TetMesh, distance: Field) -> FloatArray:
    """Moments of where a distance is negative, ``(10, m)``."""
    count, (nodes, pieces) = mesh.tets.shape[1], _divided(DIVISIONS)
    moments = np.zeros((count, len(PAIRS)))
    for start in range(0, count, _BATCH):
        corners = mesh.points[:, mesh.tets[:, start : start + _BATCH]]
        values = distance(np.einsum("dcm,qc->dmq", corners, nodes))
        _add_negative(values, nodes, pieces, moments[start : start + _BATCH])
    return np.ascontiguousarray(moments.T)


def _slab_moments(mesh: TetMesh, slab: Slab) -> FloatArray:
    """Moments of a slab, ``(10, m)``: those below its upper plane less those below its lower."""
    along = (slab.normal @ mesh.points)[mesh.tets].T
    below = np.zeros((2, len(along), len(PAIRS)))
    for end, moments in zip((slab.high, slab.low), below, strict=True):
        _add_negative(along - end, np.eye(4), np.arange(4)[None], moments)
    return np.ascontiguousarray((below[0] - below[1]).T)


def _add_negative(
    values: FloatArray, nodes: FloatArray, pieces: IntArray, moments: FloatArray
) -> None:
    """Add the moments of where values at the nodes of tetrahedra are negative, in threads."""
    values = np.ascontiguousarray(values, dtype=np.float64)
    in_ranges(negative_moments, range(len(values)), values, nodes, pieces, moments)


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
