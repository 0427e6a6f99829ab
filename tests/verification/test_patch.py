"""Patch tests and rigid bodies: what any element must do exactly."""

import numpy as np
import pytest
from meshes import box_mesh, solve_one, uniform

from gradedesign.arrays import VOIGT
from gradedesign.errors import SolverError
from gradedesign.geometry.tets.tet_mesh import TetMesh, boundary_facets
from gradedesign.mechanics.fe.assembly import assemble, assembly_pattern, matvec
from gradedesign.mechanics.fe.facets import outward_area_vectors
from gradedesign.mechanics.fe.loads import traction_force
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.stiffness import AnisotropicStiffness
from gradedesign.mechanics.fe.stress import element_stress
from gradedesign.mechanics.fe.supports import Supports, supports_at

# A displacement gradient with all six strains and a rotation.
GRADIENT = 1e-3 * np.array([[1.0, -2.0, 0.5], [0.3, 0.7, 1.1], [-0.4, 0.2, -1.3]])


def disturbed_box():
    """A box with randomly moved vertices inside."""
    mesh = box_mesh((3.0, 2.0, 1.0), (4, 3, 3))
    points = np.array(mesh.points)
    inside = np.ones(points.shape[1], dtype=bool)
    inside[np.unique(boundary_facets(mesh)[0])] = False
    points[:, inside] += np.random.default_rng(31).uniform(-0.08, 0.08, (3, inside.sum()))
    return TetMesh(points=points, tets=mesh.tets)


def materials(space):
    """Isotropic, and one without any symmetry."""
    root = np.random.default_rng(37).normal(size=(6, 6)) + 3 * np.eye(6)
    general = np.repeat((1e4 * root @ root.T)[:, :, None], space.element_count, axis=2)
    return {"isotropic": uniform(space, 210e3, 0.3), "general": AnisotropicStiffness(C=general)}


def exact_stress(stiffness):
    strain = 0.5 * (GRADIENT + GRADIENT.T)
    engineering = np.array([*np.diag(strain), *(2 * strain[p] for p in [(1, 2), (0, 2), (0, 1)])])
    if isinstance(stiffness, AnisotropicStiffness):
        return (stiffness.C[:, :, 0] @ engineering)[VOIGT]
    # Hooke's law with E = 210 GPa, nu = 0.3, by hand.
    E, nu = 210e3, 0.3
    lam, mu = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
    return 2 * mu * strain + lam * np.trace(strain) * np.eye(3)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("kind", ["isotropic", "general"])
def test_linear_displacement_on_the_boundary_gives_it_inside(order, kind):
    space = tet_space(disturbed_box(), order)
    stiffness = materials(space)[kind]
    exact = GRADIENT @ space.nodes
    surface = ((space.nodes == 0) | (space.nodes == [[3.0], [2.0], [1.0]])).any(axis=0)
    fixed = np.tile(surface, (3, 1))
    supports = Supports(fixed=fixed, value=np.where(fixed, exact, 0.0))
    solution = solve_one(space, stiffness, supports, np.zeros_like(exact), rtol=1e-12)
    assert (~surface).sum() >= 12
    assert np.abs(solution.displacement - exact).max() <= 1e-10 * np.abs(exact).max()
    expected = exact_stress(stiffness)
    for at in ("gauss", "vertices"):
        stress = element_stress(space, stiffness, solution.displacement, at=at)
        error = np.abs(stress - expected[:, :, None, None]).max()
        assert error <= 1e-9 * np.abs(expected).max()


@pytest.mark.parametrize("order", [1, 2])
def test_constant_stress_on_the_boundary_gives_it_inside(order):
    # Six components held at three vertices allow every constant strain; tractions do the rest.
    space = tet_space(disturbed_box(), order)
    stiffness = materials(space)["general"]
    stress = exact_stress(stiffness)
    facets, _ = boundary_facets(space.mesh)
    outward = outward_area_vectors(space, facets)
    force = traction_force(space, facets, stress @ (outward / np.linalg.norm(outward, axis=0)))
    corner = [
        int(np.abs(space.mesh.points.T - p).sum(axis=1).argmin())
        for p in ([0.0, 0, 0], [3.0, 0, 0], [0.0, 2, 0])
    ]
    held = supports_at(
        space,
        [
            (corner[:1], (0.0, 0.0, 0.0)),
            (corner[1:2], (None, 0.0, 0.0)),
            (corner[2:], (None, None, 0.0)),
        ],
    )
    solution = solve_one(space, stiffness, held, force, rtol=1e-12)
    found = element_stress(space, stiffness, solution.displacement)
    error = np.abs(found - stress[:, :, None, None]).max()
    assert error <= 1e-9 * np.abs(stress).max()
    # The held corners carry nothing.
    assert np.abs(solution.reaction).max() <= 1e-8 * np.abs(force).max()


@pytest.mark.parametrize("order", [1, 2])
def test_rigid_motion_costs_nothing(order):
    space = tet_space(disturbed_box(), order)
    for stiffness in materials(space).values():
        matrix = assemble(assembly_pattern(space), stiffness)
        size = np.abs(matrix.data).max()
        for axis in np.eye(3):
            move = np.tile(axis[:, None], space.node_count)
            turn = np.cross(axis, space.nodes, axisb=0, axisc=0)
            for motion in (move, turn):
                assert np.abs(matvec(matrix, motion)).max() <= 1e-12 * size * np.abs(motion).max()
        # Stretching is no rigid motion.
        assert np.abs(matvec(matrix, space.nodes)).max() > 1e-3 * size


def test_a_free_body_is_refused_even_in_balance():
    space = tet_space(box_mesh((3.0, 1.0, 1.0), (3, 1, 1)))
    facets, _ = boundary_facets(space.mesh)
    x = space.mesh.points[0][facets]
    pull = traction_force(space, facets[(x == 3.0).all(axis=1)], (1.0, 0.0, 0.0))
    pull += traction_force(space, facets[(x == 0.0).all(axis=1)], (-1.0, 0.0, 0.0))
    free = supports_at(space, [])
    with pytest.raises(SolverError, match="leave rigid motions free"):
        solve_one(space, uniform(space, 210e3, 0.3), free, pull)
