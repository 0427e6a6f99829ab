"""Error of a solution on finite cells, from tractions that are not in balance.

Of a Galerkin solution the work of the loads is too small by the energy of its error. What makes
that error are tractions on surfaces that carry none, and jumps of traction between elements: both
vanish in the exact solution. Nothing else is looked at, so that the measure needs no second grid
and does not mind how a grid happens to lie.

The displacement of a place errs by the energy between the error of the solution and that of its
dual, which a unit force there causes (Becker and Rannacher 2001): what the tractions of both say
together, place by place, stands for that as the square of one solution's does for the work. The
whole part's work hides a plate that dents where it is thin; the dual is large just there. Above 300
lines: surfaces, faces and the solid share how their points are chosen and weighted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy.spatial import KDTree

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray
from gradedesign.finite_cell import _stress_kernels as kernels
from gradedesign.finite_cell.basis import gauss_places
from gradedesign.finite_cell.elements import BLOCKS, Elements, solid_volume
from gradedesign.finite_cell.space import BrickSpace
from gradedesign.finite_cell.stress import solid_points
from gradedesign.finite_cell.surface import SurfacePoints
from gradedesign.workspace.progress import report_step

#: Most points of the surface, faces of an axis and points of the solid that are looked at: evenly
#: spaced ones of them all, each standing for its neighbours.
MOST = 2**16
#: Sub-cells with less solid than the first share of theirs, or more than the second, are not cut.
CUT = (1e-6, 1.0 - 1e-6)
#: Step of differences of the field, over the shortest edge.
STEP = 1e-4
#: Farthest that the surface lies from the centroid of a cut sub-cell, over the longest edge.
NEAR = 0.5
#: A place lies on a region if it is this near to one of so many nearest points of the region, and
#: to the plane across the normal there, over the longest edge; the points of a face that a region
#: covers are nearer. Normals agree to this at least.
REACH, BESIDE, OFF, ALIKE = 0.75, 4, 0.1, 0.9
#: Points along the edge of a face, and sub-cells of each.
ALONG, OF_EACH = 2, BLOCKS // 2


#: A region with the components of traction that it carries: all of a loaded one, those that a
#: support holds.
Carried: TypeAlias = tuple[SurfacePoints, tuple[bool, bool, bool]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Places:
    """Points of elements, with what each stands for and the direction that counts there.

    Attributes
    ----------
    element : (m,) int array
    reference : (3, m) array
    weight : (m,) array, mm^3
        Area times half the edge of an element across it; volume of points of the solid.
    normal : (3, m) array
    """

    element: IntArray
    reference: FloatArray
    weight: FloatArray
    normal: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResidualPlaces:
    """Sample points at which tractions of a divided solid should vanish or balance.

    Attributes
    ----------
    free : _Places
        On the surface of the solid.
    sides : (_Places, _Places)
        On faces between elements, seen from either side.
    inner : _Places
        Of the solid, for its energy.
    """

    free: _Places
    sides: tuple[_Places, _Places]
    inner: _Places


def residual_places(elements: Elements, field: Field) -> ResidualPlaces:
    """Points at which the tractions of any solution on these elements are looked at.

    Parameters
    ----------
    elements : Elements
    field : callable
        That they were cut by.
    """
    report_step("error estimate")
    surface = _cut_surface(elements, field)
    faces, sides = _faces(elements)
    at = solid_points(elements, MOST)
    inner = _Places(
        element=at.element,
        reference=at.reference,
        weight=at.volume * (solid_volume(elements) / at.volume.sum()),
        normal=np.zeros((3, at.element.size)),
    )
    return ResidualPlaces(free=_joined([surface, faces]), sides=sides, inner=inner)


def free_components(
    elements: Elements,
    places: ResidualPlaces,
    acting: Sequence[Carried],
) -> BoolArray:
    """Components of the traction that vanish at the places on the surface, ``(3, m)``.

    Parameters
    ----------
    elements : Elements
    places : ResidualPlaces
    acting : sequence of Carried
    """
    free = np.ones(places.free.reference.shape, dtype=bool)
    for region, carried in acting:
        on = nearest_on(elements, places, region) >= 0
        free[np.ix_(carried, on)] = False
    return free


def nearest_on(elements: Elements, places: ResidualPlaces, region: SurfacePoints) -> IntArray:
    """Nearest point of a region to each place on the surface, ``(m,)``; -1 off the region."""
    at, edge = places.free, float(elements.grid.edges.max())
    points = elements.grid.lower[:, None] + elements.grid.edges[:, None] * (
        elements.position[at.element].T + at.reference
    )
    count = min(BESIDE, region.area.size)
    apart, index = KDTree(region.points.T).query(points.T, k=[*range(1, count + 1)])
    nearest = np.full(points.shape[1], -1)
    for distance, beside in zip(apart.T[::-1], index.T[::-1], strict=True):
        normal = region.normal[:, beside]
        off = np.abs(((points - region.points[:, beside]) * normal).sum(axis=0))
        along = np.abs((at.normal * normal).sum(axis=0))
        on = (distance < REACH * edge) & (off < OFF * edge) & (along > ALIKE)
        nearest[on] = beside[on]
    return nearest


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Imbalance:
    """Tractions of a solution that vanish in the exact one.

    Attributes
    ----------
    free : (3, m) array, MPa
        On surfaces without load or support.
    jump : (3, k) array, MPa
        Between elements.
    """

    free: FloatArray
    jump: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalResidual:
    """Ways in which finer elements change a value, but for a factor, see `goal_residual`.

    Attributes
    ----------
    rise, fall : float
        What they add to it and what they take off it, both positive, in its unit.
    """

    rise: float
    fall: float


def imbalance(
    elements: Elements,
    space: BrickSpace,
    u: FloatArray,
    lame: tuple[float, float],
    places: ResidualPlaces,
    *,
    thermal_strain: float = 0.0,
) -> Imbalance:
    """Tractions of displacements ``u``, (N, 3), mm, that are not in balance."""

    def traction(at: _Places) -> FloatArray:
        return _traction(_raw_stress(elements, space, u, (*lame, thermal_strain), at), at)

    here, there = places.sides
    return Imbalance(free=traction(places.free), jump=traction(here) - traction(there))


def traction_residual(
    elements: Elements,
    space: BrickSpace,
    u: FloatArray,
    lame: tuple[float, float],
    places: ResidualPlaces,
    free: BoolArray,
) -> float:
    """Squared residual of the tractions over the energy of the solution, twice each.

    The sum over faces and surfaces of ``h / 2 |t|^2 / E``, with the edge h of an element across
    and Young's modulus E, over the integral of stress times strain. Times a constant it is the
    share by which the work of the loads is too small; the constant is measured, see
    `limits.banded.RESIDUAL_FACTORS`.

    Parameters
    ----------
    elements : Elements
    space : BrickSpace
    u : (N, 3) array, mm
    lame : (float, float), MPa
    places : ResidualPlaces
    free : (3, m) bool array
        See `free_components`.

    References
    ----------
    I. Babuška, W. C. Rheinboldt (1978), A-posteriori error estimates for the finite element
    method, Int. J. Numer. Methods Eng. 12, 1597-1615: the part of the residual on faces.
    """
    own = imbalance(elements, space, u, lame, places)
    _, nu = _engineering(lame)
    lost = float(_products(own, own, places, free).sum())
    inner = _raw_stress(elements, space, u, (*lame, 0.0), places.inner)
    trace = inner[:3].sum(axis=0)
    square = (inner[:3] ** 2).sum(axis=0) + 2.0 * (inner[3:] ** 2).sum(axis=0)
    energy = float((places.inner.weight * ((1.0 + nu) * square - nu * trace**2)).sum())
    return lost / energy if energy > 0.0 else 0.0


def goal_residual(
    solution: Imbalance,
    dual: Imbalance,
    lame: tuple[float, float],
    places: ResidualPlaces,
    free: BoolArray,
) -> GoalResidual:
    """Residual of a value of the displacements, from a solution and the dual of the value.

    The sum over faces and surfaces of ``h / 2 t . t' / E`` of the tractions of both, its positive
    and its negative terms apart: errors that cancel in one grid need not in another. For the work
    of the loads, whose dual is the solution itself, it is the work times `traction_residual`, and
    the same constants apply: the energy between two errors is a quarter of that of their sum less a
    quarter of that of their difference, and so are these products.

    Parameters
    ----------
    solution, dual : Imbalance
        The dual is what forces equal to the derivative of the value by the displacements cause.
    lame : (float, float), MPa
    places : ResidualPlaces
    free : (3, m) bool array
        Where neither of them carries a traction, see `free_components`.

    References
    ----------
    R. Becker, R. Rannacher (2001), An optimal control approach to a posteriori error estimation in
    finite element methods, Acta Numerica 10, 1-102.
    S. Prudhomme, J. T. Oden (1999), On goal-oriented error estimation for elliptic problems,
    Comput. Methods Appl. Mech. Eng. 176, 313-331: the parallelogram of both errors.
    """
    youngs_modulus, _ = _engineering(lame)
    terms = _products(solution, dual, places, free) / youngs_modulus
    return GoalResidual(rise=float(terms[terms > 0.0].sum()), fall=float(-terms[terms < 0.0].sum()))


def _products(
    one: Imbalance, other: Imbalance, places: ResidualPlaces, free: BoolArray
) -> FloatArray:
    """Weighted products of the tractions of two solutions at every place, N^2/mm."""
    here, _ = places.sides
    bare = places.free.weight * (one.free * other.free * free).sum(axis=0)
    return np.concatenate([bare, here.weight * (one.jump * other.jump).sum(axis=0)])


def _engineering(lame: tuple[float, float]) -> tuple[float, float]:
    """Young's modulus, MPa, and Poisson's ratio."""
    first, second = lame
    nu = first / (2.0 * (first + second))
    return 2.0 * second * (1.0 + nu), nu


def _cut_surface(elements: Elements, field: Field) -> _Places:
    """Points of the surface in cut sub-cells."""
    share = elements.share * BLOCKS**3
    own, sub = np.nonzero((share > CUT[0]) & (share < CUT[1]))
    some = _some(own.size)
    stands_for = own.size / max(some.size, 1)
    own, sub = own[some], sub[some]
    grid = elements.grid
    corner = grid.lower[:, None] + grid.edges[:, None] * elements.position[own + elements.whole].T
    start = corner + grid.edges[:, None] * elements.centre[own, sub].T
    points, step = start.copy(), STEP * float(grid.edges.min())
    normal = _gradient(field, points, step)
    for _ in range(2):
        square = (normal**2).sum(axis=0)
        points = (
            points
            - np.where(square > 0.0, field(points) / np.where(square > 0.0, square, 1.0), 0.0)
            * normal
        )
    normal = _gradient(field, points, step)
    length = np.linalg.norm(normal, axis=0)
    near = np.linalg.norm(points - start, axis=0) < NEAR * float(grid.edges.max())
    near &= np.isfinite(length) & (length > 0.0)
    side = float(np.prod(grid.edges)) ** (1.0 / 3.0)
    weight = 0.5 * side * (side / BLOCKS) ** 2 * stands_for
    return _Places(
        element=own[near] + elements.whole,
        reference=(points[:, near] - corner[:, near]) / grid.edges[:, None],
        weight=np.full(int(near.sum()), weight),
        normal=normal[:, near] / length[near],
    )


def _faces(elements: Elements) -> tuple[_Places, tuple[_Places, _Places]]:
    """Bare faces on grid planes, and faces between elements from either side."""
    free: list[_Places] = []
    here: list[_Places] = []
    there: list[_Places] = []
    for axis in range(3):
        solid = [_solid_beside(elements, axis, side) for side in range(2)]
        covered = [np.zeros(solid[0].shape), np.zeros(solid[0].shape)]
        for lower, upper in _neighbours(elements, axis):
            for side, a, b in ((1, lower, upper), (0, upper, lower)):
                np.maximum.at(covered[side], a, solid[1 - side][b])
            some = _some(lower.size)
            stands_for = lower.size / max(some.size, 1)
            lower, upper = lower[some], upper[some]
            both: FloatArray = np.minimum(solid[1][lower], solid[0][upper]) * stands_for
            here.append(_on_face(elements, axis, 1, lower, both))
            there.append(_on_face(elements, axis, 0, upper, both))
        for side in range(2):
            bare = (solid[side] > 1.0 - 1e-3) & (covered[side] < 1e-3)
            own = np.flatnonzero(bare.any(axis=1))
            some = own[_some(own.size)]
            stands_for = own.size / max(some.size, 1)
            counts: FloatArray = bare[some].astype(np.float64) * stands_for
            free.append(_on_face(elements, axis, side, some, counts))
    return _joined(free), (_joined(here), _joined(there))


def _neighbours(elements: Elements, axis: int) -> list[tuple[IntArray, IntArray]]:
    """Pairs of elements with nodes in common on a face across an axis, the lower one first."""
    shape, position = elements.grid.shape, elements.position.astype(np.int64)
    inside = np.flatnonzero(position[:, axis] + 1 < shape[axis])
    beyond = position[inside]
    beyond[:, axis] += 1
    pairs = []
    for copy in range(int(elements.copy.max(initial=0)) + 1):
        of = np.flatnonzero(elements.copy == copy)
        table = np.full(shape, -1, dtype=np.int32)
        table[tuple(position[of].T)] = of
        upper = table[tuple(beyond.T)].astype(np.int64)
        met = upper >= 0
        lower, upper = inside[met], upper[met]
        joined = (elements.faces[lower, 2 * axis + 1] & elements.faces[upper, 2 * axis]) != 0
        pairs.append((lower[joined], upper[joined]))
    return pairs


def _solid_beside(elements: Elements, axis: int, side: int) -> FloatArray:
    """Share of solid beside parts of a face, ``(n, 4)``: of the sub-cells that touch it."""
    count = len(elements.position)
    share = np.ones((count, BLOCKS, BLOCKS, BLOCKS), dtype=np.float32)
    cut = elements.share.reshape(-1, BLOCKS, BLOCKS, BLOCKS) * BLOCKS**3
    share[elements.whole :] = np.minimum(cut, 1.0)
    layer = np.take(share, side * (BLOCKS - 1), axis=3 - axis)  # sub-cells are stored z, y, x
    parts = layer.reshape(count, ALONG, OF_EACH, ALONG, OF_EACH).mean(axis=(2, 4))
    return np.asarray(parts.reshape(count, ALONG**2), dtype=np.float64)


def _on_face(
    elements: Elements, axis: int, side: int, element: IntArray, weight: FloatArray
) -> _Places:
    """Middles of the parts of faces, weighted by the share ``(k, 4)`` of each that counts."""
    edges = elements.grid.edges
    along = (np.arange(ALONG) + 0.5) / ALONG
    second, first = np.meshgrid(along, along, indexing="ij")
    across = [d for d in range(3) if d != axis]
    reference = np.zeros((3, element.size, ALONG**2))
    reference[axis] = side
    reference[across[0]], reference[across[1]] = first.ravel(), second.ravel()
    used = (weight > 0.0).ravel()
    volume = 0.5 * float(np.prod(edges)) / ALONG**2
    normal = np.zeros((3, int(used.sum())))
    normal[axis] = 1.0
    return _Places(
        element=np.repeat(element, ALONG**2)[used],
        reference=np.ascontiguousarray(reference.reshape(3, -1)[:, used]),
        weight=volume * weight.ravel()[used],
        normal=normal,
    )


def _joined(parts: Sequence[_Places]) -> _Places:
    """Points of several sets as one."""
    return _Places(
        element=np.concatenate([p.element for p in parts]),
        reference=np.concatenate([p.reference for p in parts], axis=1),
        weight=np.concatenate([p.weight for p in parts]),
        normal=np.concatenate([p.normal for p in parts], axis=1),
    )


def _some(count: int) -> IntArray:
    """Evenly spaced numbers below a count, `MOST` of them at most."""
    return np.arange(0, count, max(1, -(-count // MOST)))


def _gradient(field: Field, points: FloatArray, step: float) -> FloatArray:
    """Central differences of a field, ``(3, m)``."""
    slopes = np.empty_like(points)
    for axis in range(3):
        shift = np.zeros((3, 1))
        shift[axis] = step
        slopes[axis] = (field(points + shift) - field(points - shift)) / (2.0 * step)
    return slopes


def _traction(stress: FloatArray, at: _Places) -> FloatArray:
    """Stress ``(6, m)``, as xx, yy, zz, yz, zx, xy, on a normal, ``(3, m)``."""
    xx, yy, zz, yz, zx, xy = stress
    x, y, z = at.normal
    return np.stack([xx * x + xy * y + zx * z, xy * x + yy * y + yz * z, zx * x + yz * y + zz * z])


def _raw_stress(
    elements: Elements,
    space: BrickSpace,
    u: FloatArray,
    lame: tuple[float, float, float],
    at: _Places,
) -> FloatArray:
    """Stress of the displacements themselves, ``(6, m)``, MPa."""
    order = np.argsort(at.element, kind="stable")
    element = at.element[order]
    changes = np.flatnonzero(np.diff(element)) + 1
    starts = np.concatenate([[0], changes, [element.size]]) if element.size else np.zeros(1, int)
    values = np.zeros((6, element.size))
    kernels.stress_in_elements(
        space.nodes,
        u,
        elements.grid.edges,
        elements.size,
        np.array(lame),
        np.zeros(len(elements.position), dtype=bool),
        gauss_places(2)[0, :2],
        starts,
        element,
        np.ascontiguousarray(at.reference[:, order]),
        values,
    )
    back = np.empty_like(values)
    back[:, order] = values
    return back
