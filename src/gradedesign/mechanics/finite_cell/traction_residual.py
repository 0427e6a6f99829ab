"""Error of a solution on finite cells, from tractions that are not in balance.

Of a Galerkin solution the work of the loads is too small by the energy of its error. What makes
that error are tractions on surfaces that carry none, and jumps of traction between elements: both
vanish in the exact solution. Nothing else is looked at, so that the measure needs no second grid
and does not mind how a grid happens to lie.

The displacement of a place errs by the energy between the error of the solution and that of its
dual, which a unit force there causes (Becker and Rannacher 2001): what the tractions of both say
together, place by place, stands for that as the square of one solution's does for the work. The
whole part's work hides a plate that dents where it is thin; the dual is large just there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy.spatial import KDTree

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.common.system.threads import in_ranges
from gradedesign.mechanics.finite_cell import _stress_kernels as kernels
from gradedesign.mechanics.finite_cell.basis import gauss_places
from gradedesign.mechanics.finite_cell.elements import Elements
from gradedesign.mechanics.finite_cell.residual_places import Places, ResidualPlaces
from gradedesign.mechanics.finite_cell.space import BrickSpace
from gradedesign.mechanics.finite_cell.surface import SurfacePoints

#: A place lies on a region if it is this near to one of so many nearest points of the region, and
#: to the plane across the normal there, over the longest edge; the points of a face that a region
#: covers are nearer. Normals agree to this at least. Chosen, not measured.
REACH, BESIDE, OFF, ALIKE = 0.75, 4, 0.1, 0.9


#: A region with the components of traction that it carries: all of a loaded one, those that a
#: support holds.
Carried: TypeAlias = tuple[SurfacePoints, tuple[bool, bool, bool]]


def free_components(
    elements: Elements,
    places: ResidualPlaces,
    acting: Sequence[Carried],
) -> BoolArray:
    """Components of the traction that vanish at the places on the surface, ``(3, m)``."""
    free = np.ones(places.free.reference.shape, dtype=bool)
    for region, carried in acting:
        on = nearest_on(elements, places, region) >= 0
        free &= ~(np.array(carried)[:, None] & on)
    return free


def nearest_on(elements: Elements, places: ResidualPlaces, region: SurfacePoints) -> IntArray:
    """Nearest point of a region to each place on the surface, ``(m,)``; -1 off the region."""
    at, edge = places.free, float(elements.grid.edges.max())
    points = elements.grid.lower[:, None] + elements.grid.edges[:, None] * (
        elements.position[at.element].T + at.reference
    )
    count = min(BESIDE, region.area.size)
    # Bounded, since a place on the axis of a bore is as far from all of its points.
    apart, index = KDTree(region.points.T).query(
        points.T, k=[*range(1, count + 1)], distance_upper_bound=REACH * edge
    )
    nearest = np.full(points.shape[1], -1)
    for distance, found in zip(apart.T[::-1], index.T[::-1], strict=True):
        own = np.flatnonzero(np.isfinite(distance))
        beside = found[own]
        normal = region.normal[:, beside]
        off = np.abs(((points[:, own] - region.points[:, beside]) * normal).sum(axis=0))
        along = np.abs((at.normal[:, own] * normal).sum(axis=0))
        on = (off < OFF * edge) & (along > ALIKE)
        nearest[own[on]] = beside[on]
    return nearest


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Imbalance:
    """Tractions of a solution that vanish in the exact one."""

    free: FloatArray  #: ``(3, m)``, MPa. On surfaces without load or support.
    jump: FloatArray  #: ``(3, k)``, MPa. Between elements.


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalResidual:
    """Ways in which finer elements change a value, but for a factor, see `goal_residual`."""

    #: What they add to it and what they take off it, both positive, in its unit.
    rise: float
    fall: float


def imbalance(
    elements: Elements,
    space: BrickSpace,
    u: FloatArray,
    moduli: FloatArray,
    places: ResidualPlaces,
    *,
    thermal_strain: float = 0.0,
) -> Imbalance:
    """Tractions of displacements ``u``, (N, 3), mm, that are not in balance."""

    def traction(at: Places) -> FloatArray:
        return _traction(_raw_stress(elements, space, u, moduli, thermal_strain, at), at)

    here, there = places.sides
    return Imbalance(free=traction(places.free), jump=traction(here) - traction(there))


def traction_residual(
    elements: Elements,
    space: BrickSpace,
    u: FloatArray,
    moduli: FloatArray,
    places: ResidualPlaces,
    free: BoolArray,
    *,
    thermal_strain: float = 0.0,
) -> float:
    """Squared residual of the tractions over the energy of the solution, twice each.

    The sum over faces and surfaces of ``h / 2 |t|^2 / E``, with the edge h of an element across
    and Young's modulus E, over the integral of stress times strain. Times a constant it is the
    share by which the work of the loads is too small; the constant is measured, see
    `limits.banded.RESIDUAL_FACTORS`.

    ``u (N, 3)``, mm. ``moduli``, MPa, as `Material.moduli`. ``free (3, m)``: see
    `free_components`.

    References
    ----------
    I. Babuška, W. C. Rheinboldt (1978), A-posteriori error estimates for the finite element
    method, Int. J. Numer. Methods Eng. 12, 1597-1615: the part of the residual on faces.
    """
    own = imbalance(elements, space, u, moduli, places, thermal_strain=thermal_strain)
    lost = float(_products(own, own, places, free).sum())
    inner = _raw_stress(elements, space, u, moduli, thermal_strain, places.inner)
    energy = 2.0 * float(places.inner.weight @ energy_density(moduli, inner))
    return lost / (mean_modulus(moduli) * energy) if energy > 0.0 else 0.0


def goal_residual(
    solution: Imbalance,
    dual: Imbalance,
    moduli: FloatArray,
    places: ResidualPlaces,
    free: BoolArray,
) -> GoalResidual:
    """Residual of a value of the displacements, from a solution and the dual of the value.

    The sum over faces and surfaces of ``h / 2 t . t' / E`` of the tractions of both, its positive
    and its negative terms apart: errors that cancel in one grid need not in another. For the work
    of the loads, whose dual is the solution itself, it is the work times `traction_residual`, and
    the same constants apply: the energy between two errors is a quarter of that of their sum less a
    quarter of that of their difference, and so are these products.

    ``solution``, ``dual``: the dual is what forces equal to the derivative of the value by the
    displacements cause. ``moduli``, MPa, as `Material.moduli`. ``free (3, m)``: where neither of
    them carries a traction, see `free_components`.

    References
    ----------
    R. Becker, R. Rannacher (2001), An optimal control approach to a posteriori error estimation in
    finite element methods, Acta Numerica 10, 1-102.
    S. Prudhomme, J. T. Oden (1999), On goal-oriented error estimation for elliptic problems,
    Comput. Methods Appl. Mech. Eng. 176, 313-331: the parallelogram of both errors.
    """
    terms = _products(solution, dual, places, free) / mean_modulus(moduli)
    return GoalResidual(rise=float(terms[terms > 0.0].sum()), fall=float(-terms[terms < 0.0].sum()))


def _products(
    one: Imbalance, other: Imbalance, places: ResidualPlaces, free: BoolArray
) -> FloatArray:
    """Weighted products of the tractions of two solutions at every place, N^2/mm."""
    here, _ = places.sides
    bare = places.free.weight * (one.free * other.free * free).sum(axis=0)
    return np.concatenate([bare, here.weight * (one.jump * other.jump).sum(axis=0)])


def energy_density(moduli: FloatArray, stress: FloatArray) -> FloatArray:
    """Strain energy per volume, ``(m,)``, N/mm^2, of stresses ``(6, m)``, MPa.

    As xx, yy, zz, yz, zx, xy.
    """
    normal, shear = stress[:3], stress[3:]
    along = (normal * (np.linalg.inv(moduli[0]) @ normal)).sum(axis=0)
    return np.asarray(0.5 * (along + (1.0 / moduli[1][[1, 2, 0], [2, 0, 1]]) @ shear**2))


def mean_modulus(moduli: FloatArray) -> float:
    """Harmonic mean of Young's moduli along the axes, MPa."""
    return 3.0 / float(np.trace(np.linalg.inv(moduli[0])))


def _traction(stress: FloatArray, at: Places) -> FloatArray:
    """Stress ``(6, m)``, as xx, yy, zz, yz, zx, xy, on a normal, ``(3, m)``."""
    xx, yy, zz, yz, zx, xy = stress
    x, y, z = at.normal
    return np.stack([xx * x + xy * y + zx * z, xy * x + yy * y + yz * z, zx * x + yz * y + zz * z])


def _raw_stress(
    elements: Elements,
    space: BrickSpace,
    u: FloatArray,
    moduli: FloatArray,
    thermal_strain: float,
    at: Places,
) -> FloatArray:
    """Stress of the displacements themselves, ``(6, m)``, MPa."""
    order = np.argsort(at.element, kind="stable")
    element = at.element[order]
    changes = np.flatnonzero(np.diff(element)) + 1
    starts = np.concatenate([[0], changes, [element.size]]) if element.size else np.zeros(1, int)
    values = np.zeros((6, element.size))
    in_ranges(
        kernels.stress_in_elements,
        range(starts.size - 1),
        space.nodes,
        u,
        elements.grid.edges,
        elements.size,
        moduli,
        thermal_strain,
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
