"""Stress of the base material where solid is strained as the homogenised part is."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import VOIGT_PLACES, FloatArray
from gradedesign.mechanics.fe.load_case import PartLoadCase
from gradedesign.mechanics.fe.loads import stress_force
from gradedesign.mechanics.fe.stiffness import IsotropicStiffness
from gradedesign.mechanics.fe.stress import element_stress, element_von_mises
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel


def solid_stress(
    model: HomogenisedModel, case: PartLoadCase, displacement: FloatArray
) -> FloatArray:
    """Von Mises stress, the mean over the points of every tetrahedron, ``(M,)``, MPa."""
    stiffness, heated = _solid(model), model.material.thermal_expansion * case.temperature_change
    stress = element_von_mises(model.space, stiffness, displacement, thermal_strain=heated)
    return np.asarray(stress.mean(axis=-1))


def through_solid_stress(
    model: HomogenisedModel, case: PartLoadCase, displacement: FloatArray, by_stress: FloatArray
) -> FloatArray:
    """Derivatives by displacements ``(3, N)`` of a value with derivatives ``(M,)`` by that stress.

    Von Mises stress q has the derivative 3 s / 2 q by the stress, with its deviator s, and so
    ``3 G s / q`` by the strain.
    """
    stiffness, heated = _solid(model), model.material.thermal_expansion * case.temperature_change
    tensor = element_stress(model.space, stiffness, displacement, thermal_strain=heated)
    deviator = tensor - np.eye(3)[:, :, None, None] * np.trace(tensor) / 3.0
    size = np.sqrt(1.5 * (deviator**2).sum(axis=(0, 1)))
    shear = model.material.youngs_modulus / (2.0 * (1.0 + model.material.poissons_ratio))
    factor = np.zeros(size.shape)
    np.divide(3.0 * shear, size, out=factor, where=size > 0)
    each = by_stress[:, None] / size.shape[1]
    return stress_force(model.space, deviator[VOIGT_PLACES] * factor * each)


def _solid(model: HomogenisedModel) -> IsotropicStiffness:
    modulus = np.full(model.space.element_count, model.material.youngs_modulus)
    return IsotropicStiffness(E=modulus, nu=model.material.poissons_ratio)
