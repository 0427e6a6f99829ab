"""Macroscopic stress of the lattice phase, and the local stress it causes at any density."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import VOIGT_COUNTS, VOIGT_PLACES, FloatArray, locked
from gradedesign.mechanics.fe.load_case import PartLoadCase
from gradedesign.mechanics.fe.stiffness import Stiffness
from gradedesign.mechanics.fe.stress import element_stress, element_von_mises
from gradedesign.mechanics.sizing.homogenised_model import (
    HomogenisedModel,
    effective_density,
    nominal_density,
)
from gradedesign.mechanics.sizing.lattice_stiffness import as_stiffness, cell_stiffness


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LatticeStress:
    """Stress demand of the lattice phase of every tetrahedron in one load case."""

    #: ``(k, M)``, MPa. Means over the tetrahedron's quadrature points, of every law in turn. Where
    #: a law knows the local stress under any macroscopic one, its profile over the densities of the
    #: law; else one row, the macroscopic von Mises stress.
    demand: FloatArray
    #: ``(b, M)``. Utilisation of the resistance against buckling, as `LawField.buckling_profile`.
    buckling: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "buckling", locked(self.buckling, (None, None), name="buckling"))
        object.__setattr__(self, "demand", locked(self.demand, (None, None), name="demand"))


def lattice_stress(
    model: HomogenisedModel, rho: FloatArray, displacements: Mapping[str, FloatArray]
) -> tuple[LatticeStress, ...]:
    """Stress of the lattice phase of densities ``(M,)`` in every load case, in their order.

    Its demand holds at these densities.
    """
    stiffness = as_stiffness(cell_stiffness(model, rho))
    return stress_demand(model, stiffness, displacements, density_inside(model, rho))


def stress_demand(
    model: HomogenisedModel,
    stiffness: Stiffness,
    displacements: Mapping[str, FloatArray],
    rho: FloatArray | None = None,
) -> tuple[LatticeStress, ...]:
    """Demand on the lattice of the stress in a body of any stiffness on the same tetrahedra.

    ``model``: its laws, cell axes and load cases. ``stiffness``: of the body: of the lattice, or of
    the fully solid part. ``displacements``: of that body by load case, each ``(3, N)``, mm. ``rho
    (M,)``: the effective densities at which alone it is asked for; None: at any.

    Returns
    -------
    tuple of LatticeStress
        One per load case, in their order.
    """
    stresses = []
    for case in model.cases:
        displacement = displacements[case.name]
        strain = model.material.thermal_expansion * case.temperature_change
        turned = stress_in_cells(model, stiffness, case, displacement)
        buckling = model.law.buckling_profile(turned / model.material.youngs_modulus)
        if model.cut_share is not None:
            buckling = buckling / model.cut_share
        macro = None
        if model.law.needs_von_mises:
            macro = element_von_mises(model.space, stiffness, displacement, thermal_strain=strain)
        demand = model.law.stress_profile(turned, macro, rho)
        stresses.append(LatticeStress(demand=demand, buckling=buckling))
    return tuple(stresses)


def stress_in_cells(
    model: HomogenisedModel, stiffness: Stiffness, case: PartLoadCase, displacement: FloatArray
) -> FloatArray:
    """Voigt stress at the Gauss points in the axes of the cells, ``(6, M, 4)``, MPa."""
    strain = model.material.thermal_expansion * case.temperature_change
    tensor = element_stress(model.space, stiffness, displacement, thermal_strain=strain)
    return in_cell_axes(model, tensor[VOIGT_PLACES])


def in_cell_axes(model: HomogenisedModel, stress: FloatArray) -> FloatArray:
    """Turn Voigt stresses ``(6, M, 4)`` at Gauss points from global axes to those of each cell."""
    if np.array_equal(model.rotation, np.eye(6)):
        return stress
    # The inverse of a Bond matrix is its transpose, but for the factors of engineering shear.
    twice = VOIGT_COUNTS.reshape(6, *(1,) * (stress.ndim - 1))
    whole = twice * stress
    if model.rotation.ndim == 2:
        turned = np.tensordot(model.rotation.T, whole, axes=1)
    else:
        turned = np.einsum("baqm,bmq->amq", model.rotation, whole)
    return turned / twice


def from_cell_axes(model: HomogenisedModel, by_stress: FloatArray) -> FloatArray:
    """Derivatives ``(6, M, 4)`` by stresses in global axes of those by stresses in cell axes."""
    if np.array_equal(model.rotation, np.eye(6)):
        return by_stress
    twice = VOIGT_COUNTS.reshape(6, *(1,) * (by_stress.ndim - 1))
    whole = by_stress / twice
    if model.rotation.ndim == 2:
        turned = np.tensordot(model.rotation, whole, axes=1)
    else:
        turned = np.einsum("abqm,bmq->amq", model.rotation, whole)
    return turned * twice


def local_stress_at(model: HomogenisedModel, stress: LatticeStress, rho: FloatArray) -> FloatArray:
    """Local von Mises stress in the solid at given densities, macroscopic stress held, ``(M,)``."""
    inside = density_inside(model, rho)
    local = model.law.local_stress(stress.demand, inside)
    # Beyond the law's window, which only trimmed cells leave: in proportion to the solid.
    return local * (inside / effective_density(model, rho))


def density_inside(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Effective densities ``(M,)`` within the window of the law, which trimmed cells may leave."""
    effective = effective_density(model, rho)
    return effective if model.effective is None else np.clip(effective, *model.law.window)


def least_density(model: HomogenisedModel, stress: LatticeStress, permitted: float) -> FloatArray:
    """Density that keeps the local stress within ``permitted`` MPa, macroscopic stress held.

    ``(M,)``; the top of the law's window where that is not enough.
    """
    return nominal_density(model, model.law.density_for_stress(stress.demand, permitted))
