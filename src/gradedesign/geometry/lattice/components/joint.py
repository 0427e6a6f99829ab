"""Blended joints: the union of lattice, skin and passive solids with fillets in its corners."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from gradedesign.arrays import BoolArray, Field, FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.errors import LatticeError
from gradedesign.geometry.cell.shape import spread_points
from gradedesign.geometry.lattice.component import JoinComponent, Valued
from gradedesign.geometry.lattice.component_kind import ComponentKind, ComponentPlace, Made
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import LatticeDesign, lattice_field
from gradedesign.geometry.tets.tet_mesh import TetMesh

#: Reach of distances that a joint needs, in its radii: its own, and the way over which the cell's
#: values pass from one scale to another.
_REACH = 2.0
#: Step of numerical gradients, in radii: the curvature of cells is far below its inverse.
_STEP = 1e-3
#: Cosine of the normals from which two faces count as parallel, and have no corner. Chosen, not
#: measured.
_PARALLEL = 0.999
#: Gradients below this, mm per mm, are those of a ridge or of the middle of a void. Chosen, not
#: measured.
_FLAT = 0.1


def blended(first: FloatArray, second: FloatArray, cosine: FloatArray, radius: float) -> FloatArray:
    """Union of two distances with the arc of a circle in their corner, ``(...)``, mm.

    A ball of ``radius`` that rolls along both faces bounds the fillet. With ``a = radius - first``,
    ``b = radius - second`` and the cosine c of the angle between the gradients, the distance from
    its centre is ``sqrt((a^2 + b^2 - 2 a b c) / (1 - c^2))`` where the centre lies between both
    normals, ``a > c b`` and ``b > c a``; elsewhere the union is the minimum. So it adds material
    only, has no effect where one of the distances is ``radius`` or more nor between parallel
    faces, and planes whose normals are an angle t apart, up to 90 degrees, gain
    ``radius^2 (tan(t / 2) - t / 2)`` of section. Corners sharper than a right angle (c < 0) are
    filled as right ones, by ``radius^2 (1 - pi / 4) / sin t``, so that the reach stays one radius.

    ``first (...)``, ``second (...)``, mm: distances, negative inside, of slope one within the
    radius. ``cosine (...)``: of the angle between their gradients. ``radius``, mm.

    References
    ----------
    For right angles the compact blend of `gradedesign.fields.blend_union`.
    """
    c = np.clip(cosine, 0.0, _PARALLEL)
    a, b = radius - first, radius - second
    corner = (a > c * b) & (b > c * a) & (a > 0) & (b > 0)
    square = np.maximum(a**2 + b**2 - 2 * c * a * b, 0.0) / (1 - c**2)
    return np.where(corner, radius - np.sqrt(square), np.minimum(first, second))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Joint(JoinComponent):
    """Fillets of a radius in the corners of cells and solids.

    Raises `LatticeError` if the radius is not positive.
    """

    def __post_init__(self) -> None:
        if not self.radius > 0:
            raise LatticeError(
                f"the radius of joints must be positive, got {self.radius:g} mm; leave out what is "
                f"not wanted"
            )

    @property
    def reach(self) -> float:
        """A multiple of its radius, mm."""
        return _REACH * self.radius

    def joined(self, points: FloatArray, cell: Valued, solids: Sequence[Valued]) -> FloatArray:
        """Union with fillets, see `blended`.

        Beside solids the values of the cells are divided by their gradient, so that the radius is
        one in mm.
        """
        radius = self.radius
        result: FloatArray = np.array(cell[0], dtype=np.float64)
        if not solids:
            return result
        nearest: FloatArray = np.minimum.reduce([value for value, _ in solids])
        near = (nearest > -radius) & (nearest < _REACH * radius)
        values = [result, *(value for value, _ in solids)]
        slopes = np.zeros((3, points.shape[1]))
        if near.any():
            slope = _slope(cell[1], points[:, near], _STEP * radius)
            length = np.maximum(np.linalg.norm(slope, axis=0), _FLAT)
            share = np.clip(nearest[near] / radius - 1.0, 0.0, 1.0)
            values[0] = result.copy()
            values[0][near] *= share + (1.0 - share) / length
            slopes[:, near] = slope / length
        union: FloatArray = np.minimum.reduce(values)
        shallow = union > -radius
        functions = [cell[1], *(function for _, function in solids)]
        normals: dict[int, FloatArray] = {0: slopes}
        pairs = [
            (i, j, shallow & (values[i] < radius) & (values[j] < radius))
            for i, j in combinations(range(len(values)), 2)
        ]
        for i in range(1, len(values)):
            normals[i] = _normals(functions[i], points, _any(pairs, i), _STEP * radius)
        for i, j, both in pairs:
            if both.any():
                cosine = (normals[i][:, both] * normals[j][:, both]).sum(axis=0)
                fillet = blended(values[i][both], values[j][both], cosine, radius)
                union[both] = np.minimum(union[both], fillet)
        return union


def _slope(function: Field, points: FloatArray, step: float) -> FloatArray:
    """Gradient by forward differences, which take fewer values than central ones, ``(3, n)``."""
    base, shifts = function(points), step * np.eye(3)[:, :, None]
    return np.stack([function(points + shift) - base for shift in shifts]) / step


def _any(pairs: Sequence[tuple[int, int, BoolArray]], number: int) -> BoolArray:
    """Points at which some pair needs the normal of one of its members."""
    return np.asarray(np.any([both for i, j, both in pairs if number in (i, j)], axis=0))


def _normals(function: Field, points: FloatArray, where: BoolArray, step: float) -> FloatArray:
    """Unit gradients where they are needed, ``(3, n)``."""
    normals = np.zeros((3, points.shape[1]))
    if where.any():
        slope = _slope(function, points[:, where], step)
        normals[:, where] = slope / np.maximum(np.linalg.norm(slope, axis=0), _FLAT)
    return normals


def _make(place: ComponentPlace) -> Made:
    radius = place.lattice.joint_radius
    return ([Joint(name="the joints", radius=radius)] if radius else []), ()


#: Fillets of a radius, ``joint_radius = "0.5 mm"``.
KIND = ComponentKind(name="joint", stage="join", make=_make)


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
