"""Sizing under a least natural frequency: the lightest beam, whose two bending modes are equal."""

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

from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.geometry.tets.tet_mesh import boundary_facets, centroids
from gradedesign.mechanics.fe.load_case import PartLoadCase
from gradedesign.mechanics.fe.loads import traction_force
from gradedesign.mechanics.fe.modes import ModeGoal
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.supports import supports_on
from gradedesign.mechanics.limits.frequency import FrequencyLimit
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawOrigin
from gradedesign.mechanics.sizing.filter import cone_filter
from gradedesign.mechanics.sizing.homogenised import homogenised_system, lattice_mass, total_mass
from gradedesign.mechanics.sizing.homogenised_model import homogenised_model
from gradedesign.mechanics.sizing.problem import SizingProblem
from gradedesign.mechanics.sizing.size import size
from gradedesign.mechanics.sizing.state import solved_state
from gradedesign.program.host.registry import build_registry

#: Stiffness grows with the 1.4th power of density, so that uniform denser beams vibrate faster.
LAW = power_law(
    "test-law", ("test",), youngs=(0.6, 1.4), strength=(0.4, 1.3), window=(0.05, 0.9),
    origin=LawOrigin(kind="fe", source="this test", test="none"),
)  # fmt: skip
MATERIAL = Material(
    name="test", youngs_modulus=100e3, poissons_ratio=0.3, density=4e-9, yield_strength=100.0
)
BOUNDS = (0.1, 0.8)


@pytest.fixture(scope="module")
def beam():
    """A square beam of lattice, held at one end."""
    mesh = box_part_mesh((48.0, 8.0, 8.0), 4.0)
    space = tet_space(mesh, 2)
    facets, _ = boundary_facets(mesh)
    x = mesh.points[0][facets]
    root, tip = facets[(x < 1e-9).all(axis=1)], facets[(x > 48 - 1e-9).all(axis=1)]
    case = PartLoadCase(
        name="held",
        supports=supports_on(space, [(root, (0.0, 0.0, 0.0))]),
        force=traction_force(space, tip, np.array([0.0, 0.0, -1.0])),
        acceleration=np.zeros(3),
    )
    return homogenised_model(space, np.zeros(space.element_count), MATERIAL, LAW, [case])


def limit(least, number=1):
    return FrequencyLimit(
        key=LimitKey(kind="frequency", component=f"mode {number}", load_case="held"),
        name="frequency", allowed=least, number=number,
    )  # fmt: skip


def frequencies(model, rho):
    limits = [limit(1.0)]
    system = homogenised_system(model, rho)
    return solved_state(model, rho, limits, system).modes("held").frequencies


def test_a_graded_beam_is_lighter_than_a_uniform_one_and_holds_both_equal_modes(beam):
    alike = np.full(beam.volumes.size, 0.4)
    least = float(frequencies(beam, alike)[0])
    radius = cone_filter(centroids(beam.space.mesh), beam.volumes, 8.0)
    graded = size(SizingProblem(model=beam, limits=(limit(least),), bounds=BOUNDS, filter=radius))
    assert graded.feasible
    assert graded.converged
    assert len(graded.history) < 20
    found = frequencies(beam, graded.rho)
    assert (found[:2] >= least * (1 - 5e-3)).all()
    # The two bending modes stay together: neither is raised at the cost of the other.
    assert found[1] == pytest.approx(found[0], rel=0.02)
    assert found[0] == pytest.approx(least, rel=5e-3)
    # A third of the mass: the root carries, the tip only weighs.
    assert lattice_mass(beam, graded.rho) < 0.35 * lattice_mass(beam, alike)
    along = centroids(beam.space.mesh)[0]
    assert graded.rho[along > 36].max() < 1.05 * BOUNDS[0]
    assert graded.rho[along < 12].mean() > 1.6 * BOUNDS[0]


def test_another_mode_than_the_lowest_may_be_limited(beam):
    rho = np.full(beam.volumes.size, 0.3)
    found = frequencies(beam, rho)
    state = solved_state(beam, rho, [limit(1.0, 3)])
    assert limit(1.0, 3).predict(state).value == pytest.approx(found[2], rel=1e-6)


@pytest.mark.slow
def test_a_printed_lattice_vibrates_slower_as_far_as_it_is_softer():
    """Gyroid sheets of density 0.3, two cells across, between plates of an eighth, held at one end.

    Free faces soften few cells, which the periodic law does not know: 34 % in the work of a force
    on the free end, so that the frequency is 13 % lower. Their product says whether mass and
    stiffness of prediction and finite cells go together; shear that the force causes and the mode
    does not leaves 2 %.
    """
    cells, side = (4, 2, 2), 4.0
    ends = np.concatenate([[0.0, 0.125], np.linspace(0.5, 3.5, 7), [3.875, 4.0]])
    mesh = mapped_mesh(
        (10, 4, 4),
        lambda u: np.stack([np.interp(u[0], np.linspace(0, 1, 11), ends), *(2.0 * u[1:])]),
    )
    space, along = tet_space(mesh, 2), centroids(mesh)[0]
    case = PartLoadCase(
        name="held",
        supports=supports_on(space, [(face(mesh, 0, 0.0), (0.0, 0.0, 0.0))]),
        force=traction_force(space, face(mesh, 0, 4.0), np.array([0.0, 0.0, -1.0 / side])),
        acceleration=np.zeros(3),
    )
    law = build_registry().scaling_laws["gyroid-sheet-computed"]
    solid = np.where((along < 0.125) | (along > 3.875), 1.0, 0.0)
    model = homogenised_model(space, solid, STEEL, law, [case])
    rho = np.full(space.element_count, 0.3)
    state = solved_state(model, rho, [limit(1.0)])
    predicted = limit(1.0).predict(state).value
    work = float((state.force("held") * state.displacement("held")).sum())
    held = load_case("held", [("x0", "xyz")], [("x1", {"force": newtons(0.0, 0.0, -1.0)})])
    goal = {"first": ModeGoal(load_case="held", number=1)}
    found = analyse(
        problem(
            gyroid_sheet(0.4639, cells), (0, 0, 0), cells, [held],
            box_regions((0, 0, 0), cells), modes=goal,
        ),
        1 / 6,
    )  # fmt: skip
    assert found.volume * STEEL.density == pytest.approx(total_mass(model, rho), rel=5e-3)
    slower, softer = found.mode_values["first"] / predicted, found.work["held"] / work
    assert slower < 0.9
    assert slower**2 * softer == pytest.approx(1.0, abs=0.03)
