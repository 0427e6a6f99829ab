"""Nodal forces of loads on regions, of acceleration and of a change of temperature."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import SolverError
from gradedesign.geometry.part.regions import Region
from gradedesign.mechanics.fe.load_case import LoadCaseSpecification
from gradedesign.mechanics.fe.loads import WORST_CONDITION
from gradedesign.mechanics.fe.region_load import RegionLoad, bearing_field, region_resultant
from gradedesign.mechanics.finite_cell.basis import (
    CUT_POINTS,
    gauss_places,
    gauss_weights,
    gradients_at,
    shapes_at,
)
from gradedesign.mechanics.finite_cell.elements import Elements, element_volumes
from gradedesign.mechanics.finite_cell.space import BrickSpace
from gradedesign.mechanics.finite_cell.surface import SurfacePoints
from gradedesign.mechanics.material.material import Material

#: Points or elements worked on at once. Chosen, not measured.
CHUNK = 2**14


def case_force(
    elements: Elements,
    space: BrickSpace,
    case: LoadCaseSpecification,
    regions: Mapping[str, Region],
    places: Mapping[str, SurfacePoints],
    material: Material,
) -> FloatArray:
    """Nodal forces of loads and acceleration of one load case, ``(N, 3)``, N.

    Every load on a region has exactly the resultant force and moment that it has on the part.
    Raises `SolverError` if the solid on a region lies on a line and cannot carry a moment.
    """
    force = np.zeros((len(space.place), 3))
    for load in case.load:
        traction = _region_traction(regions[load.region], load, places[load.region])
        force += scattered(space, places[load.region], traction)
    if any(case.acceleration):
        force += material.density * _volume_force(elements, space, np.array(case.acceleration))
    return force


def thermal_force(
    elements: Elements, space: BrickSpace, change: float, material: Material
) -> FloatArray:
    """Nodal forces of free thermal expansion by a change of temperature in K, ``(N, 3)``, N."""
    normal, _ = material.moduli
    pressure = normal.sum(axis=1) * material.thermal_expansion * change
    return pressure * _divergence_force(elements, space)


def _region_traction(region: Region, load: RegionLoad, at: SurfacePoints) -> FloatArray:
    """Traction at the points of a region, ``(3, m)``, MPa.

    A pressure acts along the part's normals, a bearing load along the radii of its bore; the rest
    of the resultant is spread as under a rigid
    stamp on an elastic bed, ``a + b x (p - c)``.
    """
    force, moment = region_resultant(region, load)
    traction = np.zeros_like(at.points)
    if load.pressure is not None:
        traction -= load.pressure * at.normal
    if load.bearing is not None:
        traction += bearing_field(region, load.bearing, at.points, at.area)(at.points)
    total = float(at.area.sum())
    centre = at.points @ at.area / total
    arm = at.points - centre[:, None]
    reach = float(np.sqrt((arm**2).sum(axis=0).max()))
    modes = np.stack(
        [np.broadcast_to(axis[:, None], arm.shape) for axis in np.eye(3)]
        + [np.cross(axis, arm, axisb=0, axisc=0) / reach for axis in np.eye(3)]
    )
    have_force, have_moment = _resultant(traction, at.area, arm)
    wanted_moment = moment + np.cross(region.centroid - centre, force)
    missing = np.concatenate([force - have_force, (wanted_moment - have_moment) / reach])
    matrix = np.zeros((6, 6))
    for k, mode in enumerate(modes):
        own_force, own_moment = _resultant(mode, at.area, arm)
        matrix[:, k] = np.concatenate([own_force, own_moment / reach]) / total
    # Without a moment to carry, a force through the centre needs no turning part.
    if np.abs(missing[3:]).max() <= 1e-12 * np.abs(missing[:3]).max(initial=0.0):
        return traction + (missing[:3] / total)[:, None]
    condition = float(np.linalg.cond(matrix))
    if not condition < WORST_CONDITION:
        raise SolverError(
            f"the solid on region '{region.name}' (reach {reach:g} mm, area {total:g} mm^2) lies "
            "on a line and cannot carry a moment about it; choose a wider region or a force "
            "through its centre"
        )
    weights = np.linalg.solve(matrix, missing) / total
    return traction + np.tensordot(weights, modes, axes=1)


def scattered(space: BrickSpace, at: SurfacePoints, traction: FloatArray) -> FloatArray:
    """Consistent nodal forces of a traction ``(3, m)`` at surface points, ``(N, 3)``, N."""
    force = np.zeros((3, len(space.place)))
    for k in range(0, at.area.size, CHUNK):
        part = slice(k, k + CHUNK)
        shapes = shapes_at(at.reference[:, part]) * at.area[part, None]
        nodes = space.nodes[at.element[part]].ravel()
        for c in range(3):
            own = shapes * traction[c, part, None]
            force[c] += np.bincount(nodes, weights=own.ravel(), minlength=force.shape[1])
    return np.ascontiguousarray(force.T)


def _resultant(
    traction: FloatArray, area: FloatArray, arm: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Force and moment about the centre of a traction."""
    return traction @ area, np.cross(arm, traction, axis=0) @ area


def _volume_force(elements: Elements, space: BrickSpace, pull: FloatArray) -> FloatArray:
    """Nodal forces of a unit density under an acceleration, ``(N, 3)``."""
    shapes = shapes_at(gauss_places(CUT_POINTS))
    return np.outer(_summed(elements, space, shapes), pull)


def _divergence_force(elements: Elements, space: BrickSpace) -> FloatArray:
    """Nodal forces of a unit isotropic stress, ``(N, 3)``."""
    gradients = gradients_at(gauss_places(CUT_POINTS), elements.grid.edges)
    return np.stack(
        [_summed(elements, space, gradients[:, d], slopes=True) for d in range(3)], axis=1
    )


def _summed(
    elements: Elements, space: BrickSpace, values: FloatArray, *, slopes: bool = False
) -> FloatArray:
    """Integral over the solid of functions of the nodes, given at the Gauss points, ``(N,)``.

    They, or their slopes, are those of an element as large as a brick of the grid.
    """
    volume = element_volumes(elements) / (elements.size if slopes else 1)
    total = np.zeros(len(space.place))
    whole = np.tile(gauss_weights(CUT_POINTS) @ values, (elements.whole, 1))
    own = np.concatenate([whole, elements.weights @ values]) * volume[:, None]
    np.add.at(total, space.nodes.ravel(), own.ravel())
    return total
