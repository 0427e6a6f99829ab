"""Material that components add to cells and to their corners with solids, measured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.geometry.cell.shape import spread_points
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import LatticeDesign, lattice_field
from gradedesign.geometry.tets.tet_mesh import TetMesh

#: Points of the part's box: the volume of joints of 1 % of it is then right to about 1 %.
POINTS = 200_000
#: Points of every tetrahedron at which its share of joints is counted. Chosen, not measured.
_INTERIOR_POINTS = 20
#: Points that are evaluated at a time. Bounds the memory of one step; the result does not depend on
#: it. Chosen, not measured.
_BATCH = 1 << 18


def adds_to_cells(domain: DesignDomain) -> bool:
    """Whether components add to the cells, or to their corners with solids."""
    return bool((domain.on_cells and domain.has_cells) or domain.join)


def joint_volume(design: LatticeDesign) -> float:
    """Volume that joins, and components on the cells, add to cells and solids, mm^3."""
    if not adds_to_cells(design.domain):
        return 0.0
    report_step("volume of the joints")
    added = _added(design)
    lower, edges = design.domain.lower[:, None], design.domain.upper - design.domain.lower
    points = lower + edges[:, None] * spread_points(POINTS)
    count = sum(
        int(np.count_nonzero(added(points[:, start : start + _BATCH])))
        for start in range(0, POINTS, _BATCH)
    )
    return float(edges.prod() * count / POINTS)


def joint_fraction(design: LatticeDesign, mesh: TetMesh) -> FloatArray:
    """Share of every tetrahedron that only they fill, by interior points, ``(M,)``."""
    count = mesh.tets.shape[1]
    if not adds_to_cells(design.domain):
        return np.zeros(count)
    report_step("volume fractions of the joints")
    added = _added(design)
    share = np.zeros(count)
    every = interior_points(mesh)
    each = max(_BATCH // every.shape[1], 1)
    for start in range(0, count, each):
        share[start : start + each] = added(every[:, :, start : start + each]).mean(axis=0)
    return share


def interior_points(mesh: TetMesh) -> FloatArray:
    """Points that fill every tetrahedron evenly, ``(3, q, M)``, mm.

    Other ones in each, so that what lies along a face of every tetrahedron is counted right in
    their sum.
    """
    count = mesh.tets.shape[1]
    spread = np.sort(spread_points(count * _INTERIOR_POINTS), axis=0)
    # Gaps between three sorted numbers of 0 to 1 are evenly spread barycentric coordinates.
    weights = np.diff(spread, axis=0, prepend=0.0, append=1.0).reshape(4, count, _INTERIOR_POINTS)
    return np.asarray(np.einsum("dcm,cmq->dqm", mesh.points[:, mesh.tets], weights))


def _added(design: LatticeDesign) -> Callable[[FloatArray], BoolArray]:
    """Whether points ``(3, ...)`` mm are solid through a join or a component on the cells alone."""
    domain = design.domain
    join = [] if domain.join is None else [domain.join.radius]
    band = max(join + [c.least for c in domain.on_cells if not c.replaces])
    plain = replace(design, domain=domain.plain())
    with_joints, without = (lattice_field(d, band=band) for d in (design, plain))

    def added(points: FloatArray) -> BoolArray:
        solid = with_joints(points) < 0
        solid[solid] = without(points[:, solid]) >= 0
        return np.asarray(solid)

    return added
