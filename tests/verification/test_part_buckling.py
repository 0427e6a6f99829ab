"""Load factors of columns and plates against their theories, on tetrahedra and finite cells.

A load factor goes with the stiffness: tolerances are below 0.5 %, so that a stiffness or a stress
that is 1 % wrong breaks them.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from finite_cell_solids import (
    STEEL,
    analyse,
    box_field,
    box_regions,
    gyroid_sheet,
    load_case,
    newtons,
    problem,
    region,
)
from meshes import box_mesh, face, uniform

from gradedesign.errors import SolverError
from gradedesign.mechanics.explicit.analysis import Discretisation
from gradedesign.mechanics.explicit.tets import solve_tets
from gradedesign.mechanics.fe.elastic_system import prepare_elastic
from gradedesign.mechanics.fe.loads import traction_force
from gradedesign.mechanics.fe.modes import ModeGoal, buckling_modes
from gradedesign.mechanics.fe.multigrid_solver import MULTIGRID
from gradedesign.mechanics.fe.solution import LoadVector
from gradedesign.mechanics.fe.solve import solve_cases
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.stress import element_stress
from gradedesign.mechanics.fe.supports import supports_on
from gradedesign.mechanics.limits.banded import Residual, banded
from gradedesign.mechanics.material.elasticity import BuildStiffness

#: Columns are of this: without lateral contraction a clamped end is what the theory takes it for.
PLAIN = replace(STEEL, poissons_ratio=0.0)
COLUMN = (100.0, 6.0, 4.0)
LOAD = 100.0
GOAL = {"first": ModeGoal(load_case="pressed", number=1, buckling=True)}


def column_force(depth, waves=1, size=COLUMN, material=PLAIN):
    """Force, N, under which a column that is held at one end buckles across a depth.

    After Euler, with shear after Engesser and the shortening of the column before it buckles: 0.03
    and 0.08 % of each for the first mode across 4 mm, four times as much across 8.
    """
    length, area = size[0], size[1] * size[2]
    E, nu = material.youngs_modulus, material.poissons_ratio
    stress = np.pi**2 * E * depth**2 / 12 * (waves / (2 * length)) ** 2
    stress /= 1.0 + stress / (5 / 6 * E / (2 * (1 + nu)))
    return area * stress * (1.0 - stress / E)


def tet_factors(size, cells, held, pressed, count, material):
    """Lowest load factors of a box whose faces (axis, place) are held and pressed, N, as stated."""
    mesh = box_mesh(size, cells)
    space = tet_space(mesh)
    stiffness = uniform(space, material.youngs_modulus, material.poissons_ratio)
    system = prepare_elastic(space, stiffness)
    supports = supports_on(space, [(face(mesh, a, p), how) for a, p, how in held])
    force = np.zeros(space.nodes.shape)
    for axis, place, value in pressed:
        traction = value * np.eye(3)[axis] / (np.prod(size) / size[axis])
        force += traction_force(space, face(mesh, axis, place), traction)
    (solution,) = solve_cases(system, [LoadVector(name="pressed", supports=supports, force=force)])
    stress = element_stress(space, stiffness, solution.displacement)
    modes = buckling_modes(system, supports.fixed, stress, count, rtol=1e-4, name="pressed")
    return modes.values


def test_clamped_column_on_tetrahedra():
    found = tet_factors(
        COLUMN, (40, 2, 2), [(0, 0.0, (0.0, 0.0, 0.0))], [(0, 100.0, -LOAD)], 3, PLAIN
    )
    expected = [column_force(4.0), column_force(6.0), column_force(4.0, 3)]
    assert LOAD * found == pytest.approx(expected, rel=1e-3)


def test_two_equal_factors_of_a_square_column_are_both_found():
    size = (100.0, 6.0, 6.0)
    found = tet_factors(
        size, (40, 2, 2), [(0, 0.0, (0.0, 0.0, 0.0))], [(0, 100.0, -LOAD)], 3, PLAIN
    )
    first, second = (column_force(6.0, waves, size) for waves in (1, 3))
    assert LOAD * found == pytest.approx([first, first, second], rel=2e-3)


def test_a_column_between_walls_buckles_by_heat():
    """Clamped at both ends and heated: the stress is that of the expansion that they hold back."""
    size, material = (100.0, 6.0, 4.0), replace(PLAIN, thermal_expansion=1e-5)
    solid = problem(
        box_field((0, 0, 0), size), (0, 0, 0), size,
        [load_case("pressed", [("x0", "xyz"), ("x1", "xyz")], [], temperature_change="10 K")],
        box_regions((0, 0, 0), size), material, modes=GOAL,
    )  # fmt: skip
    (solution,) = analyse(solid, 2.0).solutions
    # Euler's column clamped at both ends is one of half the length held at one end, and so on.
    critical = column_force(4.0, 4, size) / (size[1] * size[2])
    change = critical / (material.youngs_modulus * material.thermal_expansion)
    assert 10.0 * solution.modes["first"].value == pytest.approx(change, rel=4e-3)


def pressed_column(size, turn=None, material=PLAIN):
    """A column on finite cells, held at one end and pressed at the other."""
    upper = np.array(size)
    held = load_case("pressed", [("x0", "xyz")], [("x1", {"force": newtons(-LOAD, 0.0, 0.0)})])
    field, regions = box_field((0, 0, 0), upper), box_regions((0, 0, 0), upper)
    if turn is None:
        return problem(field, (0, 0, 0), upper, [held], regions, material, modes=GOAL)
    away = turn @ np.array([-LOAD, 0.0, 0.0])
    held = load_case("pressed", [("x0", "xyz")], [("x1", {"force": newtons(*away.tolist())})])
    corners = turn @ np.stack(np.meshgrid(*((0.0, s) for s in size))).reshape(3, -1)
    low, high = corners.min(axis=1) - 0.5, corners.max(axis=1) + 0.5
    turned = {name: region(name, r.corners @ turn.T) for name, r in regions.items()}
    return problem(
        lambda x: field(np.einsum("ba,b...->a...", turn, x)), low, high, [held], turned, PLAIN,
        modes=GOAL,
    )  # fmt: skip


def cell_factor(solid, spacing):
    """Load factor of a problem on finite cells, and its residuals over it."""
    (solution,) = analyse(solid, spacing).solutions
    value, residual = solution.modes["first"].value, solution.goals["first"]
    return value, residual.rise / value, residual.fall / value


@pytest.mark.parametrize(("axis", "modulus"), [(0, 0.6), (1, 1.0)])
def test_a_column_buckles_by_the_modulus_along_it(axis, modulus):
    """Built along x it is 0.6 times as stiff there; what it is across it hardly matters."""
    build = BuildStiffness(axis=axis, along=0.6)
    found, *_ = cell_factor(pressed_column(COLUMN, material=replace(PLAIN, build=build)), 2.0)
    softer = replace(PLAIN, youngs_modulus=modulus * PLAIN.youngs_modulus)
    assert LOAD * found == pytest.approx(column_force(4.0, material=softer), rel=3e-3)


def test_clamped_column_on_finite_cells():
    found, rise, fall = cell_factor(pressed_column(COLUMN), 2.0)
    assert LOAD * found == pytest.approx(column_force(4.0), rel=1e-3)
    assert 0.0 <= rise < fall < 0.02


def test_a_column_that_cuts_its_elements():
    angle = 0.35
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0, 0, 1.0]]
    )
    found, _, fall = cell_factor(pressed_column((60.0, 6.0, 4.0), turn), 1.3)
    expected = column_force(4.0, size=(60.0, 6.0, 4.0))
    assert expected * (1.0 - 4e-3) < LOAD * found < expected * (1.0 + fall)


#: Lowest value of ``N b^2 / D`` of a clamped square plate pressed alike along both sides: P. E.
#: Bjorstad, B. P. Tjostheim, High precision solutions of two fourth order eigenvalue problems,
#: Computing 63, 1999.
CLAMPED_PLATE = 52.344691
PLATE = (120.0, 120.0, 1.2)
HEATED = replace(STEEL, thermal_expansion=1.2e-5)


def plate_temperature(size=PLATE, material=HEATED):
    """Temperature change, K, at which a clamped square plate buckles, but for its shear.

    Held all round, it is pressed by ``E alpha dT h / (1 - nu)``. Shear takes 0.15 % at a thickness
    of a hundredth of the side.
    """
    side, _, thick = size
    E, nu = material.youngs_modulus, material.poissons_ratio
    force = CLAMPED_PLATE * E * thick**3 / (12 * (1 - nu**2)) / side**2
    return force * (1 - nu) / (E * thick * material.thermal_expansion)


def heated_plate():
    fix = [(name, "xyz") for name in ("x0", "x1", "y0", "y1")]
    case = load_case("pressed", fix, [], temperature_change="10 K")
    return problem(
        box_field((0, 0, 0), PLATE), (0, 0, 0), np.array(PLATE), [case],
        box_regions((0, 0, 0), PLATE), HEATED, modes=GOAL,
    )  # fmt: skip


def on_tetrahedra(solid, cells):
    """Load factor of a problem on tetrahedra that fill its box."""
    known = SimpleNamespace(
        load_cases=solid.cases, regions=solid.regions, material=solid.material,
        solver=MULTIGRID, modes=solid.modes,
    )  # fmt: skip
    division = Discretisation(made_by="test", mesh_size=1.0, unknowns=0, requested=1.0)
    return solve_tets(box_mesh(solid.upper, cells), known, division, 1e-6).mode_values["first"]


def test_clamped_plate_buckles_by_heat_on_tetrahedra():
    found = on_tetrahedra(heated_plate(), (40, 40, 1))
    assert 10.0 * found == pytest.approx(0.9985 * plate_temperature(), rel=4e-3)


def test_clamped_plate_buckles_by_heat_on_finite_cells():
    found, _, _ = cell_factor(heated_plate(), 4.0)
    assert 10.0 * found == pytest.approx(0.9985 * plate_temperature(), rel=4e-3)


def test_tetrahedra_and_finite_cells_of_a_printed_solid_find_the_same():
    upper = np.array([40.0, 6.0, 4.0])
    case = load_case(
        "pressed", [("x0", "xyz")], [("x1", {"force": newtons(-LOAD, 5.0, 20.0)})],
        temperature_change="3 K",
    )  # fmt: skip
    regions = box_regions((0, 0, 0), upper)
    solid = problem(
        box_field((0, 0, 0), upper), (0, 0, 0), upper, [case], regions, HEATED, modes=GOAL
    )
    found, _, _ = cell_factor(solid, 1.0)
    assert on_tetrahedra(solid, (40, 6, 4)) == pytest.approx(found, rel=2e-3)


def test_what_is_pulled_does_not_buckle():
    with pytest.raises(SolverError, match=r"its loads compress nothing.*\[limits\] part_buckling"):
        tet_factors(COLUMN, (10, 1, 1), [(0, 0.0, (0.0,) * 3)], [(0, 100.0, LOAD)], 1, PLAIN)


@pytest.mark.slow
def test_the_band_of_a_load_factor_holds_that_of_finer_elements():
    """A bar of three gyroid sheet cells between plates: coarse elements buckle 2 % too late."""
    upper = (3, 1, 1)
    field, regions = gyroid_sheet(0.4639, upper), box_regions((0, 0, 0), upper)
    held = load_case("pressed", [("x0", "xyz")], [("x1", {"force": newtons(-LOAD, 0.0, 0.0)})])
    solid = problem(field, (0, 0, 0), upper, [held], regions, modes=GOAL)
    spacings = (1 / 8, 1 / 12, 1 / 20)
    found = [cell_factor(solid, spacing) for spacing in spacings]
    values = [(h, value) for h, (value, _, _) in zip(spacings, found, strict=True)]
    lost = [Residual(rise=rise, fall=fall) for _, rise, fall in found]
    band = banded(values[:2], (0.75, 1.5, 3.0), lost[:2])
    assert band.order == "residual"
    assert band.low < values[2][1] < values[1][1] < values[0][1]
    assert band.half_width < 0.05
