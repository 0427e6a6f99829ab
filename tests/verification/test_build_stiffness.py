"""Solids that are stiffer along the direction they are built in. Expected numbers are analytic."""

from dataclasses import replace

import numpy as np
import pytest
from finite_cell_solids import (
    STEEL,
    analyse,
    box_regions,
    displacement_at,
    load_case,
    newtons,
    problem,
    stress_sample,
)
from hypothesis import given
from hypothesis import strategies as st
from meshes import box_mesh

from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.stiffness import dense_stiffness
from gradedesign.mechanics.finite_cell.load_cases import Accuracy
from gradedesign.mechanics.finite_cell.traction_residual import energy_density, mean_modulus
from gradedesign.mechanics.material.elasticity import (
    BuildStiffness,
    principal_moduli,
    stiffness_matrix,
)
from gradedesign.mechanics.material.scaling_law import isotropic_stiffness

#: The soft void is no part of the exact solution.
HARD = Accuracy(softness=1e-11, residual=1e-12, energy=0.0)
ALONG, E, NU = 0.6, STEEL.youngs_modulus, STEEL.poissons_ratio


def built(axis, shear=None):
    """Steel that is 0.6 times as stiff along an axis."""
    material = replace(
        STEEL, build=BuildStiffness(axis=axis, along=ALONG, shear=shear), thermal_expansion=1e-5
    )
    moduli = np.full(3, E)
    moduli[axis] *= ALONG
    return material, moduli


def solved(material, case, low=0.0):
    """Analysis of 3 x 2 x 1 mm on finite cells of 0.5 mm, which it cuts across x from ``low`` on.

    Supports are exact where they lie on the grid.
    """
    lower, upper = np.array([low, 0.0, 0.0]), np.array([low + 3.0, 2.0, 1.0])

    def field(p):
        return np.maximum(low - p[0], p[0] - upper[0])

    far, regions = (np.ceil(2.0 * upper[0]) / 2.0, 2.0, 1.0), box_regions(lower, upper)
    solid = problem(field, (0, 0, 0), far, [case], regions, material=material)
    return analyse(solid, 0.5, accuracy=HARD)


ENDS = np.array([[0.4, 2.8], [0.2, 1.8], [0.2, 0.8]])


@pytest.mark.parametrize("axis", range(3))
def test_strains_in_tension_follow_both_moduli(axis):
    material, moduli = built(axis)
    case = load_case(
        "tension",
        [("x0", "x"), ("y0", "y"), ("z0", "z")],
        [("x1", {"force": newtons(6.0e3, 0, 0)})],
    )
    result = solved(material, case, 0.11)
    stretch = np.diff(displacement_at(result, "tension", ENDS))[:, 0] / np.diff(ENDS)[:, 0]
    stress = 6.0e3 / 2.0
    expected = -NU * stress / np.sqrt(moduli[0] * moduli)
    expected[0] = stress / moduli[0]
    np.testing.assert_allclose(stretch, expected, rtol=1e-7)
    sample = stress_sample(result, "tension")
    mean = np.average(sample.stress, axis=2, weights=sample.volume)
    np.testing.assert_allclose(mean, np.diag([stress, 0.0, 0.0]), atol=1e-6 * stress)


@pytest.mark.parametrize(("axis", "shear"), [(0, None), (1, 0.7), (2, None), (2, 0.7)])
def test_shear_has_its_own_modulus_in_planes_along_the_build_direction(axis, shear):
    material, _ = built(axis, shear)
    across = E / (2 * (1 + NU))
    expected = 1.0 / (1 / E + 1 / (ALONG * E) + 2 * NU / (E * ALONG**0.5))
    expected = across if axis == 2 else expected if shear is None else shear * across
    tau = 100.0
    case = load_case(
        "shear",
        [("y0", "xyz")],
        [
            ("x0", {"force": newtons(0, -2.0 * tau, 0)}),
            ("x1", {"force": newtons(0, 2.0 * tau, 0)}),
            ("y1", {"force": newtons(3.0 * tau, 0, 0)}),
        ],
    )
    moved = displacement_at(solved(material, case), "shear", ENDS)
    assert moved[0, 1] - moved[0, 0] == pytest.approx(1.6 * tau / expected, rel=1e-7)


@pytest.mark.parametrize("axis", range(3))
def test_heat_between_walls_presses_by_the_modulus_across_them(axis):
    material, moduli = built(axis)
    held = [("x0", "x"), ("x1", "x"), ("y0", "y"), ("z0", "z")]
    result = solved(material, load_case("hot", held, [], temperature_change="50 K"))
    sample = stress_sample(result, "hot")
    mean = np.average(sample.stress, axis=2, weights=sample.volume)
    pressed = np.zeros((3, 3))
    pressed[0, 0] = -moduli[0] * 1e-5 * 50.0
    np.testing.assert_allclose(mean, pressed, atol=1e-6 * moduli[0] * 5e-4)


@pytest.mark.parametrize("axis", range(3))
def test_tetrahedra_have_the_same_stiffness(axis):
    material, moduli = built(axis)
    C = dense_stiffness(tet_space(box_mesh((1.0, 1.0, 1.0), (1, 1, 1))), material).C
    np.testing.assert_array_equal(C[:, :, -1], material.stiffness)
    np.testing.assert_allclose(1.0 / np.diagonal(np.linalg.inv(C[:, :, 0]))[:3], moduli)


@given(
    st.integers(0, 2),
    st.floats(0.05, 3.0),
    st.one_of(st.none(), st.floats(0.05, 3.0)),
    st.floats(0.0, 0.49),
)
def test_any_stated_stiffness_is_one_of_a_solid(axis, along, shear, nu):
    """It stores energy whatever the strain, and 1 along is the isotropic one."""
    matrix = stiffness_matrix(7.0, nu, BuildStiffness(axis=axis, along=along, shear=shear))
    assert np.linalg.eigvalsh(matrix).min() > 0
    plain = isotropic_stiffness(np.array(7.0), nu)
    same = stiffness_matrix(7.0, nu, BuildStiffness(axis=axis, along=1.0))
    np.testing.assert_allclose(same, plain, atol=1e-9 * plain.max())
    moduli = principal_moduli(matrix)
    strain = np.array([0.3, -0.2, 0.5, 0.1, 0.4, -0.6])
    stress = matrix @ strain
    assert energy_density(moduli, stress[:, None])[0] == pytest.approx(0.5 * stress @ strain)
    assert mean_modulus(principal_moduli(plain)) == pytest.approx(7.0)
