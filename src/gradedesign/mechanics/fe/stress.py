"""Stress in elements, von Mises stress, averages at nodes and percentiles by volume."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import VOIGT, FloatArray, read_only
from gradedesign.common.system.threads import in_ranges
from gradedesign.errors import SolverError
from gradedesign.geometry.tets.tet_mesh import signed_volumes
from gradedesign.mechanics.fe._stress_kernels import stress_at_points
from gradedesign.mechanics.fe.element_points import (
    ScalarField,
    Where,
    barycentric,
    shape_derivatives,
    values_at,
)
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.fe.stiffness import (
    Stiffness,
    element_count,
    kernel_coefficients,
    known_at,
)

#: Share of the values that `weighted_percentile` puts in order, over that above the percentile: of
#: equal weights a third of them is enough.
_SORTED = 3.0


def element_stress(
    space: TetSpace,
    stiffness: Stiffness,
    displacement: FloatArray,
    *,
    thermal_strain: ScalarField = 0.0,
    at: Where = "gauss",
) -> FloatArray:
    """Stress tensors at four points of every element.

    Raises `SolverError` if stiffness or displacement belong to another space. Returns
    ``(3, 3, M, 4)``, MPa.

    ``displacement (3, N)``, mm. ``thermal_strain``, (M,) or (M, 4) array, or callable: free strain
    of the material, alpha times temperature change, equal in all directions. ``at``: "gauss" or
    "vertices"; Gauss points stand for a quarter of the volume each and are the more accurate.
    """
    voigt = _evaluated(space, stiffness, displacement, thermal_strain, at, von_mises_only=False)
    return voigt[VOIGT]


def element_von_mises(
    space: TetSpace,
    stiffness: Stiffness,
    displacement: FloatArray,
    *,
    thermal_strain: ScalarField = 0.0,
    at: Where = "gauss",
) -> FloatArray:
    """Von Mises stress at four points of every element, ``(M, 4)``, MPa.

    The same as `von_mises` of `element_stress` at a tenth of its memory.
    """
    return _evaluated(space, stiffness, displacement, thermal_strain, at, von_mises_only=True)[0]


def von_mises(stress: FloatArray) -> FloatArray:
    """Von Mises stress ``(...)`` of stress tensors ``(3, 3, ...)``, MPa.

    Examples
    --------
    >>> float(von_mises(np.diag([250.0, 0.0, 0.0])))
    250.0
    """
    s = stress
    direct = (s[0, 0] - s[1, 1]) ** 2 + (s[1, 1] - s[2, 2]) ** 2 + (s[2, 2] - s[0, 0]) ** 2
    shear = s[1, 2] ** 2 + s[0, 2] ** 2 + s[0, 1] ** 2
    return np.sqrt(0.5 * direct + 3.0 * shear)


def nodal_average(space: TetSpace, values: FloatArray) -> FloatArray:
    """Mean at each node of the values of the elements around it, by their volume.

    ``values (..., M, 4) or (..., M, 10)``: at the vertices of every element, as from
    ``element_stress(..., at="vertices")``, or at all nodes of quadratic ones. Returns ``(..., n)``:
    one value per vertex of the mesh, or per node of the space; NaN where no element touches it.
    """
    share = signed_volumes(space.mesh)
    each = values.shape[-1]
    elements = space.mesh.tets if each == 4 else space.elements
    n = space.mesh.points.shape[1] if each == 4 else space.node_count
    if values.shape[-2:] != elements.shape[::-1]:
        raise ValueError(f"values {values.shape} do not fit {elements.shape[1]} elements")
    index = elements.T.ravel()
    total = np.bincount(index, weights=np.repeat(share, each), minlength=n)
    rows = values.reshape(-1, elements.shape[1], each)
    sums = [np.bincount(index, (row * share[:, None]).ravel(), minlength=n) for row in rows]
    averages = np.full((len(sums), n), np.nan)
    np.divide(sums, total, out=averages, where=total > 0.0)
    return averages.reshape(*values.shape[:-2], n)


def weighted_percentile(values: ArrayLike, weights: ArrayLike, percentile: float) -> float:
    """Smallest of the values that at least a percentage of the weight does not exceed.

    No interpolation: the answer is one of the values, the smallest ``v`` for which
    ``sum(weights[values <= v]) >= percentile / 100 * sum(weights)``. Values of weight 0 do not
    count, and splitting a sample in two of half its weight changes nothing. Raises `ValueError` if
    shapes differ, a value is NaN, a weight is negative or all are 0.

    ``weights``: of the same shape, not negative; volumes for a volume percentile. ``percentile``:
    more than 0, at most 100.

    Examples
    --------
    >>> weighted_percentile([1.0, 2.0, 9.0], [5.0, 4.0, 1.0], 90.0)
    2.0
    """
    value = np.asarray(values, dtype=np.float64).ravel()
    weight = np.asarray(weights, dtype=np.float64).ravel()
    if not 0.0 < percentile <= 100.0:
        raise ValueError(f"percentile is {percentile:g}, expected more than 0 and at most 100")
    if value.shape != weight.shape:
        raise ValueError(f"{value.size} values but {weight.size} weights")
    if np.isnan(value).any() or not (weight >= 0.0).all() or not weight.sum() > 0.0:
        raise ValueError(
            "a value is NaN, a weight is negative or NaN, or there is no weight at all; "
            "expected numbers with non-negative weights"
        )
    counted = weight > 0.0
    value, weight = value[counted], weight[counted]
    # High percentiles of many values: those that lie below for sure need no order.
    first = int((1.0 - _SORTED * (1.0 - percentile / 100.0)) * (value.size - 1))
    under = 0.0
    if first > 0:
        low = value < np.partition(value, first)[first]
        beneath = float(weight[low].sum())
        if beneath < percentile / 100.0 * weight.sum():
            under, value, weight = beneath, value[~low], weight[~low]
    order = np.argsort(value, kind="stable")
    below = under + np.cumsum(weight[order])
    # Rounding of the cumulative sum must not push an exactly met share to the next value.
    wanted = percentile / 100.0 * below[-1] * (1.0 - 1e-12)
    return float(value[order][np.searchsorted(below, wanted, side="left")])


def _evaluated(
    space: TetSpace,
    stiffness: Stiffness,
    displacement: FloatArray,
    thermal_strain: ScalarField,
    at: Where,
    *,
    von_mises_only: bool,
) -> FloatArray:
    """Run the kernel after checking that all arguments belong together."""
    if element_count(stiffness) != space.element_count:
        raise SolverError(
            f"the stiffness is given for {element_count(stiffness)} elements, but the space has "
            f"{space.element_count}; build both from the same mesh"
        )
    if displacement.shape != space.nodes.shape:
        raise SolverError(
            f"the displacement has shape {displacement.shape}, expected {space.nodes.shape} for "
            "the space"
        )
    shapes = shape_derivatives(space.order, barycentric(at))
    result = np.zeros((1 if von_mises_only else 6, space.element_count, len(shapes)))
    in_ranges(
        stress_at_points,
        range(space.element_count),
        space.nodes,
        space.elements,
        kernel_coefficients(known_at(stiffness, at)),
        shapes,
        values_at(space, thermal_strain, at),
        read_only(np.asarray(displacement, dtype=np.float64)),
        result,
    )
    return result
