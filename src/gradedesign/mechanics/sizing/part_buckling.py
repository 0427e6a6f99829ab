"""Factors of the loads at which the homogenised part buckles, and derivatives through its stress.

The stress is the macroscopic one of the homogenised solid and lattice: waves within cells are not
in it. A factor is ``1 / (x^T (-K_stress) x)`` of a shape with ``x^T K x = 1``.
"""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import VOIGT_COUNTS, VOIGT_PLACES, FloatArray
from gradedesign.mechanics.fe.elastic_system import ElasticSystem
from gradedesign.mechanics.fe.geometric_stiffness import gradient_products
from gradedesign.mechanics.fe.load_case import PartLoadCase
from gradedesign.mechanics.fe.loads import stress_force
from gradedesign.mechanics.fe.modes import buckling_modes
from gradedesign.mechanics.fe.stiffness import (
    AnisotropicStiffness,
    GaussStiffness,
    MomentStiffness,
    Stiffness,
    gauss_equivalent,
)
from gradedesign.mechanics.fe.stress import element_stress
from gradedesign.mechanics.sizing.homogenised import RTOL
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel
from gradedesign.mechanics.sizing.lattice_stiffness import (
    as_stiffness,
    effective_stiffness,
    stiffness_slopes,
)
from gradedesign.mechanics.solver.lowest_modes import Modes


def homogenised_buckling(
    model: HomogenisedModel,
    system: ElasticSystem,
    case: PartLoadCase,
    displacement: FloatArray,
    count: int,
) -> Modes:
    """Lowest modes in which the homogenised part buckles under a load case.

    ``system``: of the densities, by `homogenised_system`. ``displacement (3, N)``, mm: of the load
    case.
    """
    strain = model.material.thermal_expansion * case.temperature_change
    stress = element_stress(
        model.space, _at_points(system.stiffness), displacement, thermal_strain=strain
    )
    return buckling_modes(system, case.supports.fixed, stress, count, rtol=RTOL, name=case.name)


def through_load_factors(
    model: HomogenisedModel,
    rho: FloatArray,
    lattice_alone: HomogenisedModel | None,
    case: PartLoadCase,
    displacement: FloatArray,
    modes: Modes,
    by_factor: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Derivatives of a value that depends on load factors.

    Returns ``by_displacement (3, N)``; ``by_design (P,)``: at fixed displacements, by every
    variable of the design.

    - ``rho (M,)``
    - ``lattice_alone``: the model without its members, where their shares are variables
    - ``displacement (3, N)``, mm
    - ``modes``: of k load factors
    - ``by_factor (k,)``: derivatives of the value by each of them: equal ones of equal factors, of
      which only their sum has a derivative

    Notes
    -----
    With the factor f, ``df = f x^T dK x + f^2 x^T dK_stress x``; the work of ``K_stress`` on x is
    that of the stress on the products of derivatives of x.
    """
    space, volumes = model.space, model.volumes
    shapes = [x.reshape(-1, 3).T for x in modes.shapes]
    products = np.zeros((3, 3, space.element_count, 4))
    for factor, share, shape in zip(modes.values, by_factor, shapes, strict=True):
        products += share * factor**2 * gradient_products(space, shape)
    products *= volumes[:, None] / 4.0
    strain = model.material.thermal_expansion * case.temperature_change
    slopes = stiffness_slopes(model, rho, lattice_alone)
    works = []
    for derivative in slopes:
        stress = element_stress(space, _at_points(derivative), displacement, thermal_strain=strain)
        works.append((products * stress).sum(axis=(0, 1, 3)))
    by_design = np.concatenate(works)
    stiffer = slopes.energies(space, [(shape, shape) for shape in shapes])
    by_design += (by_factor * modes.values) @ stiffer
    C = _at_points(as_stiffness(effective_stiffness(model, rho))).C
    form = "abm,bmq->amq" if C.ndim == 3 else "abqm,bmq->amq"
    engineering = products[VOIGT_PLACES] * VOIGT_COUNTS[:, None, None]
    stress_of_products = np.einsum(form, C, engineering, optimize=True)
    return stress_force(space, stress_of_products), by_design


def _at_points(stiffness: Stiffness) -> AnisotropicStiffness | GaussStiffness:
    """Stiffness at points of the elements, from which stress follows."""
    if isinstance(stiffness, MomentStiffness):
        return gauss_equivalent(stiffness)
    if isinstance(stiffness, AnisotropicStiffness | GaussStiffness):
        return stiffness
    raise TypeError(f"the homogenised part has no {type(stiffness).__name__}")
