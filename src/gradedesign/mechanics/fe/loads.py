"""Consistent nodal forces of tractions, pressures, resultants, inertia and thermal expansion.

Every function returns forces at the nodes of the space, ``(3, N)`` in N, which do the same work
on every displacement of the space as the load itself.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import VOIGT, FloatArray, IntArray
from gradedesign.errors import SolverError
from gradedesign.geometry.tets.tet_mesh import signed_volumes
from gradedesign.mechanics.fe._stress_kernels import initial_strain_force
from gradedesign.mechanics.fe.element_points import (
    ScalarField,
    barycentric,
    coordinate_gradients,
    shape_derivatives,
    values_at,
)
from gradedesign.mechanics.fe.facet_quadrature import facet_points, facet_shapes, reference_rule
from gradedesign.mechanics.fe.facets import facet_areas, facet_nodes, outward_area_vectors
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.fe.stiffness import (
    MomentStiffness,
    Stiffness,
    element_count,
    gauss_equivalent,
    kernel_coefficients,
    known_at,
)

#: A traction in MPa: one vector (3,), one per facet (3, k), or a function of points (3, ...) in mm.
Traction: TypeAlias = ArrayLike | Callable[[FloatArray], FloatArray]

#: A region is too narrow to carry a moment when its load matrix is conditioned worse than this.
#: Chosen, not measured.
WORST_CONDITION = 1e10


def traction_force(space: TetSpace, facets: ArrayLike, traction: Traction) -> FloatArray:
    """Nodal forces of a traction on facets.

    Raises `SolverError` if there is no facet, or one is no face of the mesh. Returns ``(3, N)``, N.

    ``facets (k, 3)``: vertex indices. ``traction (3,) or (3, k)``, MPa, or callable: constant,
    constant on each facet, or a function of points ``(3, ...)`` in mm returning ``(3, ...)``; a
    function is integrated exactly up to degree 4 (quadratic elements).
    """
    nodes = facet_nodes(space, facets)
    area = facet_areas(space, facets)
    if callable(traction):
        return _integrated(space, nodes, area, traction)
    constant = np.asarray(traction, dtype=np.float64)
    if constant.shape not in {(3,), (3, len(area))}:
        raise ValueError(f"traction has shape {constant.shape}, expected (3,) or (3, {len(area)})")
    per_facet = constant.reshape(3, -1) * area
    # The integral of a quadratic corner function over a straight triangle is 0, that of a
    # mid-edge function a third of the area; linear functions have a third each.
    loaded = nodes[3:] if space.order == 2 else nodes
    return _scattered(space, loaded, np.repeat(per_facet[:, None] / 3, 3, axis=1))


def pressure_force(space: TetSpace, facets: ArrayLike, pressure: ArrayLike) -> FloatArray:
    """Nodal forces of a pressure, which pushes into the solid where it is positive.

    Raises `SolverError` if there is no facet, or one lies inside the mesh. Returns ``(3, N)``, N.

    ``facets (k, 3)``: vertex indices of boundary facets, in any order. ``pressure``: float or (k,)
    array, MPa.
    """
    outward = outward_area_vectors(space, facets)
    normal = outward / np.linalg.norm(outward, axis=0)
    return traction_force(space, facets, -np.asarray(pressure, dtype=np.float64) * normal)


def resultant_load(
    space: TetSpace,
    facets: ArrayLike,
    force: ArrayLike,
    moment: ArrayLike | None = None,
    about: ArrayLike = (0.0, 0.0, 0.0),
) -> FloatArray:
    """Nodal forces on facets with a given total.

    Without a moment the traction is uniform, so the force acts through the centroid of the facets.
    With one, the traction is ``a + b x (p - c)``, the distribution of a rigid stamp on an elastic
    bed, and its resultant force and moment are the given ones. Raises `SolverError` if the facets
    lie on a line, or have no area, and so cannot carry a moment. Returns ``(3, N)``, N.

    - ``facets (k, 3)``: vertex indices
    - ``force (3,)``, N
    - ``moment (3,)``, N mm, or None
    - ``about (3,)``, mm: the point that the moment refers to
    """
    area = facet_areas(space, facets)
    wanted = np.asarray(force, dtype=np.float64)
    if wanted.shape != (3,):
        raise ValueError(f"force has shape {wanted.shape}, expected (3,)")
    if not area.sum() > 0.0:
        raise SolverError("the loaded facets have no area; check the region and the mesh")
    if moment is None:
        return traction_force(space, facets, wanted / area.sum())
    nodes = facet_nodes(space, facets)
    centre = space.nodes[:, nodes[:3]].mean(axis=1) @ area / area.sum()
    reach = float(np.sqrt((((space.nodes[:, nodes[:3]].T - centre) ** 2).sum(axis=2)).max()))
    modes = []
    for axis in np.eye(3):
        modes.append(traction_force(space, facets, axis / area.sum()))
    for axis in np.eye(3):
        modes.append(_integrated(space, nodes, area, _turning(axis, centre, reach * area.sum())))
    totals = [resultant(space, mode, about=centre) for mode in modes]
    matrix = np.array([np.concatenate([f, m / reach]) for f, m in totals]).T
    condition = float(np.linalg.cond(matrix))
    if not condition < WORST_CONDITION:
        raise SolverError(
            f"the loaded facets (reach {reach:g} mm, area {area.sum():g} mm^2) lie on a line and "
            "cannot carry a moment about it; choose a wider region or a force instead"
        )
    arm = np.asarray(about, dtype=np.float64) - centre
    turn = np.asarray(moment, dtype=np.float64) + np.cross(arm, wanted)
    weights = np.linalg.solve(matrix, np.concatenate([wanted, turn / reach]))
    return np.tensordot(weights, np.array(modes), axes=1)


def body_force(space: TetSpace, density: ArrayLike, acceleration: ArrayLike) -> FloatArray:
    """Nodal forces of an acceleration field such as gravity on the mass of the elements.

    ``density``: float or (M,) array, t/mm^3. ``acceleration (3,)``, mm/s^2: the acceleration that
    pulls: gravity is ``(0, 0, -9810)``. Returns ``(3, N)``, N.
    """
    pull = np.asarray(acceleration, dtype=np.float64)
    if pull.shape != (3,):
        raise ValueError(f"acceleration has shape {pull.shape}, expected (3,)")
    mass = signed_volumes(space.mesh) * np.asarray(density, dtype=np.float64)
    # Integrals of the shape functions over a straight tetrahedron of volume 1.
    share = np.full(4, 0.25) if space.order == 1 else np.repeat([-0.05, 0.2], [4, 6])
    count = space.nodes.shape[1]
    weight = np.bincount(
        space.elements.ravel(), weights=np.outer(share, mass).ravel(), minlength=count
    )
    return np.outer(pull, weight)


def thermal_force(
    space: TetSpace,
    stiffness: Stiffness,
    expansion: float,
    temperature_change: ScalarField,
) -> FloatArray:
    """Nodal forces that free thermal expansion exerts, the integral of ``B^T C alpha dT``.

    The stress follows from `element_stress` with the same expansion as thermal strain. Returns
    ``(3, N)``, N.

    ``expansion``, 1/K. ``temperature_change``, (M,) or (M, 4) array, or callable, K: a function is
    evaluated at the Gauss points, exact for a linear field; for a `MomentStiffness` it must be even
    in every element.
    """
    if element_count(stiffness) != space.element_count:
        raise SolverError(
            f"the stiffness is given for {element_count(stiffness)} elements, but the space has "
            f"{space.element_count}; build both from the same mesh"
        )
    heated = values_at(space, temperature_change, "gauss")
    if isinstance(stiffness, MomentStiffness):
        if callable(temperature_change) or np.ndim(temperature_change) > 1:
            raise SolverError(
                "a stiffness is given by its moments, which know the thermal forces of a "
                "temperature change that is even in every element only; give one per element"
            )
        stiffness = gauss_equivalent(stiffness)
    return initial_strain_force(
        space.nodes,
        space.elements,
        kernel_coefficients(known_at(stiffness, "gauss")),
        shape_derivatives(space.order, barycentric("gauss")),
        expansion * heated,
    )


def stress_force(space: TetSpace, stress: FloatArray) -> FloatArray:
    """Nodal forces ``(3, N)`` that do the work of a stress on strains, summed over points.

    ``stress (6, M, 4)``: Voigt, at the Gauss points, each with the volume that it stands for: N mm.
    """
    gradients = coordinate_gradients(space)
    shapes = shape_derivatives(space.order, barycentric("gauss"))
    flux = np.einsum("xymq,mvy->xvqm", stress[VOIGT], gradients, optimize=True)
    return _scattered(
        space,
        space.elements.astype(np.int64),
        np.einsum("qav,xvqm->xam", shapes, flux, optimize=True),
    )


def resultant(
    space: TetSpace, force: FloatArray, about: ArrayLike = (0.0, 0.0, 0.0)
) -> tuple[FloatArray, FloatArray]:
    """Total force ``(3,)`` in N and moment ``(3,)`` in N mm about a point of nodal forces."""
    arm = space.nodes - np.asarray(about, dtype=np.float64)[:, None]
    return force.sum(axis=1), np.cross(arm, force, axis=0).sum(axis=1)


def _turning(
    axis: FloatArray, centre: FloatArray, scale: float
) -> Callable[[FloatArray], FloatArray]:
    """The traction field ``axis x (p - centre) / scale``."""

    def field(points: FloatArray) -> FloatArray:
        arm = points - centre.reshape(3, *[1] * (points.ndim - 1))
        return np.cross(axis, arm, axisb=0, axisc=0) / scale

    return field


def _integrated(
    space: TetSpace,
    nodes: IntArray,
    area: FloatArray,
    traction: Callable[[FloatArray], FloatArray],
) -> FloatArray:
    """Nodal forces of a traction function by quadrature over the facets."""
    points = facet_points(space.nodes[:, nodes[:3]])
    reference, weights = reference_rule()
    values = np.asarray(traction(points), dtype=np.float64)
    if values.shape != points.shape:
        raise ValueError(f"traction returned shape {values.shape} for points {points.shape}")
    shapes = facet_shapes(space.order, reference) * (2.0 * weights)
    return _scattered(space, nodes, np.einsum("dkq,aq,k->dak", values, shapes, area))


def _scattered(space: TetSpace, nodes: IntArray, forces: FloatArray) -> FloatArray:
    """Add forces ``(3, a, k)`` at nodes ``(a, k)`` into one vector ``(3, N)``."""
    count = space.nodes.shape[1]
    index = nodes.ravel()
    return np.array([np.bincount(index, weights=f.ravel(), minlength=count) for f in forces])
