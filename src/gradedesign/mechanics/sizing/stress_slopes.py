"""Derivatives through the local stress of the lattice, by displacements and densities."""

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

    Parameters
    ----------
    rho : (M,) array
    displacement : (3, N) array, mm
    stress : LatticeStress
        Of that load case.
    by_local : (M,) array
        Derivatives of the value by the local stress of every tetrahedron.

    Returns
    -------
    by_displacement : (3, N) array
    by_density : (M,) array
        At fixed displacements.
    """
    effective = effective_density(model, rho)
    inside = effective
    if model.effective is not None:
        inside = np.clip(effective, *model.law.window)
    share = inside / effective
    local, by_inside, by_profile = model.law.local_slopes(stress.demand, inside)
    # Beyond the law's window, which only trimmed cells leave, local stress falls as solid grows.
    by_effective = np.where(inside == effective, by_inside, -local * inside / effective**2)
    by_density = by_local * by_effective * effective_slope(model, rho)
    stiffness = cell_stiffness(model, rho)
    turned = stress_in_cells(model, as_stiffness(stiffness), case, displacement)
    in_cells = model.law.stress_slope(turned, by_local * share * by_profile)
    slope = as_stiffness(cell_stiffness_derivative(model, rho))
    by_density += (in_cells * stress_in_cells(model, slope, case, displacement)).sum(axis=(0, 2))
    form = "abm,amq->bmq" if stiffness.ndim == 3 else "abqm,amq->bmq"
    work = np.einsum(form, stiffness, from_cell_axes(model, in_cells), optimize=True)
    return stress_force(model.space, work), by_density
