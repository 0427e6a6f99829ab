"""Sizing under a least load factor: the lightest square column, whose two modes are equal."""

from dataclasses import replace

import numpy as np
import pytest
from finite_cell_solids import (
    STEEL,
    analyse,
    box_regions,
    gyroid_sheet,
    load_case,
    newtons,
    problem,
)
from meshes import face, mapped_mesh
from scipy.sparse import csr_matrix

from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.geometry.tets.tet_mesh import boundary_facets, centroids
from gradedesign.mechanics.fe.load_case import PartLoadCase
from gradedesign.mechanics.fe.loads import traction_force
from gradedesign.mechanics.fe.modes import ModeGoal
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.supports import supports_on
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.part_buckling import PartBucklingLimit
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawOrigin
from gradedesign.mechanics.sizing.filter import DensityFilter
from gradedesign.mechanics.sizing.homogenised import lattice_mass
from gradedesign.mechanics.sizing.homogenised_model import homogenised_model
from gradedesign.mechanics.sizing.problem import SizingProblem
from gradedesign.mechanics.sizing.size import size
from gradedesign.mechanics.sizing.state import solved_state
from gradedesign.program.host.registry import build_registry

#: Stiffness goes with density, so that Euler's column is the lightest for a known distribution.
LAW = power_law(
    "test-law", ("test",), youngs=(0.9, 1.0), strength=(0.4, 1.0), window=(0.02, 0.95),
    origin=LawOrigin(kind="fe", source="this test", test="none"),
)  # fmt: skip
MATERIAL = Material(
    name="test", youngs_modulus=100e3, poissons_ratio=0.0, density=4e-9, yield_strength=100.0
)
#: Slender: at half the length shear, most of it near the light end, takes 2 % of the mass.
LENGTH = 120.0
LIMIT = PartBucklingLimit(
    key=LimitKey(kind="part_buckling", load_case="pressed"), name="buckling", allowed=1.0
)


@pytest.fixture(scope="module")
def column():
    """A square column of lattice, held at one end and pressed at the other."""
    mesh = box_part_mesh((LENGTH, 6.0, 6.0), 3.0)
    space = tet_space(mesh, 2)
    facets, _ = boundary_facets(mesh)
    x = mesh.points[0][facets]
    root, tip = facets[(x < 1e-9).all(axis=1)], facets[(x > LENGTH - 1e-9).all(axis=1)]
    case = PartLoadCase(
        name="pressed",
        supports=supports_on(space, [(root, (0.0, 0.0, 0.0))]),
        force=traction_force(space, tip, np.array([-1.0, 0.0, 0.0])),
        acceleration=np.zeros(3),
    )
    return homogenised_model(space, np.zeros(space.element_count), MATERIAL, LAW, [case])


def at_least(least):
    return replace(LIMIT, allowed=least)


def factors(model, rho):
    return solved_state(model, rho, [LIMIT]).load_factors("pressed").values


def test_the_lightest_column_is_a_parabola_and_holds_both_equal_modes(column):
    """Densities alike over every section, by a filter along the column.

    Where stiffness goes with density, of all columns of one mass and load the one whose bending
    energy is equally dense buckles last: its density falls as ``1 - (x / L)^2`` and its force is
    ``12 / pi^2`` times that of the uniform one (J. B. Keller, The shape of the strongest column,
    Arch. Rational Mech. Anal. 5, 1960, for such sections).
    """
    alike = np.full(column.volumes.size, 0.4)
    least = float(factors(column, alike)[0])
    along = centroids(column.space.mesh)[0]
    slices = np.floor(along / 3.0).astype(int)
    by_slice = DensityFilter(factors=(csr_matrix(np.eye(slices.max() + 1)[slices]),))
    found = size(
        SizingProblem(
            model=column, limits=(at_least(least),), bounds=(0.02, 0.95), filter=by_slice
        ),
        max_iterations=40,
    )
    assert found.feasible
    lighter = lattice_mass(column, found.rho) / lattice_mass(column, alike)
    # Sizing counts two equal factors as 0.4 % less than one.
    assert lighter == pytest.approx(np.pi**2 / 12 * 2 ** (1 / 160), rel=0.01)
    height = found.rho / 0.4 / lighter * (2 / 3)
    expected = 1 - (along / LENGTH) ** 2
    inner = (along > 3.0) & (along < 0.9 * LENGTH)
    assert np.abs(height - expected)[inner].max() < 0.02
    ends = factors(column, found.rho)
    assert ends[1] == pytest.approx(ends[0], rel=5e-3)
    assert ends[0] == pytest.approx(least, rel=0.01)


@pytest.mark.slow
def test_a_printed_column_buckles_earlier_as_far_as_it_is_softer():
    """Gyroid sheets of density 0.3, two cells across, between plates of an eighth, held at one end.

    As in the test of its frequency: free faces soften few cells, by 34 % in the work of a force on
    the free end across it, and what the mode bends is as much softer.
    """
    cells, side = (4, 2, 2), 4.0
    ends = np.concatenate([[0.0, 0.125], np.linspace(0.5, 3.5, 7), [3.875, 4.0]])
    mesh = mapped_mesh(
        (10, 4, 4),
        lambda u: np.stack([np.interp(u[0], np.linspace(0, 1, 11), ends), *(2.0 * u[1:])]),
    )
    space, along = tet_space(mesh, 2), centroids(mesh)[0]
    supports = supports_on(space, [(face(mesh, 0, 0.0), (0.0, 0.0, 0.0))])
    loads = {"pressed": np.array([-1.0, 0.0, 0.0]), "bent": np.array([0.0, 0.0, -1.0])}
    cases = [
        PartLoadCase(
            name=name, supports=supports, acceleration=np.zeros(3),
            force=traction_force(space, face(mesh, 0, 4.0), load / side),
        )
        for name, load in loads.items()
    ]  # fmt: skip
    law = build_registry().scaling_laws["gyroid-sheet-computed"]
    solid = np.where((along < 0.125) | (along > 3.875), 1.0, 0.0)
    model = homogenised_model(space, solid, STEEL, law, cases)
    state = solved_state(model, np.full(space.element_count, 0.3), [LIMIT])
    predicted = LIMIT.predict(state).value
    work = float((state.force("bent") * state.displacement("bent")).sum())
    fix = [("x0", "xyz")]
    printed = [
        load_case(name, fix, [("x1", {"force": newtons(*load.tolist())})])
        for name, load in loads.items()
    ]
    goal = {"first": ModeGoal(load_case="pressed", number=1, buckling=True)}
    found = analyse(
        problem(
            gyroid_sheet(0.4639, cells), (0, 0, 0), cells, printed, box_regions((0, 0, 0), cells),
            modes=goal,
        ),
        1 / 6,
    )  # fmt: skip
    earlier, softer = found.mode_values["first"] / predicted, found.work["bent"] / work
    assert earlier < 0.8
    assert earlier * softer == pytest.approx(1.0, abs=0.05)
