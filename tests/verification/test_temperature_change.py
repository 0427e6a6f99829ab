"""A bar between walls that is heated: its stress is that of the expansion held back."""

import numpy as np
import pytest
from finite_cell_solids import (
    analyse,
    box_field,
    box_regions,
    load_case,
    problem,
    stress_sample,
)
from meshes import box_mesh, face

from gradedesign.design.resolve.solid_part import solid_solutions
from gradedesign.errors import CaseError
from gradedesign.mechanics.fe.load_case import PartLoadCase
from gradedesign.mechanics.fe.multigrid_solver import MULTIGRID
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.stiffness import dense_stiffness
from gradedesign.mechanics.fe.stress import element_stress
from gradedesign.mechanics.fe.supports import supports_on
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawOrigin
from gradedesign.mechanics.sizing.homogenised import solve_homogenised
from gradedesign.mechanics.sizing.homogenised_model import homogenised_model
from gradedesign.mechanics.sizing.lattice_stiffness import as_stiffness, effective_stiffness

SIZE, CHANGE = (12.0, 4.0, 3.0), 60.0
HOT = Material(
    name="hot", youngs_modulus=100e3, poissons_ratio=0.3, density=4e-9, yield_strength=400.0,
    thermal_expansion=1e-5,
)  # fmt: skip
STRESS = -HOT.youngs_modulus * HOT.thermal_expansion * CHANGE
LAW = power_law(
    "test-law", ("test",), youngs=(0.6, 1.4), strength=(0.4, 1.3), window=(0.05, 0.9),
    origin=LawOrigin(kind="fe", source="this test", test="none"),
)  # fmt: skip
#: Both ends held along the bar, two sides along their normals: it is free to grow across.
HELD = [("x0", "x"), ("x1", "x"), ("y0", "y"), ("z0", "z")]


def bar():
    mesh = box_mesh(SIZE, (6, 2, 2))
    space = tet_space(mesh)
    held = [(face(mesh, "xyz".index(n[0]), float(n[1]) * SIZE["xyz".index(n[0])]), c)
            for n, c in HELD]  # fmt: skip
    supports = supports_on(
        space, [(f, tuple(0.0 if c == axis else None for axis in "xyz")) for f, c in held]
    )
    case = PartLoadCase(
        name="hot", supports=supports, force=np.zeros(space.nodes.shape),
        acceleration=np.zeros(3), temperature_change=CHANGE,
    )  # fmt: skip
    return space, case


def assert_pressed(stress, expected):
    """Along the bar alone, and everywhere the same."""
    assert stress[0, 0] == pytest.approx(np.full(stress.shape[2:], expected), rel=1e-4)
    rest = stress.copy()
    rest[0, 0] = 0.0
    assert np.abs(rest).max() < 1e-4 * abs(expected)


def test_solid_part():
    space, case = bar()
    (solution,) = solid_solutions(space, [case], HOT, MULTIGRID)
    strain = HOT.thermal_expansion * CHANGE
    stiffness = dense_stiffness(space, HOT)
    assert_pressed(
        element_stress(space, stiffness, solution.displacement, thermal_strain=strain), STRESS
    )


def test_homogenised_lattice():
    space, case = bar()
    model = homogenised_model(space, np.zeros(space.element_count), HOT, LAW, [case])
    rho = np.full(space.element_count, 0.3)
    (solution,) = solve_homogenised(model, rho)
    stress = element_stress(
        space, as_stiffness(effective_stiffness(model, rho)), solution.displacement,
        thermal_strain=HOT.thermal_expansion * CHANGE,
    )  # fmt: skip
    # Its Young's modulus, and the expansion of the material.
    assert_pressed(stress, STRESS * 0.6 * 0.3**1.4)


def test_finite_cells():
    upper = np.array(SIZE)
    case = load_case("hot", HELD, [], temperature_change=f"{CHANGE} K")
    solid = problem(
        box_field((0, 0, 0), upper), (0, 0, 0), upper, [case], box_regions((0, 0, 0), upper), HOT
    )
    assert_pressed(stress_sample(analyse(solid, 0.9), "hot").stress, STRESS)


def test_a_material_that_does_not_expand_is_refused():
    from gradedesign.design.resolve.resolve import require_expansion

    cold = Material(
        name="cold", youngs_modulus=100e3, poissons_ratio=0.3, density=4e-9, yield_strength=400.0
    )
    case = load_case("hot", HELD, [], temperature_change="60 K")
    with pytest.raises(CaseError, match=r"case.toml, load_case\[0\].temperature_change: found 60 K,"
                       r" but cold has no thermal expansion"):  # fmt: skip
        require_expansion([case], cold, "case.toml, {}".format)
    require_expansion([case], HOT, str)
