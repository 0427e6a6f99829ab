"""Derivatives through the stress of the lattice, by displacements and densities."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.fe.load_case import PartLoadCase
from gradedesign.mechanics.fe.loads import stress_force
from gradedesign.mechanics.sizing.homogenised_model import (
    HomogenisedModel,
    effective_density,
    effective_slope,
)
from gradedesign.mechanics.sizing.lattice_stiffness import (
    as_stiffness,
    cell_stiffness,
    cell_stiffness_derivative,
)
from gradedesign.mechanics.sizing.lattice_stress import (
    LatticeStress,
    density_inside,
    from_cell_axes,
    stress_in_cells,
)


def through_local_stress(
    model: HomogenisedModel,
    rho: FloatArray,
    case: PartLoadCase,
    displacement: FloatArray,
    stress: LatticeStress,
    by_local: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Derivatives of a value that depends on the local stresses of the lattice.

    Returns ``by_displacement (3, N)``; ``by_density (M,)``: at fixed displacements.

    - ``rho (M,)``
    - ``displacement (3, N)``, mm
    - ``stress``: of that load case
    - ``by_local (M,)``: derivatives of the value by the local stress of every tetrahedron
    """
    effective = effective_density(model, rho)
    inside = density_inside(model, rho)
    share = inside / effective
    local, by_inside, by_profile = model.law.local_slopes(stress.demand, inside)
    # Beyond the law's window, which only trimmed cells leave, local stress falls as solid grows.
    by_effective = np.where(inside == effective, by_inside, -local * inside / effective**2)
    turned = stress_in_cells(model, as_stiffness(cell_stiffness(model, rho)), case, displacement)
    in_cells = model.law.stress_slope(turned, by_local * share * by_profile)
    by_displacement, by_density = _through_stress(model, rho, case, displacement, in_cells)
    return by_displacement, by_density + by_local * by_effective * effective_slope(model, rho)


def through_buckling(
    model: HomogenisedModel,
    rho: FloatArray,
    case: PartLoadCase,
    displacement: FloatArray,
    stress: LatticeStress,
    by_use: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """As `through_local_stress`, of the utilisations of the resistance against buckling.

    ``by_use (2, M)`` holds the derivatives of the value by those in short and in long waves.
    """
    some = np.flatnonzero(by_use.any(axis=0))
    law = model.law.among(some)
    effective = effective_density(model, rho)
    by_profile, by_effective = law.buckling_slopes(
        stress.buckling[:, some], effective[some], by_use[:, some]
    )
    if model.cut_share is not None:
        by_profile = by_profile / model.cut_share[some]
    turned = stress_in_cells(model, as_stiffness(cell_stiffness(model, rho)), case, displacement)
    in_cells = np.zeros(turned.shape)
    in_cells[:, some] = (
        law.buckling_stress_slope(turned[:, some], by_profile) / model.material.youngs_modulus
    )
    by_displacement, by_density = _through_stress(model, rho, case, displacement, in_cells)
    by_density[some] += by_effective * effective_slope(model, rho)[some]
    return by_displacement, by_density


def _through_stress(
    model: HomogenisedModel,
    rho: FloatArray,
    case: PartLoadCase,
    displacement: FloatArray,
    in_cells: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Derivatives by displacements and densities of those ``(6, M, q)`` by stress in the cells."""
    slope = as_stiffness(cell_stiffness_derivative(model, rho))
    by_density = (in_cells * stress_in_cells(model, slope, case, displacement)).sum(axis=(0, 2))
    stiffness = cell_stiffness(model, rho)
    form = "abm,amq->bmq" if stiffness.ndim == 3 else "abqm,amq->bmq"
    work = np.einsum(form, stiffness, from_cell_axes(model, in_cells), optimize=True)
    return stress_force(model.space, work), by_density
